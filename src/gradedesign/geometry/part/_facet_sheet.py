"""The facets of a surface as the search for cylinders and cones takes them, from seed to seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.part._clusters import Clusters
from gradedesign.geometry.part._edges import face_edges, linked_sets
from gradedesign.geometry.triangles.surface_mesh import corner_points

#: Facets around a seed that a first fit takes. Chosen, not measured.
_AROUND = 60
#: Facets about a seed without a find that are no seeds themselves: two rings. Of more, a seed
#: beside the rim would use up a face's own.
_GIVEN_UP = 10
#: Seeds without a find after which all facets that one has looked at are no seeds: a surface of
#: free form would try every eighth of its facets. Parts of machines that were read had at most 185.
_PATIENCE = 500
#: Neighbours across sharper edges than this are not looked at for a first fit, cosine. Chosen, not
#: measured.
_CORNER = np.cos(np.radians(60.0))
#: Flat faces above this share of the surface are no facets of a curved one. Chosen, not measured.
_FLAT_FACE = 0.02


class _Find(Protocol):
    @property
    def facets(self) -> IntArray: ...


FindT = TypeVar("FindT", bound=_Find)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FacetSheet:
    """Facets of a surface with their neighbours."""

    clusters: Clusters
    corners: FloatArray  #: ``(m, 3, 3)``, mm.
    pairs: IntArray  #: ``(e, 2)``. Facets that share an edge.
    lengths: FloatArray  #: ``(e,)``, mm. Of these edges.
    #: ``(m + 1,)``, ``(2 e,)``. Facets across the edges of facet f: ``beside[starts[f] :
    #: starts[f + 1]]``.
    starts: IntArray
    beside: IntArray
    around: tuple[IntArray, ...]  #: Neighbours of each facet but across sharp edges.
    flat: BoolArray  #: ``(m,)``. Facets of large flat faces, which no search takes.


def large_flat(clusters: Clusters, label: IntArray, kinds: list[str]) -> BoolArray:
    """Facets ``(m,)`` of large flat faces, of faces ``label`` ``(m,)`` of these kinds."""
    areas = np.bincount(label, clusters.facet_areas)
    plane = np.array([kind == "plane" for kind in kinds])
    return np.asarray((plane & (areas > _FLAT_FACE * areas.sum()))[label])


def facet_sheet(clusters: Clusters, flat: BoolArray) -> FacetSheet:
    """Gather facets, of which some ``(m,)`` belong to large flat faces."""
    faces = clusters.surface.faces
    edges = face_edges(faces)
    ends = clusters.surface.vertices[edges.ends[edges.pair_edge]]
    normals = clusters.facet_normals
    first, second = edges.pairs.T
    smooth = (normals[first] * normals[second]).sum(axis=1) >= _CORNER
    starts, beside = _neighbours(edges.pairs, len(faces))
    limits, smoothly_beside = _neighbours(edges.pairs[smooth], len(faces))
    return FacetSheet(
        clusters=clusters,
        corners=corner_points(clusters.surface),
        pairs=edges.pairs,
        lengths=np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1),
        starts=starts,
        beside=beside,
        around=tuple(np.split(smoothly_beside, limits[1:-1])),
        flat=flat,
    )


def _neighbours(pairs: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Where the neighbours of each of so many things start, ``(size + 1,)``, and all of them."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    order = np.argsort(both[:, 0], kind="stable")
    count = np.bincount(both[:, 0], minlength=size)
    return np.concatenate([[0], np.cumsum(count)]), both[order, 1]


def from_seeds(
    sheet: FacetSheet,
    free: BoolArray,
    taken: BoolArray,
    find: Callable[[IntArray], FindT | None],
) -> list[FindT]:
    """Faces that ``find`` grows from the facets around seeds, the largest facets first.

    ``free (m,)``: facets that may be seeds. ``taken (m,)``: facets of other faces, which are not
    looked at beside a seed. ``find``: from facets, the seed first, to a face that holds ``facets``,
    or None.
    """
    free = free.copy()
    seeds = np.flatnonzero(free)
    seeds = seeds[np.argsort(-sheet.clusters.facet_areas[seeds], kind="stable")]
    finds: list[FindT] = []
    failed = 0
    for seed in seeds.tolist():
        if not free[seed]:
            continue
        near = _near(sheet, seed, taken)
        found = find(near)
        if found is None:
            failed += 1
            free[near[:_GIVEN_UP] if failed <= _PATIENCE else near] = False
        else:
            free[found.facets] = False
            finds.append(found)
    return finds


def connected_facets(sheet: FacetSheet, mask: BoolArray, facets: IntArray) -> IntArray:
    """Facets of a mask that are connected to most of the given facets."""
    joined = sheet.pairs[mask[sheet.pairs].all(axis=1)]
    part = linked_sets(joined.T, len(mask))
    return np.flatnonzero(mask & (part == np.bincount(part[facets[mask[facets]]]).argmax()))


def _near(sheet: FacetSheet, seed: int, taken: BoolArray) -> IntArray:
    """Free facets around one facet, ring by ring, the facet itself first."""
    near, front = [seed], [seed]
    while front and len(near) < _AROUND:
        beside = {j for k in front for j in sheet.around[k].tolist()}.difference(near)
        front = sorted(j for j in beside if not taken[j])
        near += front
    return np.array(near)

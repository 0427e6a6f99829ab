"""Flat clusters of a surface, and which of them meet smoothly.

A cluster is a connected set of coplanar facets: one side of a box, or one strip of a facetted
hole. Smooth faces are put together from clusters.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.part._edges import Edges, face_edges, linked_sets, split_by
from gradedesign.geometry.part._face_fits import Patch
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points

#: Neighbours within this angle are coplanar, degrees; the second value splits again what turned out
#: curved: a very fine facetting. Chosen, not measured.
_COPLANAR = (0.5, 0.05)
#: Rounding of a single-precision coordinate, relative.
_ROUNDING = 1.2e-7
#: A facet flatter than this many roundings has no normal worth the name.
_SLIVER = 200.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clusters:
    """A surface cut into flat pieces."""

    surface: SurfaceMesh
    label: IntArray  #: ``(m,)``. Cluster of every facet.
    facets: tuple[IntArray, ...]  #: Facets of every cluster.
    vertices: tuple[IntArray, ...]  #: Vertices of every cluster.
    facet_normals: FloatArray  #: ``(m, 3)``. Unit; slivers carry that of their neighbour.
    facet_areas: FloatArray  #: ``(m,)``, mm^2.
    normal: FloatArray  #: ``(c, 3)``. Unit mean normals.
    area: FloatArray  #: ``(c,)``, mm^2.
    #: ``(c,)``. Whether a cluster is plane; false only for very finely facetted curved ones.
    flat: BoolArray
    #: Clusters that meet each one across an edge without a sharp angle.
    neighbours: tuple[IntArray, ...]
    #: Each ``(k, 3)``. For each of these neighbours the unit axis about which the normal turns
    #: towards it.
    turns: tuple[FloatArray, ...]
    region: IntArray  #: ``(c,)``. Number of the sharp-edged region that holds each cluster.
    noise: float  #: mm. Distances below this are rounding.


def find_clusters(surface: SurfaceMesh, angle_deg: float) -> Clusters:
    """Cut a surface into flat clusters; edges sharper than ``angle_deg`` part regions."""
    edges = face_edges(surface.faces)
    noise = 10.0 * _ROUNDING * float(np.abs(surface.vertices).max())
    normals, areas = _trusted_normals(surface, edges)
    first, second = edges.pairs.T
    turn = _angles(normals[first], normals[second])
    size = len(surface.faces)
    label = linked_sets(edges.pairs[turn < _COPLANAR[0]].T, size)
    label = _split_curved(surface, label, edges, turn, normals, areas, noise)
    facets = tuple(split_by(label, np.arange(size)))
    normal = _mean_normals(label, normals, areas)
    smooth = turn <= angle_deg + 1e-3
    region = linked_sets(edges.pairs[smooth].T, size)[np.unique(label, return_index=True)[1]]
    neighbours, turns = _adjacency(label[first[smooth]], label[second[smooth]], normal)
    used = np.unique(np.stack([label.repeat(3), surface.faces.ravel()]), axis=1)
    return Clusters(
        surface=surface,
        label=label,
        facets=facets,
        vertices=tuple(split_by(*used)),
        facet_normals=normals,
        facet_areas=areas,
        normal=normal,
        area=np.bincount(label, areas).astype(np.float64),
        flat=_flat(surface, label, normal, areas, noise),
        neighbours=neighbours,
        turns=turns,
        region=region,
        noise=noise,
    )


def patch_of(clusters: Clusters, members: Iterable[int]) -> Patch:
    """Gather the facets of some clusters."""
    return facet_patch(clusters, np.concatenate([clusters.facets[k] for k in members]))


def facet_patch(clusters: Clusters, facets: IntArray) -> Patch:
    """Gather some facets."""
    faces = clusters.surface.faces[facets]
    return Patch(
        points=clusters.surface.vertices[np.unique(faces)],
        centres=clusters.surface.vertices[faces].mean(axis=1),
        normals=clusters.facet_normals[facets],
        areas=clusters.facet_areas[facets],
    )


def connected_sets(clusters: Clusters, members: Iterable[int]) -> list[list[int]]:
    """Split clusters into sets that hang together smoothly, each in rising order."""
    waiting = set(members)
    result = []
    while waiting:
        start = min(waiting)
        component, front = {start}, [start]
        waiting.discard(start)
        while front:
            for neighbour in clusters.neighbours[front.pop()].tolist():
                if neighbour in waiting:
                    waiting.discard(neighbour)
                    component.add(neighbour)
                    front.append(neighbour)
        result.append(sorted(component))
    return result


def _angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Degrees between unit vectors, exact for small angles."""
    chord = np.linalg.norm(a - b, axis=1)
    return np.degrees(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))


def _trusted_normals(surface: SurfaceMesh, edges: Edges) -> tuple[FloatArray, FloatArray]:
    """Normals and areas of facets; a sliver borrows the normal behind its longest edge."""
    vectors = area_vectors(surface)
    areas = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(areas, 1e-300)[:, None]
    corners = corner_points(surface)
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    height = 2.0 * areas / np.maximum(lengths.max(axis=1), 1e-300)
    sliver = height < _SLIVER * _ROUNDING * np.abs(surface.vertices).max()
    if not sliver.any():
        return normals, areas
    m = len(areas)
    opposite = np.full(len(edges.count), -1, dtype=np.int64)
    opposite[edges.pair_edge] = edges.pairs.sum(axis=1)
    behind = {}
    for facet in np.flatnonzero(sliver).tolist():
        edge = edges.edge_of[int(lengths[facet].argmax()) * m + facet]
        if opposite[edge] >= 0:
            behind[facet] = int(opposite[edge]) - facet
    for facet in behind:
        source, seen = behind[facet], {facet}
        while source in behind and source not in seen:
            seen.add(source)
            source = behind[source]
        normals[facet] = normals[source]
    return normals, areas


def _split_curved(
    surface: SurfaceMesh,
    label: IntArray,
    edges: Edges,
    turn: FloatArray,
    normals: FloatArray,
    areas: FloatArray,
    noise: float,
) -> IntArray:
    """Split clusters that are not flat with a smaller angle."""
    curved = ~_flat(surface, label, _mean_normals(label, normals, areas), areas, noise)
    if not curved.any():
        return label
    limit = np.where(curved[label[edges.pairs[:, 0]]], _COPLANAR[1], _COPLANAR[0])
    return linked_sets(edges.pairs[turn < limit].T, len(label))


def _mean_normals(label: IntArray, normals: FloatArray, areas: FloatArray) -> FloatArray:
    """Area-weighted mean normals of clusters, ``(c, 3)``; zero where they cancel."""
    sums = np.stack([np.bincount(label, normals[:, k] * areas) for k in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1)
    lengths[lengths < 0.5 * np.bincount(label, areas)] = np.inf
    return sums / np.maximum(lengths, 1e-300)[:, None]


def _flat(
    surface: SurfaceMesh, label: IntArray, normal: FloatArray, areas: FloatArray, noise: float
) -> BoolArray:
    """Clusters that lie in a plane: to rounding, or to a thousandth of their size."""
    order = np.argsort(label, kind="stable")
    start = np.searchsorted(label[order], np.arange(len(normal)))
    origin = surface.vertices[surface.faces[order[start], 0]]
    offset = corner_points(surface) - origin[label][:, None]
    height = np.einsum("fkd,fd->fk", offset, normal[label])[order]
    extent = np.maximum.reduceat(height.max(axis=1), start) - np.minimum.reduceat(
        height.min(axis=1), start
    )
    defined = normal.any(axis=1)
    return defined & (extent < noise + 1e-3 * np.sqrt(np.bincount(label, areas)))


def _adjacency(
    first: IntArray, second: IntArray, normal: FloatArray
) -> tuple[tuple[IntArray, ...], tuple[FloatArray, ...]]:
    """Neighbours of every cluster, without itself, and the axes of the turns towards them."""
    pairs = np.concatenate([np.stack([first, second], 1), np.stack([second, first], 1)])
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    turn = np.cross(normal[pairs[:, 0]], normal[pairs[:, 1]])
    turn /= np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-4)  # none where parallel
    ends = np.cumsum(np.bincount(pairs[:, 0], minlength=len(normal)))[:-1]
    return tuple(np.split(pairs[:, 1], ends)), tuple(np.split(turn, ends))

"""Volume and topology of a solid from its closed surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import IntArray
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

#: Closed voids of a smaller share of the solid are no warning. Chosen, not measured.
_LEAST_VOIDS = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Solid that a closed surface bounds."""

    volume_mm3: float
    components: int  #: Connected solids.
    cavities: int  #: Closed voids.
    cavities_mm3: float  #: Their volume.
    #: Sum of the genera of all shells: 1 of a ring, 0 of a ball. None where edges are shared by
    #: more than two triangles, so that the surface has no genus.
    handles: int | None
    triangles: int


def measure_body(surface: SurfaceMesh) -> Body:
    """Measure a closed, consistently oriented surface.

    The genus of a shell is 1 - (V - E + F) / 2. A vertex in which two fans of triangles touch
    counts once for each, as if they were apart by a hair.
    """
    faces = surface.faces
    count = len(faces)
    links, clean = _shared_edges(faces, len(surface.vertices))
    vertex_count, fan = connected_components(
        coo_array((np.ones(links.shape[1], dtype=np.int8), links), shape=(3 * count, 3 * count)),
        directed=False,
    )
    # Corners of a triangle belong to one shell.
    corners = np.arange(3 * count).reshape(-1, 3)
    joins = np.concatenate([fan[corners[:, [0, 1]]], fan[corners[:, [0, 2]]]]).T
    shells, shell_of_fan = connected_components(
        coo_array(
            (np.ones(joins.shape[1], dtype=np.int8), joins), shape=(vertex_count, vertex_count)
        ),
        directed=False,
    )
    shell = shell_of_fan[fan[corners[:, 0]]]
    a, b, c = np.moveaxis(corner_points(surface) - surface.vertices.mean(axis=0), 1, 0)
    volume = np.bincount(shell, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0, shells)
    # Every shell has F triangles and 3 F / 2 edges.
    return Body(
        volume_mm3=float(volume.sum()),
        components=int(np.count_nonzero(volume > 0)),
        cavities=int(np.count_nonzero(volume <= 0)),
        cavities_mm3=float(-volume.clip(max=0.0).sum()),
        handles=shells - (2 * vertex_count - count) // 4 if clean else None,
        triangles=count,
    )


def void_warnings(voids: int, voids_mm3: float, solid_mm3: float) -> tuple[str, ...]:
    """Warning of closed voids in a printed solid, from which powder or resin cannot leave.

    ``voids_mm3``, ``solid_mm3``, mm^3: volume of the voids together, and of the solid.
    """
    if voids_mm3 <= _LEAST_VOIDS * solid_mm3:
        return ()
    many = "a closed void" if voids == 1 else f"{voids} closed voids"
    return (
        f"the printed solid has {many} of {voids_mm3:.5g} mm^3, "
        f"{voids_mm3 / solid_mm3:.0%} of its own volume: powder or resin that "
        f"fills them cannot leave, and no mass here counts it; [lattice] drain opens them, and so "
        f"do a skin on some faces only or a cell with an open void",
    )


def _shared_edges(faces: IntArray, vertices: int) -> tuple[IntArray, bool]:
    """Pairs of corners that are one vertex of two triangles with a common edge, ``(2, k)``.

    A corner is three times its triangle's number plus its place. False where an edge has other
    than two triangles; its corners are not paired.
    """
    tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    corner = np.arange(faces.size)
    next_corner = np.roll(corner.reshape(-1, 3), -1, axis=1).ravel()
    key = np.minimum(tail, head) * np.int64(vertices) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    size = np.diff(np.append(first, len(key)))
    first = first[size == 2]
    edge, twin = order[first], order[first + 1]
    opposed = tail[edge] == head[twin]
    edge, twin = edge[opposed], twin[opposed]
    links = np.concatenate(
        [[corner[edge], next_corner[twin]], [next_corner[edge], corner[twin]]], axis=1
    )
    return links, bool((size == 2).all() and opposed.all())

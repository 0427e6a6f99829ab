"""Relations of closed shells: apart, one inside another, or overlapping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.triangles.winding import winding_numbers

#: Shared volume below this share of the smaller shell is touching, not overlapping; no more than
#: the second is, however thin the shell (chosen, not measured).
_TOUCHING, _MOST_TOUCHING = 1e-6, 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Nesting:
    """Relations between shells."""

    inside: BoolArray  #: ``(s, s)``. ``inside[i, j]``: shell i lies wholly inside shell j.
    overlap: BoolArray  #: ``(s, s)``. Symmetric: the surfaces of i and j cross.


def shell_volume(vertices: FloatArray, faces: IntArray) -> float:
    """Signed volume of a closed shell about its own middle, mm^3."""
    corners = vertices[faces]
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def facet_areas(corners: FloatArray) -> FloatArray:
    """Areas of triangles ``(m, 3, 3)``, mm^2."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def flat_shells(vertices: FloatArray, parts: Sequence[IntArray], margin: float) -> BoolArray:
    """Which shells hold no more than a layer thinner than the margin on half their surface."""
    volumes = np.array([abs(shell_volume(vertices, part)) for part in parts])
    areas = np.array([facet_areas(vertices[part]).sum() for part in parts])
    return np.asarray(volumes <= 0.5 * margin * areas)


def find_nesting(
    vertices: FloatArray, parts: Sequence[IntArray], volumes: FloatArray, margin: float
) -> Nesting:
    """Compare every two shells whose boxes meet.

    - ``vertices (n, 3)``, mm
    - ``parts``, each ``(k, 3)``: facets of each closed shell
    - ``volumes (s,)``, mm^3: signed
    - ``margin``, mm: shells that reach less deep into each other only touch
    """
    count = len(parts)
    inside = np.zeros((count, count), dtype=bool)
    overlap = np.zeros((count, count), dtype=bool)
    lower = np.array([vertices[part].min(axis=(0, 1)) for part in parts])
    upper = np.array([vertices[part].max(axis=(0, 1)) for part in parts])
    meets = np.all((lower[:, None] <= upper[None, :]) & (lower[None, :] <= upper[:, None]), axis=2)
    solids: dict[int, Any] = {}
    for i, j in np.argwhere(np.triu(meets, k=1)).tolist():
        small, big = _by_size(volumes, i, j)
        share = _shared(vertices, parts, volumes, small, big, solids)
        slight = _slight_share(vertices, parts[small], volumes[small], margin)
        if share > 1.0 - slight:
            inside[small, big] = True
        elif share > slight:
            overlap[i, j] = overlap[j, i] = True
    return Nesting(inside=inside, overlap=overlap)


def _slight_share(vertices: FloatArray, faces: IntArray, volume: float, margin: float) -> float:
    """Share of a shell's volume that half its surface has within a margin."""
    half = 0.5 * float(facet_areas(vertices[faces]).sum())
    return min(max(_TOUCHING, half * margin / abs(volume)), _MOST_TOUCHING)


def _by_size(volumes: FloatArray, i: int, j: int) -> tuple[int, int]:
    """Two shells, the smaller first; of a void and the solid that fills it, the solid is."""
    one, other = abs(volumes[i]), abs(volumes[j])
    if abs(one - other) <= _TOUCHING * max(one, other) and volumes[i] * volumes[j] < 0.0:
        outward = volumes.sum() > -_TOUCHING * max(one, other)
        return (i, j) if (volumes[i] > 0.0) == outward else (j, i)
    return (i, j) if one < other else (j, i)


def _shared(
    vertices: FloatArray,
    parts: Sequence[IntArray],
    volumes: FloatArray,
    small: int,
    big: int,
    solids: dict[int, Any],
) -> float:
    """Share of the smaller shell's volume that lies inside the bigger one."""
    for k in (small, big):
        if k not in solids:
            solids[k] = manifold_of(vertices, parts[k], volumes[k])
    if solids[small] is None or solids[big] is None:  # touches itself: test its corners instead
        points = vertices[np.unique(parts[small])]
        some = points[:: max(1, len(points) // 64)].T
        winding = winding_numbers(vertices[parts[big]], some)
        return float(np.mean(np.abs(winding) > 0.5))
    return float((solids[small] ^ solids[big]).volume()) / abs(float(volumes[small]))


def manifold_of(vertices: FloatArray, faces: IntArray, volume: float) -> Any:
    """Convert a shell, turned outward; None if the library refuses it."""
    import manifold3d

    used, index = np.unique(faces, return_inverse=True)
    facets = index.reshape(-1, 3).astype(np.uint64)
    mesh = manifold3d.Mesh64(
        vert_properties=np.array(vertices[used], dtype=np.float64, order="C"),
        tri_verts=np.ascontiguousarray(facets if volume > 0 else facets[:, ::-1]),
    )
    solid = manifold3d.Manifold(mesh)
    return solid if solid.status() == manifold3d.Error.NoError else None


def mesh_of(solid: Any) -> tuple[FloatArray, IntArray]:
    """Vertices ``(n, 3)`` in mm and facets ``(m, 3)`` of a solid of the Boolean kernel."""
    mesh = solid.to_mesh64()
    points = np.array(mesh.vert_properties, dtype=np.float64)[:, :3]
    return np.ascontiguousarray(points), np.array(mesh.tri_verts).astype(np.int64)


def unite(
    vertices: FloatArray,
    parts: Sequence[IntArray],
    kept: BoolArray,
    sign: IntArray,
    nesting: Nesting,
    source: str,
) -> tuple[FloatArray, IntArray]:
    """Unite overlapping solids, each with its own voids taken out first, and cut holes.

    A reversed shell that lies in no solid wholly cuts a hole into all that it crosses.

    Raises PartError if the void of one solid crosses another solid, a shell is not manifold, or
    nothing is left.

    ``parts``, each ``(k, 3)``: solids outward, voids reversed. ``kept (s,)``: which shells bound
    material. ``sign (s,)``: +1 solid, -1 void.
    """
    import manifold3d

    owner = {int(v): innermost(nesting, int(v)) for v in np.flatnonzero(kept & (sign < 0))}
    own = [v for v, solid in owner.items() if solid is not None]
    if nesting.overlap[own][:, kept & (sign > 0)].any():
        raise PartError(
            f"{source}: the void of one solid crosses another solid, so it is unclear what is "
            "solid there; cut the void out in CAD"
        )
    solids = {int(k): manifold_of(vertices, parts[int(k)], sign[k]) for k in np.flatnonzero(kept)}
    if any(solid is None for solid in solids.values()):
        raise PartError(
            f"{source}: overlapping shells touch themselves and cannot be united; unite them in CAD"
        )
    bodies = []
    for k in (int(s) for s in np.flatnonzero(kept & (sign > 0))):
        voids = [solids[v] for v in own if owner[v] == k]
        bodies.append(
            manifold3d.Manifold.batch_boolean([solids[k], *voids], manifold3d.OpType.Subtract)
        )
    whole = manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)
    cuts = [solids[v] for v, solid in owner.items() if solid is None]
    whole = manifold3d.Manifold.batch_boolean([whole, *cuts], manifold3d.OpType.Subtract)
    points, faces = mesh_of(whole)
    if len(faces) == 0:
        raise PartError(f"{source}: reversed shells cut away the whole part; turn their normals")
    return points, faces


def innermost(nesting: Nesting, shell: int) -> int | None:
    """The smallest shell around a shell: the one that itself lies inside the most."""
    around = np.flatnonzero(nesting.inside[shell])
    if len(around) == 0:
        return None
    return int(around[np.argmax(nesting.inside[around].sum(axis=1))])

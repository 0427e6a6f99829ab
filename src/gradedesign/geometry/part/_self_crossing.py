"""Shells that pass through themselves: found, united with themselves, or refused by name.

The enclosed volume of such a shell counts the overlap twice. It is cut along planes into pieces
that no longer overlap themselves, which keeps every layer of the overlap; their union is the solid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import face_edges, shell_labels, split_by
from gradedesign.geometry.part._nesting import manifold_of, mesh_of, shell_volume
from gradedesign.geometry.triangles.crossings import crossing_triangles
from gradedesign.geometry.triangles.grid_classifier import RAYS, WindingVolumes, winding_volumes

#: Volume counted too often or too little, as a share of the part's, that is reported, not mended.
#: Chosen, not measured.
NEGLIGIBLE = 1e-3
#: Farthest that the volume of the union may be from the one found along rays, as a share. Chosen,
#: not measured.
_AGREEMENT = 2e-3
#: Cuts one behind the other, and pieces, after which a shell is given up. Chosen, not measured.
_MOST_CUTS, _MOST_PIECES = 24, 500
#: Where a cut passes between the ends of a piece: off the middle, where parts have faces.
_CUT = 0.5 + 0.2 / np.pi**2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Uncrossed:
    """Shells of which none passes through itself to speak of."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    parts: tuple[IntArray, ...]  #: Each ``(k, 3)``. Facets of each closed shell.
    united: int  #: Shells that were united with themselves.
    notes: tuple[str, ...]


def uncross_shells(
    vertices: FloatArray, parts: Sequence[IntArray], *, margin: float, source: str
) -> Uncrossed:
    """Unite every shell that passes through itself with itself.

    Raises PartError if such a shell is partly inside out, or cannot be united.

    ``vertices (n, 3)``, mm. ``parts``, each ``(k, 3)``: facets of each closed, consistently
    oriented shell. ``margin``, mm: depth up to which facets only touch.
    """
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    outward = [part if shell_volume(vertices, part) >= 0.0 else part[:, ::-1] for part in parts]
    enclosed = [winding_volumes(vertices[part], _rays(vertices[part], size)) for part in outward]
    largest = max(max(f.solid, f.reversed) for f in enclosed)
    points, shells, notes = [vertices], [], []
    count, united = len(vertices), 0
    for original, part, volumes in zip(parts, outward, enclosed, strict=True):
        pairs = crossing_triangles(vertices, part, margin)
        surplus = volumes.excess + volumes.reversed
        if surplus <= NEGLIGIBLE * largest:
            shells.append(original)
            if len(pairs):
                notes.append(
                    f"{source}: a shell passes through itself {_place(vertices, part, pairs)}; "
                    f"its volume may be wrong by about {surplus:.2g} mm^3"
                )
            continue
        own, facets, note = _united(vertices, part, volumes, margin, pairs, source)
        notes.append(note)
        facets = facets if part is original else facets[:, ::-1]
        shells += split_by(shell_labels(face_edges(facets), len(facets)), facets + count)
        points.append(own)
        count += len(own)
        united += 1
    return Uncrossed(
        vertices=np.concatenate(points), parts=tuple(shells), united=united, notes=tuple(notes)
    )


def _rays(corners: FloatArray, size: float) -> int:
    """Rays through a shell, as close together in a small one as in one of the part's size."""
    share = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))) / size
    return int(np.clip(RAYS * share**2, 256, RAYS))


def require_simple(vertices: FloatArray, faces: IntArray, source: str) -> None:
    """Refuse a surface that still encloses some volume twice or negatively.

    Raises PartError with the volumes by winding number.
    """
    volumes = winding_volumes(vertices[faces])
    if volumes.excess + volumes.reversed > NEGLIGIBLE * volumes.solid:
        raise PartError(
            f"{source}: shells overlap in a way that could not be settled: "
            f"{_in_words(volumes)}; unite the solids in CAD and export the part again"
        )


def _place(vertices: FloatArray, part: IntArray, pairs: IntArray) -> str:
    """Place where a shell passes through itself, in words."""
    if len(pairs) == 0:
        return "along whole facets"
    middle = vertices[part[pairs.ravel()]].mean(axis=1)
    p = middle[np.argmin(np.linalg.norm(middle - middle.mean(axis=0), axis=1))]
    return f"at {len(pairs)} facets or more around ({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g}) mm"


def _in_words(volumes: WindingVolumes) -> str:
    return (
        f"{volumes.solid:.6g} mm^3 are enclosed, {volumes.excess:.4g} mm^3 of them counted again "
        f"and {volumes.reversed:.4g} mm^3 inside out"
    )


def _united(
    vertices: FloatArray,
    part: IntArray,
    volumes: WindingVolumes,
    margin: float,
    pairs: IntArray,
    source: str,
) -> tuple[FloatArray, IntArray, str]:
    """Vertices and facets of the union of an outward shell with itself, and a remark."""
    import manifold3d

    place = _place(vertices, part, pairs)
    solid = manifold_of(vertices, part, 1.0) if _is_outward(volumes) else None
    pieces = None if solid is None else pieces_of(solid, margin)
    whole = manifold3d.Manifold.batch_boolean(pieces or [], manifold3d.OpType.Add)
    before, after = shell_volume(vertices, part), whole.volume()
    if not pieces or not np.isclose(after, before - volumes.excess, rtol=_AGREEMENT):
        raise PartError(
            f"{source}: a shell passes through itself {place}, and what it encloses is "
            f"unclear: {_in_words(volumes)}; repair the part in CAD"
        )
    note = (
        f"{source}: a shell passes through itself {place}; united with itself it holds "
        f"{after:.6g} mm^3, counted as it was {before:.6g} mm^3"
    )
    return *mesh_of(whole), note


def _is_outward(volumes: WindingVolumes) -> bool:
    return volumes.reversed <= NEGLIGIBLE * volumes.solid


def pieces_of(solid: Any, margin: float) -> list[Any] | None:
    """Cut a solid until no piece overlaps itself; None if that does not end."""
    waiting: list[tuple[Any, int]] = [(solid, 0)]
    pieces: list[Any] = []
    while waiting:
        whole, cuts = waiting.pop()
        for piece in whole.decompose():
            if piece.volume() < 0.0 or len(pieces) + len(waiting) > _MOST_PIECES:
                return None
            points, facets = mesh_of(piece)
            volumes = winding_volumes(points[facets])
            simple = len(crossing_triangles(points, facets, margin)) == 0
            if simple and volumes.excess + volumes.reversed <= 1e-6 * volumes.solid:
                pieces.append(piece)
                continue
            if cuts == _MOST_CUTS:
                return None
            low, high = points.min(axis=0), points.max(axis=0)
            axis = int(np.argmax(high - low))
            normal = [float(k == axis) for k in range(3)]
            place = float(low[axis] + _CUT * (high - low)[axis])
            waiting += [(half, cuts + 1) for half in piece.split_by_plane(normal, place)]
    return pieces

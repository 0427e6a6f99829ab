"""The surface of a part as a repairer hands it back, held to that of the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PartError, PluginError
from gradedesign.geometry.part._holes import Rim, describe_rims, doubt, find_rims
from gradedesign.geometry.part._nesting import shell_volume
from gradedesign.geometry.part._weld import compact
from gradedesign.geometry.part.raw_triangles import require_finite
from gradedesign.geometry.part.repair import build_surface, cleaned, core_diagonal
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_features

#: A repairer's answer to vertices and faces: arrays ``vertices`` and ``faces``, and its changes.
Mend: TypeAlias = Callable[
    [FloatArray, IntArray], tuple[NDArray[Any], NDArray[Any], Mapping[str, int]]
]

#: Share of the volume that a repairer may change beyond what was missing in holes. A flat filling
#: can cut off what stood on a hole: 8,000 in place of 12,000 mm^3. Chosen, not measured.
_VOLUME_SHARE = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mended:
    """A surface as a repairer returned it."""

    corners: FloatArray  #: ``(m, 3 corners, 3 coordinates)``, mm.
    counts: Mapping[str, int]  #: Changes before the repairer's, keys as in ``RepairReport``.
    changes: Mapping[str, int]  #: The repairer's.
    moved: float  #: mm. Farthest that the file's surface lies from it.
    notes: tuple[str, ...]


def mended(corners: FloatArray, mend: Mend, *, name: str, source: str) -> Mended:
    """Weld and orient triangles, hand them to a repairer, and hold its answer to them.

    Raises PartError if the answer is open, or its volume is off by more than 1 % and what holes may
    have held. Raises PluginError if the answer is no surface.

    ``corners (m, 3 corners, 3 coordinates)``, mm. ``name``, ``source``: the repairer's and the
    file's, for messages.
    """
    require_finite(corners, source=source)
    vertices, faces, counts = cleaned(corners, core_diagonal(corners), source)
    vertices, faces = compact(vertices, faces)
    rims = find_rims(vertices, faces)
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    mended_vertices, sides, changes = mend(vertices - middle, faces)
    points, facets = _surface(mended_vertices, sides, name)
    holes = find_rims(points, facets)
    if holes:
        raise PartError(
            f"{source}: the repairer '{name}' leaves {len(holes)} holes: {describe_rims(holes)}; "
            "allow larger ones in [part.repair_options], or close the part in CAD"
        )
    points = points + middle
    before, after = _volume(vertices, faces, rims), abs(shell_volume(points, facets))
    missing = sum(map(doubt, rims))
    if abs(after - before) > _VOLUME_SHARE * before + missing:
        raise PartError(
            f"{source}: the repairer '{name}' changes the volume from {before:.6g} to "
            f"{after:.6g} mm^3; expected at most 1 % beside what is missing in holes; ask for "
            "shorter edges or more triangles in [part.repair_options]"
        )
    nearest = closest_features(build_triangle_tree(points[facets]), vertices.T)
    moved = float(nearest.distance.max())
    notes = [
        f"{source}: mended by '{name}' ({_in_words(changes)}), volume {after:.6g} mm^3; the file's "
        f"corners lie up to {moved:.3g} mm from its surface"
    ]
    if rims:
        notes.append(
            f"{source}: {len(rims)} holes filled: {describe_rims(rims)}; what was missing may hold "
            f"up to {missing:.3g} mm^3, {missing / after:.2g} of the volume: compare it with CAD"
        )
    return Mended(
        corners=points[facets],
        counts={**counts, "holes_filled": len(rims)},
        changes=dict(changes),
        moved=moved,
        notes=tuple(notes),
    )


def require_kept_bodies(
    corners: FloatArray, left: int, *, bodies: str, name: str, source: str
) -> tuple[str, ...]:
    """Refuse an answer that makes fewer solids of a file's, unless they are to be joined.

    Returns tuple of str: A remark where solids were joined. Raises PartError if solids were joined
    in silence.

    - ``corners (m, 3 corners, 3 coordinates)``, mm: of the file
    - ``left``: solids of the repairer's answer
    - ``bodies``: "one", "join" or "all"
    - ``name``, ``source``: the repairer's and the file's, for messages
    """
    try:
        read = build_surface(corners, bodies="all", source=source)[1]
    except PartError:  # what a repairer is there for: nobody knows the bodies of such a file
        return ()
    if read.bodies <= left:
        return ()
    touching = f" that touch along {read.common_area:.5g} mm^2" if read.common_area else ""
    words = f"{source}: the repairer '{name}' makes {left} of {read.bodies} solids{touching}"
    if bodies != "join":
        raise PartError(f'{words}; bodies = "join" says that they are one')
    return (f'{words} (bodies = "join")',)


def _surface(points: NDArray[Any], facets: NDArray[Any], name: str) -> tuple[FloatArray, IntArray]:
    """Arrays of a repairer, refused where they are no triangles."""
    whole = np.issubdtype(facets.dtype, np.integer)
    if points.ndim != 2 or points.shape[1:] != (3,) or facets.shape[1:] != (3,) or not whole:
        raise PluginError(
            f"repairer '{name}' returned vertices {points.shape} and {facets.dtype} faces "
            f"{facets.shape}; expected (n, 3) and whole numbers (m, 3)"
        )
    inside = len(facets) and facets.min() >= 0 and facets.max() < len(points)
    if not inside or not np.isfinite(points).all():
        raise PluginError(
            f"repairer '{name}' returned {len(facets)} faces on {len(points)} vertices that are "
            "not a surface: none, not finite, or with corners that do not exist"
        )
    return points.astype(np.float64), facets.astype(np.int64)


def _volume(vertices: FloatArray, faces: IntArray, rims: tuple[Rim, ...]) -> float:
    """Volume with every hole closed flat around its middle, mm^3."""
    centres = np.array([rim.centroid for rim in rims]).reshape(-1, 3)
    fans = [
        np.stack([ring, np.roll(ring, -1), np.full_like(ring, len(vertices) + k)], axis=1)
        for k, rim in enumerate(rims)
        if len(ring := np.array(rim.loop, dtype=np.int64))
    ]
    return abs(shell_volume(np.concatenate([vertices, centres]), np.concatenate([faces, *fans])))


def _in_words(changes: Mapping[str, int]) -> str:
    """Counted changes."""
    return ", ".join(f"{key.replace('_', ' ')} {count}" for key, count in changes.items()) or "none"

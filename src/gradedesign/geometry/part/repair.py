"""Repair of loose triangles to a closed, outward surface; every change is counted and reported."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import CaseError, PartError
from gradedesign.geometry.part._duplicates import drop_duplicates
from gradedesign.geometry.part._edges import face_edges, orient_consistently
from gradedesign.geometry.part._holes import describe_rims, fill_rims, find_rims
from gradedesign.geometry.part._seams import join_seams
from gradedesign.geometry.part._shells import settle_shells
from gradedesign.geometry.part._weld import (
    compact,
    core_points,
    drop_degenerate,
    thickness,
    weld,
)
from gradedesign.geometry.part.part_schema import BODIES
from gradedesign.geometry.part.raw_triangles import require_finite
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

log = logging.getLogger(__name__)

#: Corners closer than this share of the diagonal are one vertex. Chosen, not measured.
WELD_SHARE = 1e-6
#: A part thinner than this share of its diagonal is flat. Chosen, not measured.
_FLAT_SHARE = 1e-7
#: Diagonals, mm, outside of which the unit is probably wrong. Chosen, not measured.
_USUAL_DIAGONALS = (1.0, 5000.0)
#: Farther from the origin than this many diagonals, single precision loses the shape.
_FAR = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class RepairReport:
    """Report on the changes between the file and the surface."""

    facets_read: int
    facets_kept: int
    vertices_welded: int  #: Distinct points that were joined to a neighbour within the tolerance.
    weld_tolerance: float  #: mm.
    degenerate_removed: int = 0
    duplicates_removed: int = 0
    #: On whose open edges corners of others lie, within the tolerance of welding.
    facets_split: int = 0
    facets_folded: int = 0  #: Of one body, in pairs that faced each other.
    facets_flipped: int = 0  #: To agree with their neighbours.
    shells_inverted: int = 0  #: Shells that were inside out as a whole.
    shells_ignored: int = 0  #: Shells inside a solid that run the same way round as it.
    #: Shells that overlapped each other or themselves, or that a reversed shell cut.
    shells_united: int = 0
    #: Disconnected components under 0.1 % of the volume of the largest, together under 1 % of the
    #: part's.
    fragments_dropped: int = 0
    holes_filled: int = 0
    touching_edges: int = 0  #: Edges at which more than two facets meet.
    #: Solids with common faces that were united, and bodies that touched themselves.
    bodies_joined: int = 0
    common_area: float = 0.0  #: mm^2. Of the faces in which solids of the file touch.
    bodies: int = 1
    voids: int = 0
    #: Changes that the repairer of a plugin counts.
    repairer: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def changes(self) -> dict[str, int]:
        """Number of changes by kind to the file's surface; kinds without one are left out."""
        counts = asdict(self)
        unchanged = ("facets_read", "facets_kept", "bodies", "voids")
        return {
            key: value
            for key, value in counts.items()
            if isinstance(value, int) and value and key not in unchanged
        } | {key: count for key, count in self.repairer.items() if count}


def build_surface(
    corners: FloatArray, *, repair: str = "safe", bodies: str = "one", source: str = "part"
) -> tuple[SurfaceMesh, RepairReport]:
    """Weld, clean, orient and check triangles.

    Raises PartError if the triangles do not bound a solid. Raises CaseError if an option is
    unknown. Returns ``surface``: closed; solids outward, voids inward.

    - ``corners (m, 3 corners, 3 coordinates)``, mm
    - ``repair``: "safe" or "auto"; ``auto`` also closes small holes
    - ``bodies``: "one", "join" or "all"; whether several separate solids are accepted, or those
      that touch united
    - ``source``: name for messages
    """
    _require_option("repair", repair, ("safe", "auto"))
    _require_option("bodies", bodies, BODIES)
    if len(corners) == 0:
        raise PartError(f"{source}: no triangles; export the part again as a solid")
    require_finite(corners, source=source)
    core = core_points(corners.reshape(-1, 3))
    diagonal = _diagonal(core)
    warnings = _size_warnings(core, diagonal, source)
    vertices, faces, counts = cleaned(corners, diagonal, source)
    vertices, faces, holes = _close_holes(vertices, faces, repair, diagonal, source, warnings)
    vertices, faces = compact(vertices, faces)
    crowded = bool((face_edges(faces).count > 2).any())
    solid = settle_shells(
        vertices, faces, bodies=bodies, margin=WELD_SHARE * diagonal, source=source
    )
    touching = _touching_edges(solid.vertices[solid.faces]) if crowded else 0
    counts |= {"holes_filled": holes, "touching_edges": touching, **solid.counts}
    report = RepairReport(
        facets_read=len(corners),
        facets_kept=len(solid.faces),
        weld_tolerance=WELD_SHARE * diagonal,
        repairer={},
        common_area=solid.common_area,
        warnings=(*warnings, *_change_notes(counts, source), *solid.warnings),
        **counts,
    )
    log.info("%s: %d of %d facets kept", source, report.facets_kept, report.facets_read)
    return SurfaceMesh(vertices=solid.vertices, faces=solid.faces), report


def core_diagonal(corners: FloatArray) -> float:
    """Diagonal of triangles ``(m, 3, 3)`` without those far astray, mm."""
    return _diagonal(core_points(corners.reshape(-1, 3)))


def _diagonal(points: FloatArray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def cleaned(
    corners: FloatArray, diagonal: float, source: str
) -> tuple[FloatArray, IntArray, dict[str, int]]:
    """Weld, drop facets without area and duplicates, and orient; counts as in the report."""
    vertices, faces, welded = weld(corners, WELD_SHARE * diagonal, source)
    _require_thickness(vertices, diagonal, source)
    faces, degenerate = drop_degenerate(vertices, faces, diagonal)
    if len(faces) == 0:
        raise PartError(f"{source}: all {len(corners)} facets have zero area; nothing is enclosed")
    faces, duplicates = drop_duplicates(faces)
    faces, split = join_seams(vertices, faces, WELD_SHARE * diagonal)
    faces, flipped = orient_consistently(vertices, faces, source)
    counts = {
        "vertices_welded": welded,
        "degenerate_removed": degenerate,
        "duplicates_removed": duplicates,
        "facets_split": split,
        "facets_flipped": flipped,
    }
    return vertices, faces, counts


def _require_option(key: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise CaseError(f"part.{key} = {value!r} is unknown; use {' or '.join(map(repr, choices))}")


def _size_warnings(points: FloatArray, diagonal: float, source: str) -> list[str]:
    """Remark on sizes and places that hint at a wrong unit or lost digits."""
    warnings = []
    small, large = _USUAL_DIAGONALS
    if not small <= diagonal <= large:
        factors = {"inch": 25.4, "m": 1000.0} if diagonal < small else {"mm": 1e-3}
        hints = ", ".join(f"{diagonal * f:.4g} mm if {unit}" for unit, f in factors.items())
        warnings.append(f"{source}: the part is {diagonal:.4g} mm across; check its unit ({hints})")
    offset = float(np.linalg.norm(0.5 * (points.max(axis=0) + points.min(axis=0))))
    if offset > _FAR * diagonal > 0:
        warnings.append(
            f"{source}: the part lies {offset:.4g} mm from the origin and is {diagonal:.4g} mm "
            "across; single-precision files lose its shape, move it to the origin in CAD"
        )
    return warnings


def _require_thickness(vertices: FloatArray, diagonal: float, source: str) -> None:
    extent = thickness(vertices)
    if extent <= max(_FLAT_SHARE, WELD_SHARE) * diagonal:
        raise PartError(
            f"{source}: the part is flat: {extent:.3g} mm thick, {diagonal:.4g} mm across, so it "
            "encloses zero volume; export a solid, not a sketch or a sheet"
        )


def _close_holes(
    vertices: FloatArray,
    faces: IntArray,
    repair: str,
    diagonal: float,
    source: str,
    warnings: list[str],
) -> tuple[FloatArray, IntArray, int]:
    """Refuse holes, or fill small ones where the case allows it."""
    rims = find_rims(vertices, faces)
    if not rims:
        return vertices, faces, 0
    if repair == "safe":
        raise PartError(
            f"{source}: the surface is open, {len(rims)} holes: {describe_rims(rims)}; "
            "close the part in CAD, refine a coarse export, "
            'or set repair = "auto" to fill small holes'
        )
    a, b, c = np.moveaxis(vertices[faces] - rims[0].centroid, 1, 0)
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
    vertices, faces = fill_rims(
        vertices, faces, rims, diagonal=diagonal, volume=volume, source=source
    )
    warnings.append(f"{source}: {len(rims)} holes filled: {describe_rims(rims)}")
    return vertices, faces, len(rims)


def _touching_edges(corners: FloatArray) -> int:
    """Count the edges at which more than two facets ``(m, 3, 3)`` meet."""
    faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    return int(np.count_nonzero(face_edges(faces).count > 2))


def _change_notes(counts: Mapping[str, int], source: str) -> list[str]:
    """Put the counted changes into words."""
    words = {
        "degenerate_removed": "facets of zero area removed",
        "duplicates_removed": "duplicate facets removed",
        "facets_split": "facets split where corners of others lie on their edges",
        "facets_flipped": "facets turned to agree with their neighbours",
        "touching_edges": "edges along which the surface touches itself: "
        "such a joint carries no load reliably",
    }
    return [f"{source}: {counts[key]} {text}" for key, text in words.items() if counts[key]]

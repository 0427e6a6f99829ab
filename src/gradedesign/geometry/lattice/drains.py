"""Drain holes of a case: at stated places, or one for every void that nothing else opens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.design.case.schema import Case
from gradedesign.errors import CaseError
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.lattice.closed_voids import ClosedVoids, closed_voids, void_at
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.drain import Drain
from gradedesign.geometry.lattice.drain_schema import DrainSpec
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.skin_room import face_places
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import region_distance

#: Depths along a drain, per radius, at which a void is looked for. Chosen, not measured.
_PER_RADIUS = 8
#: A mouth's rim may leave the surface by this share of its radius. Chosen, not measured.
_RIM = 0.2
#: A stated place may lie this many radii off the surface. Chosen, not measured.
_OFF = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DrainReport:
    """Drain holes and what they open.

    Attributes
    ----------
    drains : tuple of Drain
    closed_mm3 : tuple of float
        Volume of the voids that stay closed.
    """

    drains: tuple[Drain, ...] = ()
    closed_mm3: tuple[float, ...] = ()


def drained(case: Case, part: Part, design: LatticeDesign, cell: float) -> DrainReport:
    """Place the drain holes of a case.

    Parameters
    ----------
    case : Case
    part : Part
    design : LatticeDesign
        Of a density that the lattice will have somewhere; no hole in it.
    cell : float, mm
        Shortest edge of a cell.

    Raises
    ------
    CaseError
        If a stated place is off the surface or above no void, or a void can be reached nowhere.
    ResourceError
        If voids are to be found in too many cells.
    """
    spec = case.lattice.drain
    if spec is None:
        return DrainReport()
    radius = spec.diameter / 2
    # What a ball of the hole's diameter does not fill is left as it is.
    least = 4 / 3 * np.pi * radius**3
    report_step("voids without a way out")
    before = closed_voids(design, cell, least)
    if spec.at:
        drains = tuple(_stated(case, spec, n, design) for n in range(len(spec.at)))
    else:
        drains = tuple(
            _placed(case, part, spec, design, before, n + 1) for n in range(len(before.volumes))
        )
    if not drains:
        return DrainReport()
    holed = replace(design, domain=replace(design.domain, drains=drains))
    after = closed_voids(holed, cell, least)
    return DrainReport(
        drains=drains,
        closed_mm3=tuple(after.volumes.tolist()),
    )


def drain_warnings(case: Case, report: DrainReport) -> tuple[str, ...]:
    """Say that voids stay closed, or that there was nothing to open."""
    where = case.where("lattice.drain")
    if case.lattice.drain is None:
        return ()
    if report.closed_mm3:
        sizes = ", ".join(f"{v:.4g}" for v in sorted(report.closed_mm3, reverse=True)[:5])
        return (
            f"{where}: {len(report.closed_mm3)} voids have no way out, of {sizes} mm^3 and so on: "
            f"powder stays there; state more places in at, or a smaller diameter",
        )
    if not report.drains:
        return (f"{where}: no void is closed, so no hole was made",)
    return ()


def drain_data(drains: Sequence[Drain]) -> list[dict[str, Any]]:
    """Plain data of drain holes."""
    return [
        {
            "mouth_mm": drain.mouth.tolist(),
            "inward": drain.inward.tolist(),
            "diameter_mm": 2 * drain.radius,
            "depth_mm": drain.depth + drain.radius,
        }
        for drain in drains
    ]


def _stated(case: Case, spec: DrainSpec, number: int, design: LatticeDesign) -> Drain:
    """Hole at a stated place, along the normal there, down to the first void."""
    radius, where = spec.diameter / 2, case.where(f"lattice.drain.at[{number}]")
    place = np.array(spec.at[number])[:, None]
    distance = float(design.domain.distance(place)[0])
    if abs(distance) > _OFF * radius:
        raise CaseError(
            f"{where}: found a place {abs(distance):.3g} mm off the part's surface; expected one "
            f"on it, within {_OFF * radius:g} mm"
        )
    # A little inside, where the normal of a face is not that of its rim.
    outward = gradient(design.domain.distance, place, 1e-4)[:, 0]
    outward /= np.linalg.norm(outward)
    mouth = place[:, 0] - distance * outward
    depths = _depths(radius, design)
    field = lattice_field(design)
    free = field(mouth[:, None] - depths * outward[:, None]) > 0
    if not free.any():
        raise CaseError(
            f"{where}: there is no void within {depths[-1]:.3g} mm below "
            f"({mouth[0]:.4g}, {mouth[1]:.4g}, {mouth[2]:.4g}) mm; expected a place above one"
        )
    depth = float(depths[int(np.argmax(free))])
    return Drain(mouth=mouth, inward=-outward, radius=radius, depth=depth)


def _placed(
    case: Case,
    part: Part,
    spec: DrainSpec,
    design: LatticeDesign,
    voids: ClosedVoids,
    number: int,
) -> Drain:
    """Hole into one void from a free and even place of the surface, where it is widest."""
    radius = spec.diameter / 2
    points, inward = face_places(part)
    free = _free(case, part, design.domain, radius)(points)
    points, inward = points[:, free], inward[:, free]
    depths = _depths(radius, design)
    reached = np.full(points.shape[1], np.inf)
    for depth in depths[::-1]:
        hit = void_at(voids, points + depth * inward) == number
        reached[hit] = depth
    reachable = np.flatnonzero(np.isfinite(reached))
    points, inward, reached = points[:, reachable], inward[:, reachable], reached[reachable]
    # The bottom of the hole lies free in the void where that is possible.
    bottom = lattice_field(design)(points + (reached + radius) * inward)
    room = np.where(bottom > 0, np.minimum(bottom, radius), 0.0)
    for at in np.lexsort((reached, -np.round(room, 2))):
        if _even(design.domain.distance, points[:, at], inward[:, at], radius):
            return Drain(
                mouth=points[:, at],
                inward=inward[:, at],
                radius=radius,
                depth=float(reached[at]),
            )
    raise CaseError(
        f"{case.where('lattice.drain')}: no even place of {spec.diameter:g} mm away from held, "
        f"loaded and passive regions leads to the closed void of "
        f"{voids.volumes[number - 1]:.4g} mm^3 within {depths[-1]:.3g} mm; expected a smaller "
        f"diameter, or places in at"
    )


def _depths(radius: float, design: LatticeDesign) -> FloatArray:
    """Depths below the surface at which a void is looked for, mm."""
    skins = [skin.thickness for skin in design.domain.skins]
    reach = max([*skins, 0.0]) + design.domain.joint_radius + design.cell_size
    return np.arange(1, np.ceil(_PER_RADIUS * reach / radius) + 1) * radius / _PER_RADIUS


def _free(case: Case, part: Part, domain: DesignDomain, radius: float) -> Field:
    """Whether a mouth lies off every region that the case holds, loads or keeps solid."""
    names = {
        entry.region
        for load_case in getattr(case, "load_case", ())
        for entry in (*load_case.fix, *load_case.load)
    }
    distances = [(region_distance(part.regions[name].corners), 0.0) for name in names]
    distances += [(passive.distance, passive.margin) for passive in domain.passive]

    def free(points: FloatArray) -> FloatArray:
        result = np.ones(points.shape[1], dtype=bool)
        for distance, margin in distances:
            result &= distance(points) > margin + radius
        return result

    return free


def _even(distance: Field, mouth: FloatArray, inward: FloatArray, radius: float) -> bool:
    """Whether the rim of a mouth lies on the surface."""
    across = np.linalg.svd(inward[None])[2][1:]
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    # With room for the rim: half a radius around the hole.
    rim = mouth[:, None] + 1.5 * radius * (across.T @ np.stack([np.cos(angles), np.sin(angles)]))
    return bool((np.abs(distance(rim)) <= _RIM * radius).all())

"""The passive regions of a case: what stays solid."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field
from gradedesign.design.case.schema import Case, KeepSpec
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.domain import DesignDomain, PassiveRegion
from gradedesign.geometry.lattice.place import place_box, place_distance
from gradedesign.geometry.lattice.placed_map import REPORT_POINTS
from gradedesign.geometry.maps.map_report import volume_points
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import region_distance

#: Samples along each edge of a volume's box that measure its thickness in the part; odd, so that
#: one lies in the middle. More of them before a volume is refused.
_SAMPLES = (15, 61)
#: Volumes reach this share of the part's diagonal further, so that they hold faces flush with
#: theirs.
_FLUSH = 1e-6


def passive_regions(case: Case, part: Part, distance: Field) -> tuple[PassiveRegion, ...]:
    """Passive regions in the order of the case.

    Parameters
    ----------
    case : Case
    part : Part
    distance : callable
        Signed distance of the part, mm.

    Raises
    ------
    CaseError
        If no place of the part lies in a volume.
    """
    return tuple(_passive(case, part, distance, k) for k in range(len(case.keep)))


def keep_words(spec: KeepSpec, number: int) -> str:
    """A passive region for people to read."""
    if spec.region is not None:
        return f"region '{spec.region}'"
    return f"'{spec.name}'" if spec.name is not None else f"{spec.volume_key} {number + 1}"


def passive_volume(case: Case, part: Part, domain: DesignDomain, number: int) -> float:
    """Volume that a passive region holds of the part, mm^3.

    From points that fill the box around the region: one that fills its box is exact, a cylinder
    within about a thousandth. Points that fill the whole part would leave too few in a small one.
    """
    spec, region = case.keep[number], domain.passive[number]
    if spec.region is None:
        lower, upper = place_box(part, spec)
    else:
        places = part.regions[spec.region].corners.reshape(-1, 3)
        lower, upper = places.min(axis=0), places.max(axis=0)
    vertices = part.surface.vertices
    lower = np.maximum(lower - region.margin, vertices.min(axis=0))
    upper = np.minimum(upper + region.margin, vertices.max(axis=0))
    points = volume_points(domain.distance, lower, upper, REPORT_POINTS)
    held = np.count_nonzero(region.distance(points) < region.margin)
    return float(np.prod(upper - lower)) * held / REPORT_POINTS


def _passive(case: Case, part: Part, distance: Field, number: int) -> PassiveRegion:
    spec = case.keep[number]
    margin = spec.margin or 0.0
    if spec.region is not None:
        away = region_distance(part.regions[spec.region].corners)
        return PassiveRegion(distance=away, margin=margin, thickness=margin)
    volume, margin = place_distance(part, spec), margin + _FLUSH * part.diagonal
    lower, upper = place_box(part, spec)
    least, most = part.surface.vertices.min(axis=0), part.surface.vertices.max(axis=0)
    lower, upper = np.maximum(lower - margin, least), np.minimum(upper + margin, most)
    for count in _SAMPLES if (lower < upper).all() else ():
        shares = (np.indices((count, count, count)).reshape(3, -1) + 0.5) / count
        points = lower[:, None] + shares * (upper - lower)[:, None]
        depth = -np.maximum(volume(points) - margin, distance(points))
        if depth.max() > 0:
            # As thick as the largest ball that fits is wide: that of a box, a cylinder, a slab.
            thickness = 2.0 * float(depth.max())
            return PassiveRegion(
                distance=volume, margin=margin, thickness=thickness, from_surface=0.0
            )
    raise CaseError(
        f"{case.where(f'keep[{number}].{spec.volume_key}')}: no place of the part was found in it; "
        f"the part lies between ({', '.join(f'{v:.4g}' for v in least)}) and "
        f"({', '.join(f'{v:.4g}' for v in most)}) mm; is its unit right?"
    )

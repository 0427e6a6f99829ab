"""Messages about regions: asserted counts and areas that do not hold, nearest faces."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import CaseError
from gradedesign.geometry.part._face_filters import FacedPart, Match
from gradedesign.geometry.part.place_words import direction, number, place
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.smooth_faces import SmoothFace

#: How many faces a message lists. Chosen, not measured.
_LISTED = 5


def check_assertions(
    part: FacedPart, name: str, spec: RegionSpec, used: list[int], area: float
) -> None:
    """Compare the selected faces with the asserted ``count`` and ``area``."""
    if spec.count is not None and len(used) != spec.count:
        raise CaseError(
            f"region.{name}.count: found {spec.count}, but the other keys fit "
            f"{len(used)} {'face' if len(used) == 1 else 'faces'}; expected that, or keys that "
            f"tell them apart:{listing(part, used)}"
        )
    if spec.area is not None and abs(area - spec.area) > spec.area_tolerance * spec.area:
        raise CaseError(
            f"region.{name}.area: found {spec.area:.4g} mm^2, within "
            f"{100 * spec.area_tolerance:g} %, but the faces that fit have {area:.4g} mm^2; "
            f"expected that, or other faces:{listing(part, used)}"
        )


def nothing_found(part: FacedPart, name: str, matches: list[Match], miss: FloatArray) -> str:
    """Say which key excludes the faces, where the part lies, and which faces come closest."""
    keys = "; ".join(f"{match.key}: {match.fits.sum()} faces" for match in matches)
    bounds = ", ".join(
        f"{axis} {number(low)} to {number(high)}"
        for axis, low, high in zip("xyz", part.lower, part.upper, strict=True)
    )
    nearest = np.argsort(miss, kind="stable")[:_LISTED].tolist()
    return (
        f"region.{name}: no smooth face fits every key ({keys}). The part spans {bounds} mm and "
        f"has {len(part.corners)} faces; nearest candidates:{listing(part, nearest)}"
    )


def listing(part: FacedPart, numbers: list[int]) -> str:
    """List faces, one a line."""
    lines = [f"\n  {_described(part.faces.faces[k])}" for k in numbers[:_LISTED]]
    more = len(numbers) - _LISTED
    return "".join(lines) + (f"\n  and {more} more" if more > 0 else "")


def _described(face: SmoothFace) -> str:
    """Describe a face in one line."""
    words = f"{face.kind}, area {face.area:.4g} mm^2, centroid {place(face.centroid)}"
    if face.diameter is not None and face.axis is not None:
        shape = "hole" if face.concave else "outer"
        span = "" if face.span is None or face.span > 359.0 else f", around {face.span:.3g} deg"
        return (
            f"{words}, {shape}, diameter {face.diameter:.4g} mm, axis {direction(face.axis)}{span}"
        )
    if face.half_angle is not None and face.axis is not None:
        shape = "inner" if face.concave else "outer"
        return (
            f"{words}, {shape}, half angle {face.half_angle:.4g} deg, diameter "
            f"{face.wide_diameter:.4g} mm, axis {direction(face.axis)}"
        )
    return words if face.normal is None else f"{words}, normal {direction(face.normal)}"

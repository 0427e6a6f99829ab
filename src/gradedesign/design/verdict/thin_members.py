"""A warning on printed members that are much thinner than the least that is stated."""

from __future__ import annotations

from gradedesign.design.printing.wall_thickness import WallThickness
from gradedesign.mechanics.sizing.members import MemberField

#: Percentile of the members' surface that is looked at, by area, and the share of the least
#: thickness from which it counts as much thinner: acute rims have less than any member. Chosen,
#: not measured.
_PERCENTILE, _SHARE = "5", 0.5


def thin_members(
    thickness: WallThickness, least: float | None, members: MemberField | None
) -> list[str]:
    """One sentence where there is a reason for it, else none.

    ``thickness``: of the printed file, and behind the surface of its members. ``least``, mm: as the
    case states it.
    """
    if least is None or members is None or _PERCENTILE not in thickness.of_phase_mm:
        return []
    thin = thickness.of_phase_mm[_PERCENTILE]
    if thin >= _SHARE * least:
        return []
    moved = f", and their surface was moved {-members.offset:.2g} mm inward to meet the limits"
    return [
        f"solid members: {_PERCENTILE} % of their surface has less than {thin:.3g} mm of solid "
        f"behind it, of the least_member of {least:.3g} mm: faces of the part cut them, where they "
        f"are about half as thick{moved if members.offset < 0 else ''}; a larger [lattice] "
        f"least_member makes them thicker"
    ]

"""``[lattice.drain]``: holes through a closed skin, by which powder leaves the voids behind it."""

from __future__ import annotations

from pydantic import Field

from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import Point, Size


class DrainSpec(Table):
    """Holes by which powder leaves."""

    diameter: Size = Field(examples=["3 mm"])
    """Of every hole, mm."""
    at: tuple[Point, ...] = ()
    """Places on the part's surface, mm; without them every closed void gets one hole where it is
    widest below the surface, away from regions that are held, loaded or passive."""

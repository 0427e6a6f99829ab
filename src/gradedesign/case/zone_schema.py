"""``[[zone]]``: places of the part whose cells differ from those of ``[lattice]``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from gradedesign.case.density_map_schema import FormulaText
from gradedesign.case.lattice_schema import DensityRange, Parameters
from gradedesign.case.regions_schema import BoxSpec
from gradedesign.case.table import Table, key_error
from gradedesign.case.value_types import Direction, Name, Point, Refused, RegionName, Size

_PLACES = ("box", "cylinder", "region", "formula")
_DIFFERENCES = ("cell", "parameters", "density")


class ZoneCylinder(Table):
    """All within a radius of an axis."""

    point: Point = Field(examples=[["0 mm", "0 mm", "0 mm"]])
    """A point of the axis, mm."""
    axis: Direction = "+z"
    """Its direction."""
    radius: Size = Field(examples=["10 mm"])
    """Radius, mm."""


class ZoneSpec(Table):
    """A place, and what is different there; where zones overlap, the last one counts."""

    name: Name | None = Field(default=None, examples=["root"])
    """Shown in the result; zone 1, zone 2 and so on without it."""
    box: BoxSpec | None = None
    """All in this box."""
    cylinder: ZoneCylinder | None = None
    """All within a radius of an axis."""
    region: RegionName | None = None
    """All within ``within`` of the faces of this region."""
    within: Size | None = None
    """Distance from the region, mm."""
    formula: Annotated[str | None, FormulaText()] = Field(default=None, examples=["x - 20"])
    """All places where this is below 0: in x, y, z and the depth d, in mm."""
    cell: Name | None = Field(default=None, examples=["diamond-sheet"])
    """Name of a cell family; that of ``[lattice]`` without it."""
    parameters: Annotated[dict[str, float] | None, Parameters()] = None
    """Parameters of the cell family; those of ``[lattice]`` where the cell is the same."""
    law: Name | None = None
    """Name of a scaling law, or auto, which is also meant without it where the cell is another."""
    density: Annotated[tuple[float, float] | None, DensityRange()] = None
    """Lowest and highest relative density; those of ``[lattice]`` without it."""
    transition: Size | None = None
    """Width of the transition about the zone's border, mm; two cells without it."""

    @model_validator(mode="after")
    def _one_place(self) -> ZoneSpec:
        given = [key for key in _PLACES if getattr(self, key) is not None]
        if len(given) != 1:
            stated = "none" if not given else " and ".join(given)
            raise Refused(f"found {stated}; expected exactly one of {', '.join(_PLACES)}")
        if (self.region is None) != (self.within is None):
            raise key_error("within", 'goes with region, such as within = "6 mm"')
        if all(getattr(self, key) is None for key in _DIFFERENCES):
            raise Refused(f"the zone differs in nothing; add one of {', '.join(_DIFFERENCES)}")
        return self

"""``[[zone]]``: places of the part whose cells differ from those of ``[lattice]``."""

from __future__ import annotations

import json
from typing import Annotated

from pydantic import Field, model_validator

from gradedesign.common.values.formula_text import FormulaText
from gradedesign.common.values.table import key_error
from gradedesign.common.values.value_types import (
    Choices,
    Name,
    Parameters,
    Refused,
    RegionName,
    Size,
)
from gradedesign.geometry.cell.law_schema import Law
from gradedesign.geometry.lattice.density_value import DensityRange
from gradedesign.geometry.lattice.lattice_schema import PHASES
from gradedesign.geometry.part.place_schema import VOLUMES, PlaceSpec, require_one

_DIFFERENCES = ("cell", "parameters", "density", "phases")


class ZoneSpec(PlaceSpec):
    """A region with its own cell or density; where zones overlap the last one counts."""

    region: RegionName | None = None
    """All within ``within`` of the faces of this region."""
    within: Size | None = Field(default=None, examples=["6 mm"])
    """Distance from the region, mm."""
    formula: Annotated[str | None, FormulaText()] = Field(default=None, examples=["x - 20"])
    """All places where this is below 0: in x, y, z and the depth d, in mm."""
    cell: Name | None = Field(default=None, examples=["diamond-sheet"])
    """Name of a cell family; that of ``[lattice]`` without it."""
    parameters: Annotated[dict[str, float] | None, Parameters()] = None
    """Parameters of the cell family; those of ``[lattice]`` where the cell is the same."""
    law: Law | None = Field(default=None, examples=["gibson-ashby"])
    """A scaling law as in ``[lattice]``; without it that of ``[lattice]``, or ``auto`` where the
    cell differs."""
    density: Annotated[tuple[float, float] | None, DensityRange()] = None
    """Lowest and highest relative density; those of ``[lattice]`` without it."""
    phases: Annotated[tuple[str, ...] | None, Choices(PHASES)] = None
    """Phases that it may hold: ["lattice"] keeps solid members out of it, ["lattice", "solid"] lets
    them in where an earlier zone keeps them out; those of ``[lattice]`` without it."""
    transition: Size | None = None
    """Width of the transition about the zone's border, mm; two cells without it."""

    def key(self, number: int) -> str:
        """Key of the zone of this number in the case file."""
        return f"zone[{number}]"

    @model_validator(mode="after")
    def _one_place(self) -> ZoneSpec:
        require_one(self, (*VOLUMES, "region", "formula"))
        if (self.region is None) != (self.within is None):
            raise key_error("within", 'goes with region, such as within = "6 mm"')
        if self.phases not in (None, PHASES[:1], PHASES[:2]):
            raise key_error(
                "phases",
                f'found {json.dumps(self.phases)}; expected ["lattice"] or ["lattice", "solid"]: '
                f"[[keep]] states what is solid, and void is left out of the part's file",
            )
        if all(getattr(self, key) is None for key in _DIFFERENCES):
            raise Refused(f"the zone differs in nothing; add one of {', '.join(_DIFFERENCES)}")
        return self


class WeightedZone(ZoneSpec):
    """A zone whose weight a formula gives, which stands for another table; no file states it."""

    share: str
    """Formula in x, y, z and the depth d, in mm."""
    between: tuple[float, float]
    """Values of the formula at which the weight is 0 and 1."""
    within_values: tuple[float, float]
    """Lowest and highest value that it may have in the lattice."""
    quantity: str
    """Noun for messages."""
    stated_by: str
    """Key of that table."""

    def key(self, number: int) -> str:  # noqa: ARG002  the name of a table has no number
        """Key of the table."""
        return self.stated_by

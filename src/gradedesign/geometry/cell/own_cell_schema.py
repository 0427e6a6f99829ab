"""``[lattice.own_cell]``: a cell that the case itself describes, as data or by a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import (
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import FilePath, Name
from gradedesign.geometry.part.part_schema import data_file

#: Depth of lists in lists, and entries of one option in all. A table of struts or formulas needs
#: two levels and some thousand numbers; more is a mistake. Chosen, not measured.
_DEEPEST, _MOST = 4, 100_000


class OwnCellSpec(Table):
    """Definition of a cell by a maker and its options by name."""

    # The options are the maker's, so their names are checked when it is known.
    model_config = ConfigDict(**{**Table.model_config, "extra": "allow"})

    maker: Name = Field(examples=["strut-graph"])
    """Name of the maker of the cell; ``gradedesign cells --makers`` lists them."""
    file: FilePath | None = Field(default=None, examples=["cell.json"])
    """The file that it reads, below the folder of the case."""

    @property
    def options(self) -> dict[str, Any]:
        """Every other key: plain data for the maker."""
        return dict(self.model_extra or {})

    @field_validator("file", mode="before")
    @classmethod
    def _find_file(cls, value: Any, info: ValidationInfo) -> Path:
        return data_file(value, info, "cell.stl")  # which kinds are read is the maker's to say

    @model_validator(mode="after")
    def _plain_options(self) -> OwnCellSpec:
        for key, value in self.options.items():
            if _entries(value, _DEEPEST) > _MOST:
                raise key_error(
                    key,
                    f"expected a number, a text, true or false, or lists of these, at most "
                    f"{_DEEPEST} deep and {_MOST} in all",
                )
        return self


def own_cell_file(lattice: Any) -> Path | None:
    """File of the case's own cell, whose bytes belong to the content of the case."""
    own_cell: OwnCellSpec | None = lattice.own_cell
    return None if own_cell is None else own_cell.file


def _entries(value: Any, depth: int) -> float:
    """Count the plain values of an option; infinite where one is not plain."""
    if isinstance(value, list):
        return sum(_entries(v, depth - 1) for v in value) + 1 if depth > 0 else float("inf")
    if isinstance(value, float):
        return 1 if abs(value) < float("inf") else float("inf")
    return 1 if isinstance(value, bool | int | str) else float("inf")

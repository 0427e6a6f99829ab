"""The layout of a study file: a base case and the values that its keys take."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from gradedesign.commands import (
    Name,
    Table,
)


class StudySection(Table):
    """Name of the study and the case that its designs vary."""

    name: Name = Field(examples=["cells of the bar"])
    """Shown above the table and the plot."""
    case: str = Field(examples=["case.toml"])
    """The base case: its file or folder, relative to the study."""


class StudyFile(Table):
    """A study: every combination of the values of ``[vary]``, for each row of ``[[design]]``."""

    study: StudySection
    vary: dict[str, Any] = Field(
        default_factory=dict, examples=[{"lattice.size": ["10 mm", "12 mm"]}]
    )
    """Lists of values by dotted key of the case, such as ``"lattice.size" = ["10 mm", "12 mm"]``;
    each is combined with each."""
    design: tuple[dict[str, Any], ...] = Field(
        default=(), examples=[[{"lattice.cell": "bcc", "lattice.size": "12 mm"}]]
    )
    """Values by dotted key that belong together, a row for each design."""

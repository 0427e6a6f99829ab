"""Tables of ``[lattice]`` by place: ``density_map``, ``parameter_map``, ``transition``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, ValidationInfo, field_validator, model_validator

from gradedesign.common.values.formula_text import FormulaText
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    FilePath,
    Flag,
    JsonSchema,
    Name,
    Number,
    Parameters,
    Point,
    Reader,
    Refused,
    Size,
    Triple,
    Whole,
    three,
)
from gradedesign.geometry.part.part_schema import data_file, data_folder

_SOURCES = ("formula", "voxels", "images", "points", "vtu")
_SUFFIXES = {"voxels": (".npy",), "points": (".csv", ".txt", ".npy"), "vtu": (".vtu",)}
#: Keys that belong to some sources only.
_BELONGS = {
    "voxel_size": ("voxels", "images"),
    "origin": ("voxels", "images"),
    "spacing": ("points",),
    "method": ("points",),
    "oversize": ("points",),
    "outside": ("points",),
    "field": ("vtu",),
}


class DensityMapSpec(Table):
    """Relative density from outside: exactly one source."""

    example: ClassVar[str] = '{formula = "0.1 + 0.4 * x / 100"}'

    formula: Annotated[str | None, FormulaText()] = None
    """In x, y, z and d, the depth below the part's surface, all in mm."""
    voxels: FilePath | None = Field(default=None, examples=["density.npy"])
    """A .npy array (nx, ny, nz): floats are densities, 8 and 16 bit are grey values."""
    images: FilePath | None = Field(default=None, examples=["slices"])
    """A folder of PNG or TIFF slices along z, lowest first by name; columns go along x, rows
    against y. Floats are densities, 8 and 16 bit are grey values."""
    points: FilePath | None = Field(default=None, examples=["density.csv"])
    """Columns x, y, z in mm and density, as text or .npy."""
    vtu: FilePath | None = Field(default=None, examples=["density.vtu"])
    """Tetrahedra with a field of densities."""
    field: Name | None = Field(default=None, examples=["density"])
    """Name of the field of ``vtu``; without it there must be only one."""
    voxel_size: Size | None = Field(default=None, examples=["0.5 mm"])
    """Edge of a voxel, mm; without it the voxels are stretched over the part's bounding box."""
    origin: Point | None = None
    """Lower corner of the voxels, mm; without it that of the part's bounding box."""
    spacing: Size | None = Field(default=None, examples=["2 mm"])
    """Of the grid on which ``points`` are mapped, mm; half a cell without it."""
    method: Annotated[str, Choice(("weights", "maximum"))] = "weights"
    """Whether a node takes the inverse-square mean or the maximum of the points around it."""
    oversize: Annotated[bool, Flag()] = False
    """Whether the grid of ``points`` gets a border of ``outside``."""
    outside: Annotated[float | None, Number(above=0.0, below=1.0)] = Field(
        default=None, examples=[0.2]
    )
    """Density of that border; the least one without it."""

    @field_validator("voxels", "points", "vtu", mode="before")
    @classmethod
    def _find_file(cls, value: Any, info: ValidationInfo) -> Path:
        suffixes = _SUFFIXES[str(info.field_name)]
        return data_file(value, info, f"map{suffixes[0]}", suffixes)

    @field_validator("images", mode="before")
    @classmethod
    def _find_folder(cls, value: Any, info: ValidationInfo) -> Path:
        return data_folder(value, info, "slices")

    @model_validator(mode="after")
    def _one_source(self) -> DensityMapSpec:
        source_keys = [name for name in _SOURCES if getattr(self, name) is not None]
        if len(source_keys) != 1:
            stated = "none" if not source_keys else " and ".join(source_keys)
            raise Refused(f"found {stated}; expected exactly one of {', '.join(_SOURCES)}")
        for key, sources in _BELONGS.items():
            if key in self.model_fields_set and source_keys[0] not in sources:
                raise key_error(
                    key,
                    f"has no meaning with {source_keys[0]}; it belongs to {' and '.join(sources)}",
                )
        if self.outside is not None and not self.oversize:
            raise key_error("outside", "needs oversize = true")
        return self

    @property
    def source(self) -> str:
        """Name of the source that is given."""
        return next(name for name in _SOURCES if getattr(self, name) is not None)


class _Ends(Reader):
    """Two different numbers."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            raise Refused(f"found {shown(value)}; expected two numbers such as [0.0, 0.1]")
        first, last = (Number().read(v) for v in value)
        if first == last:
            raise Refused(f"found {first:g} twice; expected two different numbers")
        return first, last

    def json_schema(self) -> JsonSchema:
        return {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}


class ParameterMapSpec(Table):
    """A free parameter of the family, between two values."""

    parameter: Name = Field(examples=["amplitude"])
    """Its name."""
    values: Annotated[tuple[float, float], _Ends()] = Field(examples=[[0.1, 0.0]])
    """At the lowest and at the highest density; with a formula, between which it must stay."""
    formula: Annotated[str | None, FormulaText()] = None
    """Value in x, y, z and the depth d, in mm; without it the parameter follows the density."""
    increments: Annotated[int, Whole(2, 65)] = 9
    """Values at which the cell is calibrated; between them neighbours are mixed."""


class _Shift(Reader):
    """``"auto"`` or three numbers."""

    __slots__ = ()

    def read(self, value: object) -> Triple | None:
        if value == "auto":
            return None
        x, y, z = (Number().read(v) for v in three(value, "[0.5, 0.5, 0]"))
        return x, y, z

    def json_schema(self) -> JsonSchema:
        number = Number().json_schema()
        return {
            "anyOf": [
                {"const": "auto"},
                {"type": "array", "items": number, "minItems": 3, "maxItems": 3},
            ],
            "examples": [[0.5, 0.5, 0.0]],
        }


class TransitionSpec(Table):
    """A second family, into which the first passes over."""

    cell: Name = Field(examples=["bcc"])
    """Name of a cell family."""
    parameters: Annotated[dict[str, float], Parameters()] = Field(default_factory=dict)
    """Its parameters by name."""
    weight: Annotated[str, FormulaText()] = Field(examples=["smoothstep(20, 40, x)"])
    """Share of the second family, 0 to 1, a formula in x, y, z and the depth d, in mm."""
    scale: Annotated[str, Choice(("rank", "distance"))] = "rank"
    """On which the two mix: the density at which a point becomes solid, or its distance from the
    surface."""
    shift: Annotated[Triple | None, _Shift()] = None
    """By which the second family is moved, in cells; auto: not, unless only that joins them."""

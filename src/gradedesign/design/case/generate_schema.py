"""The case of ``gradedesign generate``: a part and a lattice of stated density, no analysis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    JsonSchema,
    Name,
    Number,
    Reader,
    RegionName,
    Triple,
    three,
)
from gradedesign.design.case.run_schema import OutputSpec, RunSpec
from gradedesign.design.case.schema import CaseIdentity, CaseSection
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.geometry.lattice.density_map_schema import DensityMapSpec, FormulaText
from gradedesign.geometry.lattice.lattice_schema import (
    CellsSpec,
    DensityRange,
    Parameters,
)
from gradedesign.geometry.lattice.parameter_map_schema import ParameterMapSpec
from gradedesign.geometry.part.part_schema import GeneratePartSpec
from gradedesign.geometry.part.place_schema import KeepSpec
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.material_schema import MaterialSpec


class _StatedDensity(DensityRange):
    """One density, or ``[lowest, highest]`` of a map."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        if isinstance(value, list):
            return super().read(value)
        density = Number(above=0.0, below=1.0).read(value)
        return density, density

    def json_schema(self) -> JsonSchema:
        number = Number(above=0.0, below=1.0).json_schema()
        return {"anyOf": [number, super().json_schema()], "examples": [0.3]}


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


class StatedLatticeSpec(CellsSpec):
    """The lattice that fills the part, its density stated."""

    density: Annotated[tuple[float, float] | None, _StatedDensity()] = None
    """One density everywhere; or, with a map, the densities it may have, and those of the lowest
    and the highest grey value of 8 and 16 bit voxels."""
    density_map: DensityMapSpec | None = None
    """Density from outside."""
    transition: TransitionSpec | None = None
    """A second family."""
    parameter_map: ParameterMapSpec | None = None
    """A parameter of the family that changes from place to place."""

    @model_validator(mode="after")
    def _parameter_alone(self) -> StatedLatticeSpec:
        parameter_map = self.parameter_map
        if parameter_map is None:
            return self
        if self.transition is not None or self.graded_size:
            key = "transition" if self.transition is not None else "grading"
            raise key_error(key, "does not go with [lattice.parameter_map]")
        if parameter_map.parameter in self.parameters:
            raise key_error(
                "parameters",
                f"found {parameter_map.parameter}, which [lattice.parameter_map] changes",
            )
        if parameter_map.formula is None and self.density_map is None:
            raise key_error(
                "parameter_map",
                "follows the density without a formula; add formula, or [lattice.density_map]",
            )
        return self

    @model_validator(mode="after")
    def _one_density(self) -> StatedLatticeSpec:
        if self.density_map is None:
            if self.graded_size:
                raise key_error(
                    "grading", "a size that follows the density needs [lattice.density_map]"
                )
            if self.density is None or self.density[0] < self.density[1]:
                raise key_error(
                    "density",
                    "a lattice is generated from a stated density; expected one number such as "
                    "density = 0.3, or a map in [lattice.density_map]",
                )
        elif self.density is not None and self.density[0] == self.density[1]:
            raise key_error(
                "density", "one number and a map contradict each other; expected [low, high]"
            )
        elif self.grading == "uniform":
            raise key_error("grading", 'found "uniform" with a density map; expected "level"')
        return self


class GenerateFile(Table):
    """Layout of a case file for ``generate``; tables of an analysis may be there or not."""

    replaced: ClassVar[Mapping[str, str]] = {
        "zone": "belongs to `gradedesign run`; `generate` passes from one cell into another by "
        '[lattice.transition], with cell = "bcc" and weight = "smoothstep(20, 40, x)", and from '
        "one density to another by [lattice.density_map]"
    }

    case: CaseSection
    part: GeneratePartSpec
    region: dict[RegionName, RegionSpec] = Field(default_factory=dict)
    material: MaterialSpec | None = None
    keep: tuple[KeepSpec, ...] = ()
    load_case: tuple[LoadCaseSpec, ...] = ()
    limits: LimitsSpec | None = None
    lattice: StatedLatticeSpec
    print: PrintSpec | None = None
    run: RunSpec = Field(default_factory=RunSpec)
    output: OutputSpec = Field(default_factory=OutputSpec)


class GenerateCase(CaseIdentity):
    """A case for ``generate`` as read, every value in internal units."""

    part: GeneratePartSpec
    material: MaterialSpec | None
    lattice: StatedLatticeSpec
    run: RunSpec

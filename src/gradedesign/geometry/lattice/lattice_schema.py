"""``[lattice]``: which cells fill the part.

Above 300 lines: the keys of one table, and which of them contradict each other.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    Choices,
    Distance,
    Flag,
    Name,
    Number,
    Parameters,
    Point,
    Size,
    Triple,
    Vector,
)
from gradedesign.geometry.cell.family import VOID
from gradedesign.geometry.cell.law_schema import Law
from gradedesign.geometry.cell.own_cell_schema import OwnCellSpec
from gradedesign.geometry.lattice.by_place_schema import (
    DensityMapSpec,
    ParameterMapSpec,
    TransitionSpec,
)
from gradedesign.geometry.lattice.density_value import Density, is_formula
from gradedesign.geometry.lattice.skin_schema import DrainSpec, SkinSpecs
from gradedesign.geometry.maps.cell_map_schema import CellMapSpec, CellSize, WarpSpec
from gradedesign.geometry.maps.orientation_schema import OrientationSpec

#: Ways to find the density; the first by default.
_METHODS = ("lightest", "stress-to-density")
#: What a place of the part may hold, beside what the case states to be solid.
PHASES = ("lattice", "solid", "void")
#: Phases that a part may hold together.
_TOGETHER = (PHASES[:1], PHASES[:2], PHASES[1:], PHASES)
#: Quantities that may follow the density.
GRADINGS = ("uniform", "level", "thickness", "size", "ratio")

#: Keys of a lattice that say how its density is found.
_FINDING = ("method", "size_effects", "phases", "least_member")
#: Keys of solids that lie about cells, which a body without them has not.
_ABOUT_CELLS = ("skin", "bevel", "least_cavity", "drain")
#: Keys that a part without cells may state.
_WITHOUT_CELLS = {"phases", "least_member", "method", "joint_radius", "skin", "drain"}
#: Densities of the bars that stand for void in what is planned: about what members fill.
_PLANNED_VOID = [0.09, 0.1]


class LatticeSpec(Table):
    """The lattice that fills the part: its cells, how they lie in it, and their density."""

    called: ClassVar[Mapping[str, str]] = {
        "type": "cell",
        "name": "cell",
        "family": "cell",
        "topology": "cell",
        "unit_cell": "cell",
        "period": "size",
        "volume_fraction": "density",
    }

    cell: Name = Field(examples=["gyroid-sheet"])
    """Name of a cell family."""
    own_cell: OwnCellSpec | None = None
    """Definition of a cell that is not among the installed ones."""
    size: Annotated[tuple[float, ...], CellSize()] = Field(examples=["8 mm"])
    """Edge length of a cell; the smallest and the largest of graded size; or three edges, mm."""
    grading: Annotated[str, Choice(GRADINGS)] = "level"
    """Quantity that follows the density: uniform: none; level: the level of the cell; thickness:
    the same, of a cell whose walls have one thickness; size: the size of the cells, with walls of
    one thickness; ratio: size and wall, small cells where it is dense."""
    wall: Size | None = Field(default=None, examples=["1 mm"])
    """Thickness of the walls when the size of the cells follows the density, mm."""
    parameters: Annotated[dict[str, float], Parameters()] = Field(default_factory=dict)
    """Parameters of the cell family by name."""
    law: Law = Field(default="auto", examples=["gibson-ashby"])
    """auto: computed on the periodic cell where that can be; gibson-ashby: the power law fitted to
    it; the name of a scaling law; or a power law as stated, a table with stiffness and strength."""
    skin: SkinSpecs = Field(default=(), examples=["2 mm"])
    """Solid layers below the part's surface: one thickness such as "2 mm", a table, or several."""
    bevel: Distance = Field(default=0.0, examples=["0.5 mm"])
    """Radius of the fillets at inner edges and corners below skins and passive regions, mm."""
    least_cavity: Distance = Field(default=0.0, examples=["1 mm"])
    """Diameter of a ball, mm: cavities below a closed skin into which it does not fit are made
    solid."""
    drain: DrainSpec | None = None
    """Holes by which powder leaves voids that skins close."""
    joint_radius: Distance = Field(default=0.0, examples=["0.5 mm"])
    """Radius of the fillets where lattice, skins and passive regions meet, mm; without cells a
    quarter of ``least_member`` by default."""
    filter_radius: Annotated[float, Number(at_least=0.0, at_most=100.0)] = 1.0
    """Radius of the density filter, in cells."""
    origin: Point = (0.0, 0.0, 0.0)
    """Corner of a cell, mm."""
    rotation: Annotated[Triple, Vector("angle")] = (0.0, 0.0, 0.0)
    """Degrees about x, then the turned y, then the twice turned z (intrinsic xyz): the cell's axes
    are the columns of Rx(a) Ry(b) Rz(c), scipy's ``Rotation.from_euler("XYZ", ...)``."""
    cell_map: CellMapSpec | None = None
    """Cells about an axis, about a centre, or in layers, instead of a straight grid."""
    warp: tuple[WarpSpec, ...] = ()
    """Spheres in which cells are larger or smaller."""
    orientation: OrientationSpec | None = None
    """Directions that the axes of the cells follow."""

    density: Annotated[float | tuple[float, float], Density()] = (0.01, 0.99)
    """Lowest and highest relative density the user allows, which the windows of the family and of
    its law narrow further; with ``density_map`` those that it may have, and those of the lowest and
    the highest grey value of 8 and 16 bit voxels. Or a stated density: one number, or a formula in
    x, y, z and the depth d, in mm; the run then ends with its lattice."""
    density_map: DensityMapSpec | None = None
    """A stated density from outside: the run then ends with its lattice."""
    transition: TransitionSpec | None = None
    """A second family, into which the first passes over."""
    parameter_map: ParameterMapSpec | None = None
    """A parameter of the family that changes from place to place."""
    method: Annotated[str, Choice(_METHODS)] = "lightest"
    """lightest: the least mass under every limit, by gradients; stress-to-density: the plain way,
    the stress of the fully solid part mapped to density by the law and scaled until every limit
    holds, with ``acceptance = "whole"`` unless it is stated."""
    phases: Annotated[tuple[str, ...] | None, Choices(PHASES)] = None
    """Phases that the part may hold: ["lattice"]; ["lattice", "solid"] for solid members among the
    cells wherever that is lighter; ["solid", "void"] for members alone, without any cell; or all
    three for the lighter of the last two. By default lattice and solid; lattice alone with
    stress-to-density, a uniform density and one that is stated, which make no members."""
    least_member: Size | None = Field(default=None, examples=["5 mm"])
    """Least thickness of solid members, mm; a quarter of a cell by default, or one and a half
    ``mesh_size`` where that is stated and larger. Without cells it has no default."""
    size_effects: Annotated[bool, Flag()] = True
    """Size effect: the stiffness of walls with few cells between the part's free faces, where it
    can be computed; ``false`` only to compare with the periodic lattice."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> dict[str, Any]:
        """The table, whose cell is required unless the phases leave cells out."""
        reference = super().__get_pydantic_json_schema__(schema, handler)
        body: dict[str, Any] = handler.resolve_ref_schema(reference)
        void = {
            "properties": {"phases": {"not": {"contains": {"const": PHASES[0]}}}},
            "required": ["phases"],
        }
        body["if"], body["then"] = void, {"required": ["least_member"]}
        body["else"] = {"required": body.pop("required")}
        return reference

    @property
    def stated(self) -> bool:
        """Whether the density is stated rather than found."""
        return self.density_map is not None or isinstance(self.density, float)

    @property
    def densities(self) -> tuple[float, float]:
        """Lowest and highest density the user allows."""
        return (self.density,) * 2 if isinstance(self.density, float) else self.density

    @property
    def stated_range(self) -> tuple[float, float] | None:
        """The range ``[lowest, highest]`` as it is written; None where none is."""
        written = "density" in self.model_fields_set and not isinstance(self.density, float)
        return self.densities if written else None

    @property
    def by_stress(self) -> bool:
        """Whether the plain method finds the density."""
        return self.method == _METHODS[1]

    @property
    def made(self) -> tuple[str, ...]:
        """Phases that the part may hold, stated or not."""
        if self.phases is not None:
            return self.phases
        alone = self.stated or self.by_stress or self.grading == GRADINGS[0]
        return PHASES[:1] if alone else PHASES[:2]

    @property
    def members(self) -> bool:
        """Whether sizing may make solid members."""
        return PHASES[1] in self.made

    @property
    def cells(self) -> bool:
        """Whether cells are a phase of it."""
        return PHASES[0] in self.made

    @property
    def any_phase(self) -> bool:
        """Whether a run chooses between lattice and solid and solid and void."""
        return self.phases == PHASES

    def without_cells(self) -> LatticeSpec:
        """Solid and void in place of it, with members of its least thickness."""
        stated = {"phases": list(PHASES[1:]), "least_member": f"{self.least_member} mm"}
        return LatticeSpec.model_validate(stated)

    @property
    def cell_size(self) -> float:
        """The smallest size, mm, which grids must resolve."""
        return min(self.size)

    @property
    def edges(self) -> Triple:
        """Edges of a cell along its three axes, mm; of a middle one if the size is graded."""
        if len(self.size) == 3:
            return self.size[0], self.size[1], self.size[2]
        middle = self.size[0] if len(self.size) == 1 else (self.size[0] * self.size[1]) ** 0.5
        return middle, middle, middle

    @property
    def size_words(self) -> str:
        """The size for people to read."""
        joined = " to " if len(self.size) == 2 else " x "
        return f"{joined.join(f'{s:g}' for s in self.size)} mm"

    @property
    def graded_size(self) -> bool:
        """Whether the size of the cells follows the density."""
        return self.grading in ("size", "ratio")

    @model_validator(mode="after")
    def _graded_size(self) -> LatticeSpec:
        if self.graded_size != (len(self.size) == 2):
            wanted = (
                'a range such as ["40 mm", "50 mm"]'
                if self.graded_size
                else 'one length such as "8 mm", or three edges'
            )
            raise key_error("size", f'grading = "{self.grading}" goes with {wanted}')
        if (self.wall is None) == (self.grading == "size"):
            raise key_error(
                "wall",
                'missing; grading = "size" keeps one wall thickness: add wall = "1 mm"'
                if self.wall is None
                else f'has no meaning with grading = "{self.grading}", where the wall follows the '
                f'density; leave it out, or take grading = "size" with a range of sizes',
            )
        for key in ("cell_map", "warp", "transition"):
            if self.graded_size and getattr(self, key, None):
                raise key_error(key, f'does not go with grading = "{self.grading}"')
        return self

    @model_validator(mode="after")
    def _net_alone(self) -> LatticeSpec:
        if self.joint_radius and any(skin.net for skin in self.skin):
            raise key_error("joint_radius", "does not go with a net-skin yet; leave one out")
        return self

    @model_validator(mode="after")
    def _fillings_below_skins(self) -> LatticeSpec:
        closed = [skin for skin in self.skin if not skin.net]
        if not self.cells and (len(closed) < len(self.skin) or any(s.faces for s in closed)):
            raise key_error(
                "skin",
                'on some faces, or as a net, it does not go with phases = ["solid", "void"] yet; '
                'expected one all round such as skin = "1 mm"',
            )
        if self.bevel and not closed:
            raise key_error("bevel", 'has no meaning without a skin; add e.g. skin = "1 mm"')
        if self.least_cavity and all(skin.faces for skin in closed):
            raise key_error(
                "least_cavity",
                'has no meaning without a skin all round; add e.g. skin = "1 mm"',
            )
        return self

    @model_validator(mode="after")
    def _orientation_alone(self) -> LatticeSpec:
        if self.orientation is None:
            return self
        for key in ("cell_map", "warp"):
            if getattr(self, key):
                raise key_error(key, "does not go with [lattice.orientation]; leave one out")
        if len(self.size) == 3:
            raise key_error("size", "three edges do not go with [lattice.orientation] yet")
        return self

    @model_validator(mode="after")
    def _edges_of_map(self) -> LatticeSpec:
        if self.cell_map is None:
            return self
        kind = self.cell_map.kind
        if len(self.size) == 3 and kind in ("cylindrical", "spherical"):
            raise key_error(
                "size", f"the {kind} map sets the width of its cells by around; expected one length"
            )
        for key in ("rotation", *(() if kind in ("conformal", "layered") else ("origin",))):
            if any(getattr(self, key)):
                raise key_error(key, f"has no meaning with the {kind} map, which has its own axes")
        return self

    @model_validator(mode="before")
    @classmethod
    def _formula_is_a_map(cls, value: Any) -> Any:
        """Take ``density = "0.1 + x / 100"`` as a map; what is no formula is refused as it is."""
        text = value.get("density") if isinstance(value, dict) else None
        if not is_formula(text):
            return value
        if "density_map" in value:
            raise key_error("density", "a formula and a map contradict each other; leave one out")
        others = {key: entry for key, entry in value.items() if key != "density"}
        return {**others, "density_map": {"formula": text}}

    @model_validator(mode="after")
    def _found(self) -> LatticeSpec:
        if self.stated:
            return self
        if self.by_stress and self.grading == "uniform":
            raise key_error(
                "method",
                'stress-to-density makes a map of densities, which grading = "uniform" has not; '
                'expected another grading, or method = "lightest"',
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def _no_cells(cls, value: Any) -> Any:
        """State what stands for cells, which have no keys where the phases leave them out."""
        phases = value.get("phases") if isinstance(value, dict) else None
        if not isinstance(phases, list) or sorted(map(str, phases)) != sorted(PHASES[1:]):
            return value
        for key in value:
            if key in cls.model_fields and key not in _WITHOUT_CELLS:
                raise key_error(
                    key, 'has no meaning with phases = ["solid", "void"], which leave cells out'
                )
        if "least_member" not in value:
            raise key_error(
                "least_member",
                'missing; solid members without cells need their least thickness, such as "5 mm"',
            )
        stands = {"cell": VOID.name, "law": VOID.name, "density": _PLANNED_VOID}
        return {**value, **stands, "size": value["least_member"], "size_effects": False}

    @model_validator(mode="after")
    def _members(self) -> LatticeSpec:
        if self.phases is not None and self.phases not in _TOGETHER:
            listed = ", ".join(json.dumps(list(phases)) for phases in _TOGETHER)
            raise key_error("phases", f"found {json.dumps(self.phases)}; expected one of {listed}")
        if not self.members:
            if self.least_member is not None:
                raise key_error(
                    "least_member", 'has no meaning without phases = ["lattice", "solid"]'
                )
            return self
        if self.by_stress:
            raise key_error(
                "phases",
                'stress-to-density makes lattice alone; expected phases = ["lattice"], or '
                'method = "lightest"',
            )
        if self.grading == "uniform":
            raise key_error(
                "phases",
                'grading = "uniform" makes lattice of one density alone; expected '
                'phases = ["lattice"], or another grading',
            )
        brought = type(self).model_fields.keys() - LatticeSpec.model_fields.keys()
        for key in (*_ABOUT_CELLS, *brought) if self.any_phase else ():
            if getattr(self, key):
                raise key_error(
                    key,
                    "does not go with void, which may take the place of all cells; leave it out, "
                    'or expected phases = ["lattice", "solid"]',
                )
        return self

    @model_validator(mode="after")
    def _one_density(self) -> LatticeSpec:
        if not self.stated:
            return self
        for key in _FINDING:
            if key in self.model_fields_set:
                raise key_error(
                    key,
                    "says how the density is found, which is stated here; leave it out, or state "
                    "density = [lowest, highest]",
                )
        if self.density_map is None:
            if self.graded_size:
                raise key_error(
                    "grading", "a size that follows the density needs [lattice.density_map]"
                )
        elif isinstance(self.density, float):
            raise key_error(
                "density", "one number and a map contradict each other; expected [low, high]"
            )
        elif self.grading == "uniform":
            raise key_error("grading", 'found "uniform" with a density map; expected "level"')
        return self

    @model_validator(mode="after")
    def _parameter_alone(self) -> LatticeSpec:
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

"""``[lattice]``: which cells fill the part."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import Field, model_validator

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    Distance,
    Flag,
    JsonSchema,
    Name,
    Number,
    Point,
    Reader,
    Refused,
    Size,
    Triple,
    Vector,
)
from gradedesign.geometry.cell.law_schema import Law
from gradedesign.geometry.cell.own_cell_schema import OwnCellSpec
from gradedesign.geometry.lattice.drain_schema import DrainSpec
from gradedesign.geometry.lattice.skin_schema import SkinSpecs
from gradedesign.geometry.maps.cell_map_schema import CellMapSpec, WarpSpec
from gradedesign.geometry.maps.cell_size import CellSize
from gradedesign.geometry.maps.orientation_schema import OrientationSpec


class DensityRange(Reader):
    """``[lowest, highest]`` relative density."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        """Convert ``[0.10, 0.65]``."""
        if not isinstance(value, list) or len(value) != 2:
            digits = value if isinstance(value, list) and len(value) == 4 else ()
            example = "such as [0.10, 0.65]"
            if digits and all(isinstance(d, int) and d >= 0 for d in digits):
                a, b, c, d = digits
                example += f"; with decimal points: [{a}.{b}, {c}.{d}]"
            raise Refused(
                f"found {shown(value)}; expected the lowest and the highest relative density "
                f"{example}"
            )
        low, high = (Number(above=0.0, below=1.0).read(v) for v in value)
        if low > high:
            raise Refused(
                f"found [{low:g}, {high:g}], the lowest above the highest; expected "
                f"[{high:g}, {low:g}]"
            )
        return low, high

    def json_schema(self) -> JsonSchema:
        """Two numbers."""
        item = Number(above=0.0, below=1.0).json_schema()
        pair = {"type": "array", "items": item, "minItems": 2, "maxItems": 2}
        return {**pair, "examples": [[0.10, 0.65]]}


class Parameters(Reader):
    """Plain numbers by name."""

    __slots__ = ()

    def read(self, value: object) -> dict[str, float]:
        """Convert ``{offset = 0.2}``."""
        if not isinstance(value, dict):
            raise Refused(f"found {shown(value)}; expected a table such as {{offset = 0.2}}")
        numbers = {}
        for key, entry in value.items():
            try:
                numbers[key] = Number().read(entry)
            except Refused as error:
                raise Refused(f"{key}: {error}") from None
        return numbers

    def json_schema(self) -> JsonSchema:
        """A table of numbers."""
        number = {"type": "number"}
        return {"type": "object", "additionalProperties": number, "examples": [{"offset": 0.2}]}


#: Keys of a lattice whose density is stated rather than found.
STATED = ("density_map", "transition", "parameter_map")
#: Ways to find the density; the first by default.
METHODS = ("lightest", "stress-to-density")
#: Quantities that may follow the density.
GRADINGS = ("uniform", "level", "thickness", "size", "ratio")

_Density: TypeAlias = Annotated[tuple[float, float], DensityRange()]


class CellsSpec(Table):
    """The cells that fill the part and how they lie in it, apart from their density."""

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
    """Radius of the fillets where lattice, skins and passive regions meet, mm."""
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
    def _graded_size(self) -> CellsSpec:
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
    def _net_alone(self) -> CellsSpec:
        if self.joint_radius and any(skin.net for skin in self.skin):
            raise key_error("joint_radius", "does not go with a net-skin yet; leave one out")
        return self

    @model_validator(mode="after")
    def _fillings_below_skins(self) -> CellsSpec:
        closed = [skin for skin in self.skin if not skin.net]
        if self.bevel and not closed:
            raise key_error("bevel", 'has no meaning without a skin; add e.g. skin = "1 mm"')
        if self.least_cavity and all(skin.faces for skin in closed):
            raise key_error(
                "least_cavity",
                'has no meaning without a skin all round; add e.g. skin = "1 mm"',
            )
        return self

    @model_validator(mode="after")
    def _orientation_alone(self) -> CellsSpec:
        if self.orientation is None:
            return self
        for key in ("cell_map", "warp"):
            if getattr(self, key):
                raise key_error(key, "does not go with [lattice.orientation]; leave one out")
        if len(self.size) == 3:
            raise key_error("size", "three edges do not go with [lattice.orientation] yet")
        return self

    @model_validator(mode="after")
    def _edges_of_map(self) -> CellsSpec:
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


class LatticeSpec(CellsSpec):
    """The lattice that fills the part, its density to be found."""

    density: _Density = (0.01, 0.99)
    """Lowest and highest relative density the user allows; the windows of the family and of its
    law narrow it further."""

    method: Annotated[str, Choice(METHODS)] = "lightest"
    """lightest: the least mass under every limit, by gradients; stress-to-density: the plain way,
    the stress of the fully solid part mapped to density by the law and scaled until every limit
    holds, with ``acceptance = "whole"`` unless it is stated."""

    size_effects: Annotated[bool, Flag()] = True
    """Size effect: the stiffness of walls with few cells between the part's free faces, where it
    can be computed; ``false`` only to compare with the periodic lattice."""

    @property
    def by_stress(self) -> bool:
        """Whether the plain method finds the density."""
        return self.method == METHODS[1]

    @model_validator(mode="after")
    def _graded_by_stress(self) -> LatticeSpec:
        if self.by_stress and self.grading == "uniform":
            raise key_error(
                "method",
                'stress-to-density makes a map of densities, which grading = "uniform" has not; '
                'expected another grading, or method = "lightest"',
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def _nothing_stated(cls, value: Any) -> Any:
        for key in STATED if isinstance(value, dict) else ():
            if key in value:
                raise key_error(
                    key,
                    "belongs to `gradedesign generate`; `gradedesign run` and `check` find the "
                    "density themselves, and cells that differ from place to place are stated as "
                    "[[zone]]: leave it out",
                )
        return value

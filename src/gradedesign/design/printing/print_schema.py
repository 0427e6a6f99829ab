"""``[print]``: capabilities of the printer, and limits on how the printed solid is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign.common.values.direction import Direction
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import (
    Choice,
    Number,
    Quantity,
    Size,
    Triple,
    Vector,
    Whole,
)


class PrintLimitsSpec(Table):
    """Limits on the printed solid; each is a row of the verdict."""

    example: ClassVar[str] = '{thickness = "0.5 mm"}'

    thickness: Size | None = Field(default=None, examples=["0.5 mm"])
    """Of solid behind the surface, but for the thinnest 5 % of it, at least, mm."""
    pore_throat: Size | None = Field(default=None, examples=["0.8 mm"])
    """Ball that reaches 95 % of the voids' volume from outside, at least, mm."""
    overhang: Annotated[float | None, Number(at_least=0.0, at_most=1.0)] = Field(
        default=None, examples=[0.2]
    )
    """Share of the surface that overhangs and does not lie on the plate, at most."""
    support_volume: Annotated[float | None, Quantity("volume", at_least=0.0)] = None
    """Below overhangs, down to the next surface or the plate, at most, mm^3."""
    islands: Annotated[int | None, Whole(at_least=0, at_most=10**9)] = Field(
        default=None, examples=[0]
    )
    """Regions of a layer without material below them, at most."""
    trapped_powder: Annotated[float | None, Quantity("volume", at_least=0.0)] = None
    """Volume of voids that powder cannot leave, at most, mm^3."""
    feather_edges: Annotated[float | None, Number(at_least=0.0, at_most=1.0)] = Field(
        default=None, examples=[0.001]
    )
    """Share of the surface with less than ``min_wall`` of solid behind it where two faces enclose
    less than 30 degrees, at most."""


class PrintSpec(Table):
    """Capabilities of the printer, and limits on the printed solid."""

    replaced: ClassVar[Mapping[str, str]] = {
        "as_built_offset": "is what a process does to the surface: write its pairs as offset in "
        "[process], whose as-built body is then measured and analysed"
    }
    called: ClassVar[Mapping[str, str]] = {
        "min_thickness": "min_wall",
        "min_feature": "min_wall",
        "min_hole": "min_throat",
        "bed": "build_volume",
    }

    min_wall: Size | None = Field(default=None, examples=["0.8 mm"])
    """Thinnest wall or strut that can be printed, mm; it bounds the density from below, and closed
    pores smaller than a ball of it are filled."""
    min_throat: Size | None = Field(default=None, examples=["0.8 mm"])
    """Narrowest throat through which powder leaves a void, mm; without it, only closed voids
    count as trapped."""
    layer_height: Size | None = Field(default=None, examples=["0.05 mm"])
    """Thickness of a layer, mm; formats of layers need it."""
    pixel_size: Size | None = Field(default=None, examples=["0.05 mm"])
    """Resolution of the machine within a layer, mm. Not stated, it is the layer height, or half or
    a quarter of it where the layers hold the printed volume only then."""
    chord_tolerance: Size | None = Field(default=None, examples=["0.01 mm"])
    """Largest distance by which the printed surface may move where its triangles are merged to
    fewer, mm; without it none are merged."""
    outer: Annotated[str, Choice(("cut", "cad"))] = "cut"
    """Outer faces of the printed surface. cut: the part's, divided where the lattice meets them;
    cad: the triangles of the part as they are, with the internal surface behind a skin all
    round."""
    build_direction: Direction = "+z"
    """Direction of the part that points upwards in the printer."""
    overhang_angle: Annotated[float, Quantity("angle", above=0.0, at_most=90.0)] = Field(
        default=45.0, examples=["40 deg"]
    )
    """Facets inclined to the plate by less overhang, degrees."""
    build_volume: (
        Annotated[Triple, Vector("length", '["250 mm", "250 mm", "300 mm"]', 0.0)] | None
    ) = None
    """Room of the printer along its x, y and upwards, mm."""
    limits: PrintLimitsSpec = Field(default_factory=PrintLimitsSpec)
    """Limits on the printed solid."""

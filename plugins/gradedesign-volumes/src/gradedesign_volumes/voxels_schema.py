"""``[part.voxels]``: what of a scanned volume is the part."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign import Flag, Number, Quantity, Table, Vector


class VoxelsSpec(Table):
    """Voxels of a scan that are solid, and how far their surface may be smoothed."""

    example: ClassVar[str] = '{threshold = 1200.0, spacing = "0.1 mm"}'

    threshold: Annotated[float | None, Number()] = Field(default=None, examples=[1200.0])
    """Voxels above it are solid; of true and false, true without it."""
    below: Annotated[bool, Flag()] = False
    """Whether voxels below the threshold are solid instead."""
    spacing: Annotated[
        tuple[float, float, float] | None,
        Vector("length", '["0.1 mm", "0.1 mm", "0.2 mm"]', 0.0, one=True),
    ] = Field(default=None, examples=["0.1 mm"])
    """Edges of a voxel, mm; may be left out where the file has them."""
    tolerance: Annotated[float | None, Quantity("length", above=0.0)] = Field(
        default=None, examples=["0.05 mm"]
    )
    """How far smoothing may move the surface of the voxels, mm; half of their shortest edge by
    default."""

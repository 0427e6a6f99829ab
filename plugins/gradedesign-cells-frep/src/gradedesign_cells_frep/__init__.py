"""Function-based cells for gradedesign: slabs, rods, blends, replicated pores, slotted plates."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import CellFamily, ScalingLaw, hookimpl, shipped_laws
from gradedesign_cells_frep import (
    cube_pores,
    cylinder_pores,
    ellipsoid_pores,
    honeycomb_plates,
    octahedron_pores,
    rods,
    rods_blended,
    sine_pores,
    slabs,
    slotted_plates,
    sphere_pores,
)
from gradedesign_cells_frep.pore_family import Pores, pore_family

__all__ = ["Pores", "gradedesign_cell_families", "gradedesign_scaling_laws", "pore_family"]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register the cells of every shape."""
    for shape in (
        cube_pores, cylinder_pores, ellipsoid_pores, honeycomb_plates, octahedron_pores, rods,
        rods_blended, sine_pores, slabs, slotted_plates, sphere_pores,
    ):  # fmt: skip
        yield from shape.FAMILIES


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register the laws computed for these cells."""
    yield from shipped_laws(f"{__name__}.properties")

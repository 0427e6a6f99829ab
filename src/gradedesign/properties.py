"""Names for computing properties of cells: homogenisation, bounds, tables."""

from __future__ import annotations

from gradedesign.arrays import locked
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.mechanics.homogenise.bounds import check_bounds, hashin_shtrikman_upper
from gradedesign.mechanics.homogenise.cell_properties import CellProperties, cell_properties
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    isotropic_averages,
    solid_stiffness,
    youngs_along,
    zener_ratio,
)
from gradedesign.mechanics.homogenise.constrained import (
    Block,
    block_nodes,
    padded_block,
    solve_held,
)
from gradedesign.mechanics.homogenise.critical_stress import CriticalStress, critical_stress
from gradedesign.mechanics.homogenise.directional import transverse_range, youngs_extremes
from gradedesign.mechanics.homogenise.islands import connected_fill
from gradedesign.mechanics.homogenise.periodic import solve_periodic, uniform_stress_load, unit_load
from gradedesign.mechanics.homogenise.sampling import (
    LEAST_VOXELS,
    cell_fill,
    require_resolved,
    voxels_in_wall,
)
from gradedesign.mechanics.homogenise.table import compute_buckling, compute_table
from gradedesign.mechanics.material.long_waves import critical_long_waves
from gradedesign.mechanics.material.property_table import write_property_table
from gradedesign.mechanics.material.stiffness_constants import relative_errors
from gradedesign.mechanics.material.strength_surface import StrengthSurface

__all__ = [
    "LEAST_VOXELS",
    "Block",
    "Cell",
    "CellProperties",
    "CriticalStress",
    "StrengthSurface",
    "block_nodes",
    "calibrate",
    "cell_fill",
    "cell_properties",
    "check_bounds",
    "compute_buckling",
    "compute_table",
    "connected_fill",
    "critical_long_waves",
    "critical_stress",
    "engineering_constants",
    "hashin_shtrikman_upper",
    "isotropic_averages",
    "locked",
    "padded_block",
    "relative_errors",
    "require_resolved",
    "solid_stiffness",
    "solve_held",
    "solve_periodic",
    "transverse_range",
    "uniform_stress_load",
    "unit_load",
    "voxels_in_wall",
    "write_property_table",
    "youngs_along",
    "youngs_extremes",
    "zener_ratio",
]

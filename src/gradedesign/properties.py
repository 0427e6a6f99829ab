"""Names for computing properties of cells: homogenisation, bounds, tables."""

from __future__ import annotations

from gradedesign.arrays import locked
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.mechanics.homogenise.bounds import check_bounds, hashin_shtrikman_upper
from gradedesign.mechanics.homogenise.cell_properties import RTOL, CellProperties, cell_properties
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    isotropic_averages,
    solid_stiffness,
    youngs_along,
    zener_ratio,
)
from gradedesign.mechanics.homogenise.islands import connected_fill
from gradedesign.mechanics.homogenise.operator import (
    VoxelOperator,
    block_inverse,
    homogeneous_inverse,
    node_scale,
    precondition,
    threads_for,
    voxel_operator,
)
from gradedesign.mechanics.homogenise.periodic import (
    PAIRS,
    PeriodicSolution,
    conjugate_gradients,
    solve_periodic,
    uniform_stress_load,
    unit_load,
)
from gradedesign.mechanics.homogenise.sampling import (
    LEAST_VOXELS,
    cell_fill,
    require_resolved,
    voxels_in_wall,
)
from gradedesign.mechanics.homogenise.strength import local_stress, stress_factors
from gradedesign.mechanics.homogenise.table import compute_table
from gradedesign.mechanics.material.buckling_table import BucklingTable
from gradedesign.mechanics.material.long_waves import critical_long_waves
from gradedesign.mechanics.material.property_table import write_property_table
from gradedesign.mechanics.material.stiffness_constants import relative_errors
from gradedesign.mechanics.material.strength_surface import StrengthSurface

__all__ = [
    "LEAST_VOXELS", "PAIRS", "RTOL", "BucklingTable", "Cell", "CellProperties", "PeriodicSolution",
    "StrengthSurface", "VoxelOperator", "block_inverse", "calibrate", "cell_fill",
    "cell_properties", "check_bounds", "compute_table", "conjugate_gradients", "connected_fill",
    "critical_long_waves", "engineering_constants", "hashin_shtrikman_upper", "homogeneous_inverse",
    "isotropic_averages", "local_stress", "locked", "node_scale", "precondition", "relative_errors",
    "require_resolved", "solid_stiffness", "solve_periodic", "stress_factors", "threads_for",
    "uniform_stress_load", "unit_load", "voxel_operator", "voxels_in_wall", "write_property_table",
    "youngs_along", "zener_ratio",
]  # fmt: skip

"""Stiffness and strength of a periodic cell at one density, from two grids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step, stepping
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.errors import SolverError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import Symmetry
from gradedesign.mechanics.homogenise.bounds import require_bounds
from gradedesign.mechanics.homogenise.fit_surface import fit_surface
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.sampling import (
    CUBE,
    LEAST_VOXELS,
    cell_fill,
    require_resolved,
    voxels_in_wall,
)
from gradedesign.mechanics.homogenise.strength import (
    PERCENTILE,
    Strength,
    cell_strength,
    local_stress,
)
from gradedesign.mechanics.material.strength_surface import StrengthSurface

#: Voxels along the cell that are tried in turn until the wall has enough of them.
RESOLUTIONS = (64, 80, 96, 112, 128)
#: Voxels across the thinnest strut from which the extrapolation is trusted: `LEAST_VOXELS` on the
#: coarser grid too. With four of them it was 1.6 % off in the octet's C44 at density 0.05.
_STRUT_VOXELS = 2 * LEAST_VOXELS
#: The energy is stationary: at this residual the stiffness is right to seven digits.
RTOL = 1e-4
#: Of the directions and points of the strength surface: tables are reproducible.
_SEED = 20261121
#: Departure from cubic symmetry above which a family's declaration is not believed. Chosen, not
#: measured.
_CUBIC_SLACK = 0.02


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class CellProperties(ShownRecord):
    """Computed properties of a cell at one density."""

    density: float  #: Relative density.
    resolution: int  #: Voxels along the cell on the finer grid; the other has half of them.
    stiffness: FloatArray  #: ``(6, 6)``. Extrapolated to no voxels.
    #: ``(6, 6)``. Of each entry, without sign: what the extrapolation added, or the departure from
    #: the declared symmetry where that is larger.
    uncertainty: FloatArray
    stiffness_error: float  #: Norm of the extrapolation over that of the stiffness.
    #: Largest share of the energy that the extrapolation changes, over all strains: where a cell is
    #: soft in one direction this is far more than `stiffness_error`.
    energy_error: float
    strength: Strength  #: On the finer grid.
    strength_error: float  #: Relative change from the coarser grid.
    #: Local stress under any macroscopic stress, on the finer grid.
    surface: StrengthSurface | None


def cell_properties(
    cell: Cell,
    rho: float,
    *,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    with_surface: bool = True,
    edges: Sequence[float] = CUBE,
) -> CellProperties:
    """Stiffness and strength of a periodic cell, from two grids.

    Raises `DensityError` if the cell does not exist at this density or its wall has fewer than
    three voxels; `LatticeError` or `SolverError` as `solve_periodic`; also if the result violates a
    bound or the declared symmetry.

    - ``rho``: relative density
    - ``poissons_ratio``: of the base material
    - ``resolution``: even; by default the first of `RESOLUTIONS` with three voxels across the
      thinnest wall, or six across the thinnest strut; the last where none has six
    - ``with_surface``: fit a strength surface, which takes about as long as the analysis
    - ``edges (3,)``: of the cell, up to a factor

    Notes
    -----
    Voxels are filled by the share of samples in the solid. The error of the stiffness then falls
    with the square of the voxel: between 24, 48 and 96 voxels the changes are in a ratio of 3.8 to
    4 (gyroid sheet, density 0.3), so a third of the last change is added.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> found = cell_properties(cell, 0.5, resolution=16, with_surface=False)
    >>> found.stiffness.shape, bool(found.stiffness[0, 0] < 0.5)
    ((6, 6), True)
    """
    fine = resolution or _resolution(cell, rho, edges)
    if fine % 2 or fine < 8:
        raise SolverError(f"resolution {fine} is impossible; expected an even number of 8 or more")
    require_resolved(cell, rho, fine, edges)
    stiffness, strength = [], []
    symmetry = stretched_symmetry(cell.family.symmetry, edges)
    for n in (fine // 2, fine):
        with stepping(f"{n}^3 voxels"):
            report_step("filling voxels")
            fill = cell_fill(cell, rho, n, edges=edges)
            solution = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=RTOL)
            stiffness.append(solution.stiffness)
            report_step("strength")
            local = local_stress(solution)
            strength.append(cell_strength(local, PERCENTILE))
            del solution
    correction = (stiffness[1] - stiffness[0]) / 3
    extrapolated = stiffness[1] + correction
    uncertainty = np.abs(correction)
    if symmetry == "cubic":
        symmetric = cubic_part(extrapolated, cell.name)
        uncertainty = np.maximum(uncertainty, np.abs(extrapolated - symmetric))
        extrapolated = symmetric
    report_step("strength surface")
    require_bounds(extrapolated, rho, poissons_ratio, subject=f"cell '{cell.name}'")
    return CellProperties(
        density=rho,
        resolution=fine,
        stiffness=extrapolated,
        uncertainty=uncertainty,
        stiffness_error=float(np.linalg.norm(correction) / np.linalg.norm(extrapolated)),
        energy_error=float(np.abs(scipy.linalg.eigvalsh(correction, extrapolated)).max()),
        strength=strength[1],
        strength_error=abs(strength[0].strength / strength[1].strength - 1),
        surface=fit_surface(local, symmetry, np.random.default_rng(_SEED), PERCENTILE)
        if with_surface
        else None,
    )


def cubic_part(stiffness: FloatArray, name: str) -> FloatArray:
    """Mean of a stiffness over the rotations of the cube.

    Raises `SolverError` if it departs from that mean by more than 2 %.
    """
    c = np.zeros((6, 6))
    c[:3, :3] = (stiffness[0, 1] + stiffness[0, 2] + stiffness[1, 2]) / 3
    for i in range(3):
        c[i, i] = np.trace(stiffness[:3, :3]) / 3
        c[i + 3, i + 3] = np.trace(stiffness[3:, 3:]) / 3
    departure = float(np.linalg.norm(stiffness - c) / np.linalg.norm(c))
    if departure > _CUBIC_SLACK:
        raise SolverError(
            f"the stiffness of cell '{name}' departs by {100 * departure:.1f} % from the cubic "
            f"symmetry that the family declares, at most {100 * _CUBIC_SLACK:g} % is taken for "
            f"noise of the grid; declare the true symmetry or take more voxels"
        )
    return c


def stretched_symmetry(symmetry: Symmetry, edges: Sequence[float]) -> Symmetry:
    """Symmetry that is left of a cell's stiffness when its edges are changed.

    Every cubic class holds the half turns about the three edges, which stay. The tetragonal
    classes without them, and all others, are taken to keep nothing.
    """
    if min(edges) == max(edges):
        return symmetry
    return "orthotropic" if symmetry in ("cubic", "orthotropic") else "none"


def _resolution(
    cell: Cell,
    rho: float,
    edges: Sequence[float],
) -> int:
    """Pick the first resolution whose voxels resolve the wall; the last where none does."""
    # A strut bends by its corners; a sheet is resolved with half as many.
    wanted = LEAST_VOXELS if cell.family.sides == 2 else _STRUT_VOXELS
    for n in RESOLUTIONS:
        if voxels_in_wall(cell, rho, n, edges) >= wanted:
            return n
    return RESOLUTIONS[-1]

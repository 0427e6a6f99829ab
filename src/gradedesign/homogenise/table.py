"""Property tables: a cell's stiffness and strength over its window of densities."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell.calibration import calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import complete_parameters
from gradedesign.cell.wall_size import density_for_wall
from gradedesign.errors import DensityError, SolverError
from gradedesign.homogenise.constants import require_bounds
from gradedesign.homogenise.fit_surface import fit_surface
from gradedesign.homogenise.periodic import solve_periodic
from gradedesign.homogenise.sampling import (
    LEAST_VOXELS,
    SUBSAMPLES,
    cell_fill,
    require_resolved,
    voxels_in_wall,
)
from gradedesign.homogenise.strength import (
    PERCENTILE,
    Strength,
    cell_strength,
    local_stress,
)
from gradedesign.material.property_table import PropertyTable
from gradedesign.material.strength_surface import StrengthSurface

log = logging.getLogger(__name__)

#: Voxels along the cell that are tried in turn until the wall has enough of them.
RESOLUTIONS = (64, 80, 96, 112, 128)
#: Changes whenever the numbers do.
METHOD_VERSION = 1
#: The energy is stationary: at this residual the stiffness is right to seven digits.
RTOL = 1e-4

#: With these the law is within 0.5 % in stiffness and 2 % in strength of rows left out between.
_DENSITIES = (0.05, 0.07, 0.1, 0.14, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8)
#: Least density over that at which the solid falls apart.
_ABOVE_FLOOR = 1.15
#: Of the directions and points of the strength surface: tables are reproducible.
_SEED = 20261121
#: Departure from cubic symmetry above which a family's declaration is not believed.
_CUBIC_SLACK = 0.02


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellProperties:
    """Computed properties of a cell at one density.

    Attributes
    ----------
    density : float
    resolution : int
        Voxels along the cell on the finer grid; the other has half of them.
    stiffness : (6, 6) array
        Extrapolated to no voxels.
    stiffness_error : float
        Norm of the extrapolation over that of the stiffness.
    strength : Strength
        On the finer grid.
    strength_error : float
        Relative change from the coarser grid.
    surface : StrengthSurface
        Local stress under any macroscopic stress, on the finer grid.
    """

    density: float
    resolution: int
    stiffness: FloatArray
    stiffness_error: float
    strength: Strength
    strength_error: float
    surface: StrengthSurface


def cell_properties(
    family: CellFamily,
    parameters: Mapping[str, float] | None,
    rho: float,
    *,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    percentile: float = PERCENTILE,
) -> CellProperties:
    """Stiffness and strength of a periodic cell, from two grids.

    Parameters
    ----------
    family : CellFamily
    parameters : mapping of str to float or None
    rho : float
    poissons_ratio : float
        Of the base material.
    resolution : int, optional
        Even; by default the first of `RESOLUTIONS` with three voxels across the thinnest wall.
    percentile : float
        By volume, of the local von Mises stress.

    Returns
    -------
    CellProperties

    Raises
    ------
    DensityError
        If the cell does not exist at this density or its wall has fewer than three voxels.
    LatticeError, SolverError
        As `solve_periodic`; also if the result violates a bound or the declared symmetry.

    Notes
    -----
    Voxels are filled by the share of samples in the solid. The error of the stiffness then falls
    with the square of the voxel: between 24, 48 and 96 voxels the changes are in a ratio of 3.8 to
    4 (gyroid sheet, density 0.3), so a third of the last change is added.
    """
    fine = resolution or _resolution(family, parameters, rho)
    if fine % 2 or fine < 8:
        raise SolverError(f"resolution {fine} is impossible; expected an even number of 8 or more")
    require_resolved(family, parameters, rho, fine)
    stiffness, strength = [], []
    for n in (fine // 2, fine):
        fill = cell_fill(family, parameters, rho, n)
        solution = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=RTOL)
        stiffness.append(solution.stiffness)
        local = local_stress(solution)
        strength.append(cell_strength(local, percentile))
        del solution
    correction = (stiffness[1] - stiffness[0]) / 3
    extrapolated = stiffness[1] + correction
    if family.symmetry == "cubic":
        extrapolated = cubic_part(extrapolated, family.name)
    require_bounds(extrapolated, rho, poissons_ratio, what=f"cell '{family.name}'")
    return CellProperties(
        density=rho,
        resolution=fine,
        stiffness=extrapolated,
        stiffness_error=float(np.linalg.norm(correction) / np.linalg.norm(extrapolated)),
        strength=strength[1],
        strength_error=abs(strength[0].strength / strength[1].strength - 1),
        surface=fit_surface(local, family.symmetry, np.random.default_rng(_SEED), percentile),
    )


def compute_table(
    family: CellFamily,
    parameters: Mapping[str, float] | None = None,
    *,
    densities: Sequence[float] | None = None,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    on_row: Callable[[CellProperties], None] | None = None,
) -> PropertyTable:
    """Compute the property table of a cell.

    Parameters
    ----------
    family : CellFamily
    parameters : mapping of str to float, optional
    densities : sequence of float, optional
        By default `table_densities`.
    poissons_ratio : float
    resolution : int, optional
        Of all rows; by default each row has the resolution that its wall needs.
    on_row : callable, optional
        Called with each density's result.

    Returns
    -------
    PropertyTable

    Raises
    ------
    DensityError, LatticeError, SolverError
        As `cell_properties`.
    """
    complete = complete_parameters(family, parameters)
    finest = resolution or RESOLUTIONS[-1]
    if densities is None:
        densities = table_densities(family, parameters, finest)
    rows = []
    for rho in densities:
        row = cell_properties(
            family, parameters, rho, poissons_ratio=poissons_ratio, resolution=resolution
        )
        log.info("cell %s at %.3f: C11 %.5f", family.name, rho, row.stiffness[0, 0])
        if on_row is not None:
            on_row(row)
        rows.append(row)
    return PropertyTable(
        name=f"{family.name}-computed",
        family=family.name,
        parameters=complete,
        symmetry=family.symmetry,
        poissons_ratio=poissons_ratio,
        density=np.array([r.density for r in rows]),
        stiffness=np.array([r.stiffness for r in rows]),
        stiffness_error=np.array([r.stiffness_error for r in rows]),
        strength=np.array([r.strength.strength for r in rows]),
        strength_error=np.array([r.strength_error for r in rows]),
        factors={
            **{n: np.array([r.strength.factor[n] for r in rows]) for n in rows[0].strength.factor},
            "hydrostatic": np.array([r.strength.hydrostatic for r in rows]),
        },
        surfaces=tuple(r.surface for r in rows),
        resolution=np.array([r.resolution for r in rows]),
        percentile=PERCENTILE,
        method=_method(poissons_ratio),
        version=f"{metadata.version('gradedesign')} (method {METHOD_VERSION})",
        date=datetime.now(tz=UTC).date().isoformat(),
    )


def table_densities(
    family: CellFamily, parameters: Mapping[str, float] | None, resolution: int
) -> tuple[float, ...]:
    """Densities of a table: closer together where the cell is thin.

    From 0.05, or where the thinnest wall has `LEAST_VOXELS` voxels, or 15 % above the density at
    which the solid falls apart, to 0.8, or where the void closes; the ends are rounded to a
    thousandth inwards. Nearer to falling apart, the last necks decide everything: a thousandth
    more density is several per cent more stiffness.

    Raises
    ------
    DensityError
        If fewer than two are left.
    """
    window = calibrate(family, parameters).window
    thinnest = density_for_wall(family, parameters, LEAST_VOXELS / resolution, 1.0)
    floor = max(thinnest, _ABOVE_FLOOR * window[0])
    lower = max(np.ceil(1000 * floor + 0.01) / 1000, _DENSITIES[0])
    upper = min(np.floor(1000 * window[1] - 0.01) / 1000, _DENSITIES[-1])
    inner = [d for d in _DENSITIES if 1.05 * lower < d < 0.97 * upper]
    chosen = (float(lower), *inner, float(upper))
    if lower >= upper:
        raise DensityError(
            f"cell '{family.name}' has walls of {LEAST_VOXELS:g} voxels at resolution {resolution} "
            f"only from density {lower:.3f} on, but its void closes at {upper:.3f}; "
            f"take a higher resolution"
        )
    return chosen


def cubic_part(stiffness: FloatArray, name: str) -> FloatArray:
    """Mean of a stiffness over the rotations of the cube.

    Raises
    ------
    SolverError
        If it departs from that mean by more than 2 %.
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


def _resolution(family: CellFamily, parameters: Mapping[str, float] | None, rho: float) -> int:
    """Pick the first resolution whose voxels resolve the wall; the last where none does."""
    for n in RESOLUTIONS:
        if voxels_in_wall(family, parameters, rho, n) >= LEAST_VOXELS:
            return n
    return RESOLUTIONS[-1]


def _method(poissons_ratio: float) -> str:
    """State how a table was made."""
    return (
        f"one periodic cell of trilinear hexahedra, each filled by {SUBSAMPLES}^3 samples, "
        f"nu {poissons_ratio:g}, stiffness extrapolated from two grids; strength from the "
        f"{PERCENTILE:g}th volume percentile of von Mises stress at voxel centres, worst of 63 "
        f"macroscopic stresses"
    )

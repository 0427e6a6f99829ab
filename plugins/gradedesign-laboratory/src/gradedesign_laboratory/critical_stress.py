"""Macroscopic stresses at which a periodic cell buckles, at one density, from two grids."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign import EigenSolver, ExtremeValue, SolverError
from gradedesign.commands import counted
from gradedesign.fields import FloatArray, IntArray
from gradedesign.properties import (
    LEAST_VOXELS,
    PAIRS,
    RTOL,
    Cell,
    PeriodicSolution,
    cell_fill,
    local_stress,
    require_resolved,
    solve_periodic,
    stress_factors,
    voxels_in_wall,
)
from gradedesign_laboratory.alternating import ALL_SIGNS, REPEATED, Signs
from gradedesign_laboratory.buckling import NEGLIGIBLE, macro_prestress, weakest_modes
from gradedesign_laboratory.lanczos import LANCZOS

log = logging.getLogger(__name__)

#: Voxels along the cell that are tried in turn until the wall has enough of them.
BUCKLING_RESOLUTIONS = (32, 40, 48, 56, 64)
#: Any fixed number, so that a table can be computed again.
_SEED = 20261122
#: Largest share that the extrapolation may change. At the sharp inner corners that voxels have
#: where round struts meet, the local stress grows with refinement without end, and with it a mode
#: in the corner alone: its load falls as one over the resolution, 0.0021, 0.0013, 0.0010 E at 16,
#: 24, 32 voxels for a simple cubic frame of density 0.1 in shear. That is no number of the cell.
#: Chosen, not measured.
_MOST_CHANGE = 0.25
#: Local von Mises stress, over Young's modulus, at which any base material has long yielded: the
#: metals of the library do at 0.003 to 0.0075, its polymers at 0.02 to 0.03.
_YIELDED = 0.05
#: A load that does not settle is replaced by that of `_YIELDED` only if the fine grid's is this
#: many times as large. Chosen, not measured.
_CLEAR = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CriticalStress:
    """Stresses that buckle a cell at one density, each acting alone.

    Attributes
    ----------
    density : float
        Relative density.
    resolution : int
        Voxels along the cell on the finer grid; the other has half of them.
    wall_voxels : float
        Across the thinnest wall of the finer grid.
    critical : (6, 2) array
        Of each Voigt component, negative and positive, over the base material's Young's modulus.
    cells : (6, 2) int array
        After how many cells the mode repeats; 0 where `critical` is only what the cell bears at
        least: what is not seen to buckle, or does so long after its material has yielded.
    error : float
        Largest share that the extrapolation changed.
    """

    density: float
    resolution: int
    wall_voxels: float
    critical: FloatArray
    cells: IntArray
    error: float


def critical_stress(
    cell: Cell,
    rho: float,
    *,
    poissons_ratio: float = 0.3,
    resolution: int | None = None,
    solver: EigenSolver = LANCZOS,
) -> CriticalStress:
    """Stresses that buckle a cell in modes that repeat after one or two cells.

    Parameters
    ----------
    rho : float
        Relative density.
    poissons_ratio : float
        Of the base material.
    resolution : int, optional
        Multiple of 4; by default the first of `BUCKLING_RESOLUTIONS` with three voxels across the
        thinnest wall.

    Raises
    ------
    DensityError
        If the cell does not exist at this density or its wall has fewer than three voxels.
    LatticeError, SolverError
        As `solve_periodic` and `weakest_modes`; `SolverError` also if the extrapolation adds more
        than `_MOST_CHANGE` to a load under which the material can be elastic.

    Notes
    -----
    The coarse grid is searched for the weakest of the eight combinations of signs (see
    `alternating`), the fine one analysed in that alone, starting from the coarse mode. Voxels make
    walls too stiff in bending in proportion to the square of their size, so a third of the last
    change is added. Under cubic symmetry compression and tension along x and shear in xy stand for
    all; half turns about the axes make the two senses of shear equal.
    """
    fine = resolution or _resolution(cell, rho)
    if fine % 4 or fine < 8:
        raise SolverError(f"resolution {fine} is impossible; expected a multiple of 4, from 8")
    require_resolved(cell, rho, fine)
    symmetry = cell.family.symmetry
    coarse_solution, fine_solution = (
        solve_periodic(
            cell_fill(cell, rho, n, share_ties=True),
            poissons_ratio=poissons_ratio,
            rtol=RTOL,
        )
        for n in (fine // 2, fine)
    )
    critical, cells, error = np.zeros((6, 2)), np.zeros((6, 2), dtype=np.int64), 0.0
    loads = (0, 5) if symmetry == "cubic" else tuple(range(6))
    for load in counted(loads, "buckling under stress", len(loads)):
        equal_senses = load > 2 and symmetry in ("cubic", "orthotropic")
        grids = (coarse_solution, fine_solution)
        senses = _both_senses(*grids, load, equal_senses=equal_senses, solver=solver)
        for sense, (value, repeat, change) in enumerate(senses):
            critical[load, sense], cells[load, sense] = value, repeat
            error = max(error, change)
    if symmetry == "cubic":
        critical[1:3], cells[1:3] = critical[0], cells[0]
        critical[3:5], cells[3:5] = critical[5], cells[5]
    return CriticalStress(
        density=rho,
        resolution=fine,
        wall_voxels=voxels_in_wall(cell, rho, fine),
        critical=critical,
        cells=cells,
        error=error,
    )


def _both_senses(
    coarse: PeriodicSolution,
    fine: PeriodicSolution,
    load: int,
    *,
    equal_senses: bool,
    solver: EigenSolver,
) -> tuple[tuple[float, int, float], tuple[float, int, float]]:
    """Critical size, cells of the mode and relative extrapolation, stress negative and positive."""
    rng = np.random.default_rng(_SEED)
    stress = macro_prestress(coarse, -np.eye(6)[load])
    start = rng.standard_normal((3, *coarse.fill.shape))
    scan = {
        signs: weakest_modes(
            coarse.fill,
            stress,
            poissons_ratio=coarse.poissons_ratio,
            start=start,
            signs=signs,
            both=not equal_senses,
            solver=solver,
        )
        for signs in counted(ALL_SIGNS, "combination of signs", len(ALL_SIGNS))
    }
    strongest = max(abs(end.value) for pair in scan.values() for end in pair if end is not None)
    critical: list[tuple[float, int, float] | None] = []
    for sense in range(1 if equal_senses else 2):
        ends = {signs: end for signs, pair in scan.items() if (end := pair[sense]) is not None}
        seen = max(abs(end.value) for end in ends.values())
        follow = seen > NEGLIGIBLE * strongest
        critical.append(_refined(fine, load, sense, ends, solver) if follow else None)
    if equal_senses:
        critical.append(critical[0])
    sizes = [f[0] for f in critical if f is not None]
    if not sizes:
        raise SolverError(
            f"no stress of component {load} buckles this cell in any of eight modes; is it solid?"
        )
    # Not seen to buckle: not before its reverse's load over this share.
    least = (min(sizes) / NEGLIGIBLE, 0, 0.0)
    negative, positive = (least if f is None else f for f in critical)
    return negative, positive


def _refined(
    fine: PeriodicSolution,
    load: int,
    sense: int,
    ends: Mapping[Signs, ExtremeValue],
    solver: EigenSolver,
) -> tuple[float, int, float] | None:
    """Extrapolated critical size in the weakest combination of signs; None if nothing buckles."""
    signs = max(ends, key=lambda s: abs(ends[s].value))
    weakest = ends[signs]
    if weakest.value == 0:
        return None
    half = tuple(n // 2 for n in fine.fill.shape)
    sign = -1.0 if sense == 0 else 1.0
    refined, _ = weakest_modes(
        fine.fill,
        macro_prestress(fine, sign * np.eye(6)[load]),
        poissons_ratio=fine.poissons_ratio,
        start=refined_mode(weakest.vector.reshape(3, *half), signs),
        signs=signs,
        both=False,
        solver=solver,
    )
    before, after = 1 / abs(weakest.value), 1 / refined.value
    value = after + (after - before) / 3
    log.info("component %d sense %d, signs %s: %g, %g", load, sense, signs, before, after)
    change = np.inf if value <= 0 else abs(after - before) / 3 / value
    if change > _MOST_CHANGE:
        # A mode in a corner comes at strains that no material bears. Yield comes first at any
        # refinement, and what the cell bears then is a load below which it does not buckle.
        factor = stress_factors(local_stress(fine), np.eye(6)[:, [load]])[0]
        least = _YIELDED / float(factor)
        if _CLEAR * least <= after:
            return least, 0, 0.0
        raise SolverError(
            f"the critical stress of component {PAIRS[load]} goes from {before:.4g} to {after:.4g} "
            f"E between {half[0]} and {fine.fill.shape[0]} voxels, too much to extrapolate: at "
            f"most {_MOST_CHANGE:.0%} may be added; take a higher resolution, unless the mode sits "
            f"in a corner between struts, which no resolution helps"
        )
    return value, 1 if signs == REPEATED else 2, change


def refined_mode(mode: FloatArray, signs: Signs) -> FloatArray:
    """Nodal values ``(3, nx, ny, nz)`` of given signs, interpolated to twice the nodes."""
    for axis, sign in enumerate(signs, start=1):
        ahead = np.roll(mode, -1, axis)
        last = [slice(None)] * 4
        last[axis] = slice(-1, None)
        ahead[tuple(last)] *= sign
        both = np.stack([mode, 0.5 * (mode + ahead)], axis=axis + 1)
        shape = list(mode.shape)
        shape[axis] *= 2
        mode = both.reshape(shape)
    return mode


def _resolution(cell: Cell, rho: float) -> int:
    """Pick the first resolution whose voxels resolve the wall; the last where none does."""
    for n in BUCKLING_RESOLUTIONS:
        if voxels_in_wall(cell, rho, n) >= LEAST_VOXELS:
            return n
    return BUCKLING_RESOLUTIONS[-1]

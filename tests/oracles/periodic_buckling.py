"""Buckling of a cell repeated on a large grid: the slow way, which long waves are held against."""

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.homogenise.periodic import PeriodicSolution
from gradedesign_laboratory.buckling import macro_prestress, weakest_modes

#: A load under which the voxels' stress would be a thousand moduli is none.
_NO_BUCKLING = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Buckling:
    """The lowest buckling load of a cell.

    Attributes
    ----------
    factor : float
        The cell buckles at this multiple of the macroscopic stress, in units of the base
        material's Young's modulus; ``inf`` where the stress cannot buckle it.
    mode : (3, nx, ny, nz) array
        Displacement, largest component 1; zero where the factor is infinite.
    cells : int
        After how many cells along each axis the mode repeats.
    """

    factor: float
    mode: FloatArray
    cells: int


def periodic_buckling(
    solution: PeriodicSolution,
    macro_stress: FloatArray,
    *,
    cells: int = 1,
    rng: np.random.Generator,
) -> Buckling:
    """Lowest buckling load of a homogenised cell.

    Parameters
    ----------
    solution : PeriodicSolution
    macro_stress : (6,) array
        Voigt stress; compression is negative.
    cells : int
        Cells along each axis after which the mode repeats.
    rng : numpy.random.Generator
        Draws the start of the iteration.

    Returns
    -------
    Buckling

    Raises
    ------
    SolverError
        If the iteration does not converge.

    Notes
    -----
    Full integration of trilinear voxels makes walls of few voxels too stiff in bending, so the
    load comes out too high: by about 1 over the square of their number across the wall.
    """
    stress = macro_prestress(solution, macro_stress)
    repeat = (cells,) * 3
    return prestress_buckling(
        np.tile(solution.fill, repeat),
        np.tile(stress, (1, *repeat)),
        poissons_ratio=solution.poissons_ratio,
        cells=cells,
        rng=rng,
    )


def prestress_buckling(
    fill: FloatArray,
    stress: FloatArray,
    *,
    poissons_ratio: float,
    rng: np.random.Generator,
    cells: int = 1,
) -> Buckling:
    """Lowest buckling load of a periodic grid under a field of stress.

    Parameters
    ----------
    fill : (nx, ny, nz) array
    stress : (6, nx, ny, nz) array
        Of each voxel, Voigt order.
    poissons_ratio : float
    rng : numpy.random.Generator
    cells : int
        Kept in the result.

    Returns
    -------
    Buckling

    Raises
    ------
    SolverError
        If the iteration does not converge.
    """
    shape = (3, *fill.shape)
    start = rng.standard_normal(shape)
    found, _ = weakest_modes(fill, stress, poissons_ratio=poissons_ratio, start=start, both=False)
    if found.value <= _NO_BUCKLING * float(np.abs(stress).max()):
        return Buckling(factor=np.inf, mode=np.zeros(shape), cells=cells)
    mode = found.vector.reshape(shape)
    return Buckling(factor=1 / found.value, mode=mode / np.abs(mode).max(), cells=cells)

"""Apparent stiffness of a finite block of cells, beside that of the periodic lattice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg

from gradedesign import ResourceError, SolverError
from gradedesign.fields import FloatArray
from gradedesign.properties import (
    LEAST_VOXELS,
    Cell,
    cell_fill,
    require_resolved,
    solve_periodic,
    voxels_in_wall,
)
from gradedesign_laboratory.block import VOID_STIFFNESS, filled_void, solve_block
from gradedesign_laboratory.macro_tet import macro_tet

Boundary = Literal["displacement", "traction", "mixed", "macro-tet"]
BOUNDARIES: tuple[Boundary, ...] = ("displacement", "traction", "mixed", "macro-tet")

#: Voxels along a cell that are tried in turn until the wall has enough of them.
RESOLUTIONS = range(16, 129, 8)
#: Voxels along the block at most: about 5 GB.
MOST_VOXELS = 256
#: Residuals of stiffnesses that come from energies, and of those that come from forces. An energy
#: is stationary, so its error is about the square of the residual; forces err with the residual
#: itself.
_RTOL, _RTOL_FORCES = 1e-4, 1e-5
#: Corners of the largest tetrahedron in a unit cube: a third of it.
_INSCRIBED = np.array([[0.0, 1, 1, 0], [0, 1, 0, 1], [0, 0, 1, 1]])
#: By how much the order of energies may be missed: the residuals of both solves.
_SLACK = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ApparentStiffness:
    """Apparent stiffness of a block of cells under uniform boundary conditions.

    Attributes
    ----------
    boundary : {"displacement", "traction", "mixed", "macro-tet"}
    cells : int
        Periods of the cell along each edge of the block.
    resolution : int
        Voxels along a period.
    void : float
        Stiffness of the void over the base material's, in both analyses.
    stiffness : (6, 6) array
        Over the base material's Young's modulus, Voigt order with engineering shear.
    periodic : (6, 6) array
        Of the periodic lattice on the same voxels.
    solid : float
        Solid volume fraction of what was analysed: a tetrahedron need not have the cell's.
    residual : float
        Largest of the six load cases.
    """

    boundary: Boundary
    cells: int
    resolution: int
    void: float
    stiffness: FloatArray
    periodic: FloatArray
    solid: float
    residual: float

    @property
    def energy_ratios(self) -> tuple[float, float]:
        """Least and greatest strain energy over the periodic lattice's, over all strains."""
        values = scipy.linalg.eigvalsh(self.stiffness, self.periodic)
        return float(values[0]), float(values[-1])

    @property
    def in_order(self) -> bool | None:
        """Whether the estimate lies on its side of the periodic value.

        Hazanov and Huet 1994: on whole periods uniform tractions never give more energy than the
        periodic lattice, uniform displacements never less. None where nothing is proved: of mixed
        conditions, and of a tetrahedron, which is not made of whole periods.
        """
        least, greatest = self.energy_ratios
        if self.boundary == "displacement":
            return least >= 1 - _SLACK
        return greatest <= 1 + _SLACK if self.boundary == "traction" else None


def apparent_stiffness(
    cell: Cell,
    rho: float,
    *,
    boundary: Boundary,
    cells: int = 1,
    resolution: int | None = None,
    poissons_ratio: float = 0.3,
) -> ApparentStiffness:
    """Apparent stiffness of ``cells^3`` periods of a cell, or of the tetrahedron inscribed in them.

    Parameters
    ----------
    rho : float
        Relative density.
    boundary : {"displacement", "traction", "mixed", "macro-tet"}
    resolution : int, optional
        Voxels along a period; by default the first of `RESOLUTIONS` with three voxels across the
        thinnest wall. Nothing is extrapolated.

    Raises
    ------
    DensityError
        If the cell does not exist at this density or its wall has fewer than three voxels.
    ResourceError
        If the block has more than `MOST_VOXELS` voxels along an edge.
    SolverError
        If a solve does not converge or the result is not positive definite.

    References
    ----------
    S. Hazanov, C. Huet, J. Mech. Phys. Solids 42 (1994) 1995; D. H. Pahr, P. K. Zysset, Biomech.
    Model. Mechanobiol. 7 (2008) 463; A. P. Raymont, thesis, University of Exeter 2011, chapter 7.
    """
    n = resolution or _resolution(cell, rho)
    require_resolved(cell, rho, n)
    if cells * n > MOST_VOXELS:
        raise ResourceError(
            f"{cells} cells of {n} voxels are {cells * n} voxels along the block, at most "
            f"{MOST_VOXELS} are taken; use fewer cells or a coarser resolution"
        )
    fill = cell_fill(cell, rho, n)
    void = VOID_STIFFNESS if boundary == "traction" else 0.0
    fill = filled_void(fill, void)
    periodic = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=_RTOL).stiffness
    block = np.tile(fill, (cells, cells, cells))
    if boundary == "macro-tet":
        tet = macro_tet(
            block, cells * n * _INSCRIBED, poissons_ratio=poissons_ratio, rtol=_RTOL_FORCES
        )
        stiffness, solid, residual = tet.stiffness, tet.solid, tet.residual
    else:
        rtol = _RTOL_FORCES if boundary == "mixed" else _RTOL
        solved = solve_block(block, boundary, poissons_ratio=poissons_ratio, rtol=rtol)
        stiffness, residual = solved.stiffness, float(solved.residual.max())
        solid = rho
    if not np.linalg.eigvalsh(stiffness)[0] > 0:
        raise SolverError(
            f"the apparent stiffness of cell '{cell.name}' is not positive definite under "
            f"boundary '{boundary}'; take more cells or more voxels"
        )
    return ApparentStiffness(
        boundary=boundary,
        cells=cells,
        resolution=n,
        void=void,
        stiffness=stiffness,
        periodic=periodic,
        solid=solid,
        residual=residual,
    )


def _resolution(cell: Cell, rho: float) -> int:
    """Pick the first resolution whose voxels resolve the wall; the last where none does."""
    for n in RESOLUTIONS:
        if voxels_in_wall(cell, rho, n) >= LEAST_VOXELS:
            return n
    return RESOLUTIONS[-1]

"""Apparent stiffness of a finite block of voxels under uniform boundary conditions.

- ``displacement`` (KUBC): the boundary follows a uniform strain; an upper estimate.
- ``traction`` (SUBC): the boundary carries a uniform stress; a lower estimate. The void must have
  some stiffness, because a boundary that cuts void cannot carry traction there.
- ``mixed``: the boundary follows the strain in some components and is free of traction in the
  others, chosen so that a cell with mirror planes at its faces behaves as the periodic one does.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradedesign import SolverError
from gradedesign.fields import BoolArray, FloatArray, IntArray
from gradedesign.properties import (
    locked,
    solid_stiffness,
    uniform_stress_load,
    unit_load,
)
from gradedesign_laboratory.constrained import Block, padded_block, solve_held

log = logging.getLogger(__name__)

_Condition = Literal["displacement", "traction", "mixed"]

#: Stiffness given to void where the boundary carries a traction, over the base material's. Chosen,
#: not measured.
VOID_STIFFNESS = 1e-3
#: Components held on the faces x, y, z in each case of the mixed conditions. Under normal strain:
#: the normal ones. Under shear in a plane: on the faces across it the tangential ones, as the
#: displacement of a mirrored cell is odd there, and on the faces along it the normal one.
_HELD = (
    ((0,), (1,), (2,)),
    ((0,), (1,), (2,)),
    ((0,), (1,), (2,)),
    ((0,), (0, 2), (0, 1)),
    ((1, 2), (1,), (0, 1)),
    ((1, 2), (0, 2), (2,)),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockSolution:
    """Apparent stiffness of a block.

    Attributes
    ----------
    stiffness : (6, 6) array
        Over the base material's Young's modulus, Voigt order with engineering shear.
    iterations : (6,) array
    residual : (6,) array
    """

    stiffness: FloatArray
    iterations: IntArray
    residual: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", locked(self.stiffness, (6, 6), name="stiffness"))


def filled_void(fill: FloatArray, stiffness: float = VOID_STIFFNESS) -> FloatArray:
    """Give every voxel at least a stiffness, over the base material's."""
    return np.maximum(fill, stiffness)


def solve_block(
    fill: FloatArray,
    condition: _Condition,
    *,
    poissons_ratio: float = 0.3,
    rtol: float = 1e-5,
) -> BlockSolution:
    """Apparent stiffness of a block of voxels.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        Young's modulus of each cubic voxel relative to the base material, 0 to 1.
    condition : {"displacement", "traction", "mixed"}
    rtol : float
        Of the residual force. Stiffnesses are right to its square, of mixed conditions to itself.

    Raises
    ------
    SolverError
        If tractions are asked for on a block with void, or the iteration does not converge.

    References
    ----------
    S. Hazanov, C. Huet, J. Mech. Phys. Solids 42 (1994) 1995, for the order of the three; D. H.
    Pahr, P. K. Zysset, Biomech. Model. Mechanobiol. 7 (2008) 463, for the mixed conditions.
    """
    if condition == "traction" and not (np.asarray(fill) > 0).all():
        raise SolverError(
            "uniform tractions need some stiffness in every voxel, as a boundary that cuts void "
            f"carries none; fill the void, for instance with {VOID_STIFFNESS:g} by filled_void"
        )
    block = padded_block(fill, poissons_ratio)
    displacement = np.zeros((6, 3, *block.operator.fill.shape))
    iterations, residual = np.zeros(6, dtype=np.int64), np.zeros(6)
    loads = [_load(block, condition, case) for case in range(6)]
    for case in range(6):
        free = _free(block, condition, case)
        displacement[case], iterations[case], residual[case] = solve_held(
            block, loads[case], free, rtol=rtol
        )
    stiffness = _stiffness(block, condition, displacement, loads)
    log.info("block %s, %s: %s iterations", block.shape, condition, iterations)
    return BlockSolution(stiffness=stiffness, iterations=iterations, residual=residual)


def _load(block: Block, condition: _Condition, case: int) -> FloatArray:
    """Nodal forces of a case, out of balance for a uniform strain or stress."""
    if condition != "traction":
        return unit_load(block.operator, case)
    whole = np.zeros_like(block.operator.fill)
    whole[: block.shape[0], : block.shape[1], : block.shape[2]] = 1.0
    # Minus: what the boundary's traction does, not what balances it.
    return -uniform_stress_load(whole, np.eye(6)[case])


def _free(block: Block, condition: _Condition, case: int) -> BoolArray:
    """Components of the nodes that are not held in a case."""
    free = np.ones((3, *block.operator.fill.shape), dtype=bool)
    if condition == "traction":
        return free
    for axis, count in enumerate(block.shape):
        components = (0, 1, 2) if condition == "displacement" else _HELD[case][axis]
        for place in (0, count):
            face: list[slice | int] = [slice(None)] * 3
            face[axis] = place
            for component in components:
                free[(component, *face)] = False
    return free


def _stiffness(
    block: Block, condition: _Condition, displacement: FloatArray, loads: list[FloatArray]
) -> FloatArray:
    """Apparent stiffness from energies, of mixed conditions from mean stresses.

    The states of mixed conditions are held differently, so their mutual energies mean nothing.
    """
    operator = block.operator
    y = np.zeros_like(displacement[0])
    product, linear = np.zeros((6, 6)), np.zeros((6, 6))
    for b in range(6):
        operator.product(displacement[b], y)
        for a in range(6):
            product[a, b] = np.vdot(displacement[a], y) / block.volume
            linear[a, b] = np.vdot(loads[a], displacement[b]) / block.volume
    if condition == "traction":
        compliance = -linear - linear.T - product
        return np.asarray(np.linalg.inv(0.5 * (compliance + compliance.T)))
    fill = operator.fill.sum() / block.volume
    stiffness = fill * solid_stiffness(operator.poissons_ratio)
    if condition == "mixed":
        stiffness = stiffness + linear
    else:
        stiffness = stiffness + product + linear + linear.T
    return np.asarray(0.5 * (stiffness + stiffness.T))

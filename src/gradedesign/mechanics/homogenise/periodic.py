"""Periodic homogenisation of a voxel grid: six unit strains, conjugate gradients."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray, lock
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise._gradient_kernels import (
    PIECES,
    advance,
    dot,
    scaled_dot,
    summed,
    turn,
)
from gradedesign.mechanics.homogenise.constants import solid_stiffness
from gradedesign.mechanics.homogenise.islands import connected_fill
from gradedesign.mechanics.homogenise.operator import (
    GridOperator,
    VoxelOperator,
    homogeneous_inverse,
    node_scale,
    precondition,
    threads_for,
    voxel_operator,
)

log = logging.getLogger(__name__)

#: Conjugate gradient iterations after which a solve is given up. Ends a solve that would not
#: converge. Chosen, not measured.
_MOST_ITERATIONS = 1000
#: Voigt order.
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
#: Cells that this permutation of the axes leaves unchanged need fewer solutions.
_CYCLE = (1, 2, 0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeriodicSolution:
    """Response of a periodic cell to six unit macroscopic strains."""

    #: ``(6, 6)``. Relative to the base material's Young's modulus, Voigt order xx, yy, zz, yz, xz,
    #: xy with engineering shear.
    stiffness: FloatArray
    #: ``(6, 3, nx, ny, nz)``. Periodic part of the nodal displacement in each case, in voxel edges.
    displacement: FloatArray
    fill: FloatArray  #: ``(nx, ny, nz)``. The analysed grid, without the islands.
    poissons_ratio: float
    #: ``(6,)``. Zero for a case that follows from another by the symmetry of the grid.
    iterations: IntArray
    residual: FloatArray  #: ``(6,)``. Norm of the remaining force over that of the load.

    def __post_init__(self) -> None:
        lock(self, stiffness=(6, 6))


def solve_periodic(
    fill: FloatArray,
    *,
    poissons_ratio: float = 0.3,
    rtol: float = 1e-6,
    use_symmetry: bool = True,
) -> PeriodicSolution:
    """Homogenise one period of a grid of voxels, void without any stiffness.

    Raises `LatticeError` if the solid does not connect the cell to its neighbours in three
    directions, or more than a thousandth of it is disconnected, and `SolverError` if the iteration
    does not converge, or the request is impossible.

    ``fill (nx, ny, nz)``: Young's modulus of each cubic voxel relative to the base material, 0 to
    1. ``rtol``: norm of the residual force over that of the load. ``use_symmetry``: solve two cases
    instead of six where the grid is equal to itself with x, y, z exchanged in a cycle, voxel by
    voxel.

    Examples
    --------
    >>> solution = solve_periodic(np.ones((4, 4, 4)), poissons_ratio=0.25)
    >>> solution.stiffness[0, :2].round(3).tolist()
    [1.2, 0.4]

    References
    ----------
    Trilinear hexahedra preconditioned by the transform of the homogeneous operator: Schneider,
    Merkert, Kabel, Int. J. Numer. Meth. Engng 109 (2017) 1461; Leuschner, Fritzen, Comput. Mech.
    62 (2018) 359.
    """
    connected, _ = connected_fill(fill)
    with threads_for(connected.size):
        return _solve(connected, poissons_ratio, rtol, use_symmetry)


def _solve(
    connected: FloatArray, poissons_ratio: float, rtol: float, use_symmetry: bool
) -> PeriodicSolution:
    """Solve for a grid that hangs together."""
    operator = voxel_operator(connected, poissons_ratio)
    inverse = homogeneous_inverse(connected.shape, poissons_ratio)
    cyclic = use_symmetry and _is_cyclic(connected)
    displacement = np.zeros((6, 3, *connected.shape))
    iterations, residual = np.zeros(6, dtype=np.int64), np.zeros(6)
    for case in (0, 3) if cyclic else range(6):
        load = unit_load(operator, case)
        iterations[case], residual[case] = conjugate_gradients(
            operator, inverse, load, displacement[case], rtol, _MOST_ITERATIONS, case
        )
    if cyclic:
        for case in (1, 2, 4, 5):
            displacement[case] = _cycled(displacement[case - 1])
            residual[case] = residual[case - 1]
    stiffness = _energies(operator, displacement, 3 if cyclic else 6)
    log.info(
        "homogenised %s voxels, %.4f solid: %s iterations",
        connected.shape,
        connected.mean(),
        iterations,
    )
    return PeriodicSolution(
        stiffness=stiffness,
        displacement=displacement,
        fill=operator.fill,
        poissons_ratio=poissons_ratio,
        iterations=iterations,
        residual=residual,
    )


def unit_load(operator: VoxelOperator, case: int) -> FloatArray:
    """Nodal forces ``(3, nx, ny, nz)`` by which a homogeneous unit strain is out of balance.

    Examples
    --------
    >>> from gradedesign.mechanics.homogenise.operator import voxel_operator
    >>> operator = voxel_operator(np.ones((4, 4, 4)), 0.3)
    >>> bool(np.abs(unit_load(operator, 0)).max() < 1e-6)  # a full grid is in balance
    True
    """
    stress = solid_stiffness(operator.poissons_ratio) @ np.eye(6)[case]
    return uniform_stress_load(operator.fill, stress)


def uniform_stress_load(fill: FloatArray, stress: FloatArray) -> FloatArray:
    """Nodal forces of voxels that each carry the same stress, times their fill.

    The corner forces of a voxel are the stress times the outward corner normal over 4; summed over
    the voxels around a node that is a difference of fills. Returns ``(3, nx, ny, nz)``.

    ``fill (nx, ny, nz)``. ``stress (6,)``.

    Examples
    --------
    >>> pull = np.array([1.0, 0, 0, 0, 0, 0])
    >>> float(np.abs(uniform_stress_load(np.ones((2, 2, 2)), pull)).max())  # in balance
    0.0
    """
    tensor = np.zeros((3, 3))
    for k, (i, j) in enumerate(PAIRS):
        tensor[i, j] = tensor[j, i] = stress[k]
    force = np.zeros((3, *fill.shape))
    for d in range(3):
        normal = 0.25 * fill
        for axis in range(3):
            moved = np.roll(normal, 1, axis)
            # Corner 0 of the voxel itself, corner 1 of its neighbour below.
            normal = moved - normal if axis == d else moved + normal
        force += tensor[:, d, None, None, None] * normal
    return force


def _is_cyclic(fill: FloatArray) -> bool:
    """Whether the grid is unchanged when x, y, z take each other's place in a cycle."""
    return len(set(fill.shape)) == 1 and np.array_equal(fill, fill.transpose(_CYCLE))


def _cycled(u: FloatArray) -> FloatArray:
    """Displacement after turning the cell about its diagonal, x to y, y to z, z to x."""
    return u[[2, 0, 1]].transpose(0, 3, 1, 2)


def conjugate_gradients(
    operator: GridOperator,
    inverse: NDArray[np.float32],
    load: FloatArray,
    x: FloatArray,
    rtol: float,
    max_iterations: int,
    case: int,
    phase: NDArray[np.complex64] | None = None,
) -> tuple[int, float]:
    """Solve ``K x = -load`` from ``x = 0``, in place; returns iterations and relative residual.

    ``phase`` goes with the inverse, see `precondition`.
    """
    scale = node_scale(operator.fill).ravel()
    r = (-load).reshape(3, -1)
    size = np.sqrt(summed(dot, r.ravel(), r.ravel()))
    if size <= 1e-12 * np.sqrt(load.size):
        return 0, 0.0
    rough = (r * scale).astype(np.float32)
    p, y = np.zeros(load.shape), np.zeros(load.shape)
    before = np.inf
    for iteration in range(1, max_iterations + 1):
        z = precondition(rough.reshape(load.shape), inverse, phase).reshape(3, -1)
        now = summed(scaled_dot, r, z, scale)
        in_ranges(turn, range(PIECES), p.reshape(3, -1), z, scale, now / before)
        before = now
        operator.product(p, y)
        curvature = summed(dot, p.ravel(), y.ravel())
        if not (np.isfinite(curvature) and curvature > 0):
            raise SolverError(
                f"the stiffness of the voxels is not positive in load case {case} "
                f"(energy {curvature:g}); this should not happen for a fill between 0 and 1"
            )
        square = summed(
            advance,
            x.reshape(3, -1),
            r,
            p.reshape(3, -1),
            y.reshape(3, -1),
            before / curvature,
            scale,
            rough,
        )
        reached = float(np.sqrt(square) / size)
        if reached < rtol:
            return iteration, reached
        done = np.clip(np.log(max(reached, rtol)) / np.log(rtol), 0.0, 1.0)
        report_step(f"load case {case + 1}", float(done))
    raise SolverError(
        f"homogenisation stopped after {max_iterations} iterations at a residual of {reached:.2e} "
        f"in load case {case}, expected {rtol:g}; the cell may hang together by edges or corners "
        f"of voxels only: take more voxels or a higher density"
    )


def _energies(operator: VoxelOperator, displacement: FloatArray, rows: int) -> FloatArray:
    """Stiffness from the mutual energies of the six states.

    The energy is stationary, so its error is the square of the residual's.
    """
    volume = operator.fill.size
    fill = operator.fill.sum() / volume
    stiffness = fill * solid_stiffness(operator.poissons_ratio)
    y = np.zeros_like(displacement[0])
    product = np.zeros((6, 6))
    linear = np.zeros((6, 6))
    cases = range(6) if rows == 6 else (0, 3)
    for b in cases:
        operator.product(displacement[b], y)
        load = unit_load(operator, b)
        for a in range(6):
            product[a, b] = summed(dot, displacement[a].ravel(), y.ravel()) / volume
            linear[a, b] = summed(dot, displacement[a].ravel(), load.ravel()) / volume
    if rows != 6:
        turned = [1, 2, 0, 4, 5, 3]
        for matrix in (product, linear):
            for b in (1, 2, 4, 5):
                matrix[turned, b] = matrix[:, b - 1]
    stiffness = stiffness + product + linear + linear.T
    return 0.5 * (stiffness + stiffness.T)

"""A wall of few cells as a plate: membrane, bending and transverse shear stiffness of its voxels.

The wall lies across z, repeats along x and y, and its faces are free. A homogeneous solid of the
lattice's stiffness tells nothing of where in the cell the material lies; in a wall of one cell it
decides how stiff the wall is in bending.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import LatticeError, SolverError
from gradedesign.mechanics.homogenise.constants import solid_stiffness
from gradedesign.mechanics.homogenise.operator import (
    homogeneous_inverse,
    threads_for,
    voxel_operator,
)
from gradedesign.mechanics.homogenise.periodic import PAIRS, conjugate_gradients

#: Conjugate gradient iterations after which a solve is given up. Ends a solve that would not
#: converge. Chosen, not measured.
_MOST_ITERATIONS = 3000
#: Voigt components in the plane of the wall.
PLANE = (0, 1, 5)
#: Transverse shear: direction in the plane, its curvature among the unit states, Voigt component.
_TRANSVERSE = ((0, 3, 4), (1, 4, 3))
#: Membrane stiffness over that of the solid below which the wall does not hang together. Chosen,
#: not measured.
_APART = 1e-7

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_GAUSS = 0.5 + (2 * _CORNERS - 1) / np.sqrt(12)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WallStiffness:
    """Stiffness per width, over the Young's modulus of the base material, lengths in voxels."""

    #: ``(3, 3)``. Forces by strains xx, yy, xy of the middle plane, engineering shear; no
    #: curvature.
    membrane: FloatArray
    #: ``(3, 3)``. Moments by curvatures, where the middle plane strains as it likes.
    bending: FloatArray
    #: ``(2,)``. Transverse forces along x and y by shear angle: the square of the force over twice
    #: its energy.
    shear: FloatArray


def wall_stiffness(
    fill: FloatArray,
    *,
    middle: float | None = None,
    poissons_ratio: float = 0.3,
    rtol: float = 1e-3,
) -> WallStiffness:
    """Homogenise a wall across z.

    Raises `LatticeError` if the wall does not hang together along x and y, and `SolverError` if a
    solve does not converge.

    ``fill (nx, ny, nz)``: one period along x and y and the whole thickness; 0 to 1. ``middle``:
    height of the middle plane above the first voxel's lower face; ``nz / 2`` by default. ``rtol``:
    of the solves; membrane and bending are right to its square.

    Notes
    -----
    Six periodic states under unit membrane strain and curvature (Caillerie, Math. Meth. Appl. Sci.
    6 (1984) 159). Then the curvature grows linearly along the wall: what the first states leave
    out of balance, one more periodic state takes up, and its stress carries the transverse force
    that the growing moment asks for; its energy gives the shear stiffness (as in the
    bending-gradient theory of Lebee and Sab, Int. J. Solids Struct. 48 (2011) 2878, for one
    direction at a time).
    """
    if np.ndim(fill) != 3 or min(fill.shape) < 2:
        raise SolverError(f"a wall of {np.shape(fill)} voxels is too small; expected 2 or more")
    with threads_for(fill.size):
        return _Wall(fill, middle, poissons_ratio, rtol).stiffness()


class _Wall:
    """Voxels of a wall with void beside it, and the solver of its unit states."""

    def __init__(
        self,
        fill: FloatArray,
        middle: float | None,
        poissons_ratio: float,
        rtol: float,
    ) -> None:
        # Void keeps the faces apart; an even number of layers suits the transform.
        gap = 2 if fill.shape[2] % 2 == 0 else 1
        self.operator = voxel_operator(np.pad(fill, ((0, 0), (0, 0), (0, gap))), poissons_ratio)
        self.shape = self.operator.fill.shape
        self.inverse = homogeneous_inverse(self.shape, poissons_ratio)
        self.rtol = rtol
        self.C = solid_stiffness(poissons_ratio)
        self.B = _strain_matrices()
        # Gauss points are visited in solid voxels only.
        self.solid = np.flatnonzero(self.operator.fill)
        self.fill = self.operator.fill.ravel()[self.solid]
        self.area = fill.shape[0] * fill.shape[1]
        height = 0.5 * fill.shape[2] if middle is None else middle
        centre = np.arange(self.shape[2]) + 0.5 - height
        self.z = np.broadcast_to(centre, self.shape).ravel()[self.solid]

    def stiffness(self) -> WallStiffness:
        """All three stiffnesses."""
        states = [self.solve(self.load(k), k) for k in range(6)]
        abd = self.energies(states)
        A, coupling, D = abd[:3, :3], abd[:3, 3:], abd[3:, 3:]
        solid = self.fill.sum() / self.area * np.diag(self.C)[list(PLANE)]
        apart = np.flatnonzero(~(np.diag(A) > _APART * solid))
        if apart.size:
            raise LatticeError(
                f"the wall does not hang together: it resists no {('xx', 'yy', 'xy')[apart[0]]} "
                f"strain of its middle plane; take a higher density or whole cells across it"
            )
        relaxed = -np.linalg.solve(A, coupling)
        shear = [
            self.transverse(
                states, np.append(relaxed[:, k - 3], np.eye(3)[k - 3]), direction, component
            )
            for direction, k, component in _TRANSVERSE
        ]
        return WallStiffness(membrane=A, bending=D + coupling.T @ relaxed, shear=np.array(shear))

    def strain(self, state: int, point: int) -> FloatArray:
        """Prescribed strain ``(6, n)`` of a unit state at a Gauss point of every voxel."""
        strain = np.zeros((6, self.z.size))
        strain[PLANE[state % 3]] = 1.0 if state < 3 else self.z + _GAUSS[point, 2] - 0.5
        return strain

    def load(self, state: int) -> FloatArray:
        """Nodal forces by which a unit state is out of balance."""
        forces = [self.B[g].T @ (self.C @ self.strain(state, g)) for g in range(8)]
        return self.scatter(0.125 * self.fill * sum(forces))

    def energies(self, states: list[FloatArray]) -> FloatArray:
        """Mutual energies ``(6, 6)`` of the unit states, per area."""
        result = np.zeros((6, 6))
        around = [self.gather(u) for u in states]
        for g in range(8):
            strain = [self.strain(k, g) + self.B[g] @ around[k] for k in range(6)]
            for a in range(6):
                stress = 0.125 * self.fill * (self.C @ strain[a])
                for b in range(a, 6):
                    result[a, b] += np.vdot(stress, strain[b])
        return np.asarray((result + np.triu(result, 1).T) / self.area)

    def transverse(
        self,
        states: list[FloatArray],
        weights: FloatArray,
        direction: int,
        component: int,
    ) -> float:
        """Shear stiffness along a direction, from a curvature that grows by 1 per voxel."""
        chi = self.gather(sum(w * u for w, u in zip(weights, states, strict=True)))
        along = np.repeat(_CORNERS[:, direction], 3)[:, None].astype(float)
        load = np.zeros_like(chi)
        for g in range(8):
            macro = sum(w * self.strain(k, g) for k, w in enumerate(weights))
            at = _GAUSS[g, direction]
            grown = self.B[g].T @ (self.C @ (at * macro + self.B[g] @ (along * chi)))
            # Of a node's forces, those with the node's own coordinate balance.
            own = along * (self.B[g].T @ (self.C @ (macro + self.B[g] @ chi)))
            load += 0.125 * self.fill * (grown - own)
        more = self.gather(self.solve(self.balanced(self.scatter(load)), 6 + direction))
        force = energy = 0.0
        for g in range(8):
            strain = self.B[g] @ ((along - _GAUSS[g, direction]) * chi + more)
            stress = 0.125 * self.fill * (self.C @ strain)
            force += stress[component].sum()
            energy += np.vdot(stress, strain)
        return float(force**2 / (self.area * energy))

    def balanced(self, load: FloatArray) -> FloatArray:
        """Load without its resultant, which stems from the residual of the unit states.

        Nothing holds a periodic wall against a resultant force; iterations would pile up a
        translation instead of coming to an end.
        """
        volume = self.scatter(np.tile(self.fill, (24, 1)) / 8)[:1]
        resultant = load.sum(axis=(1, 2, 3))
        return np.asarray(load - resultant[:, None, None, None] * volume / volume.sum())

    def solve(self, load: FloatArray, case: int) -> FloatArray:
        """Periodic displacement that balances a load."""
        u = np.zeros_like(load)
        conjugate_gradients(self.operator, self.inverse, load, u, self.rtol, _MOST_ITERATIONS, case)
        return u

    def gather(self, u: FloatArray) -> FloatArray:
        """Corner displacements ``(24, n)`` of the solid voxels."""
        rolled = [np.roll(u, tuple(-c), (1, 2, 3)).reshape(3, -1)[:, self.solid] for c in _CORNERS]
        return np.concatenate(rolled)

    def scatter(self, force: FloatArray) -> FloatArray:
        """Sum corner forces ``(24, n)`` at the nodes."""
        total = np.zeros((3, *self.shape))
        part = np.zeros((3, total[0].size))
        for n, corner in enumerate(_CORNERS):
            part[:, self.solid] = force[3 * n : 3 * n + 3]
            total += np.roll(part.reshape(total.shape), tuple(corner), (1, 2, 3))
        return total


def _strain_matrices() -> FloatArray:
    """Strain by corner displacements at the Gauss points of a voxel of edge 1, ``(8, 6, 24)``."""
    matrices = np.zeros((8, 6, 24))
    for g, point in enumerate(_GAUSS):
        for n, corner in enumerate(_CORNERS):
            value = np.where(corner == 1, point, 1 - point)
            slope = [(2 * corner[d] - 1) * np.prod(np.delete(value, d)) for d in range(3)]
            for row, (i, j) in enumerate(PAIRS):
                matrices[g, row, 3 * n + i] += slope[j]
                if i != j:
                    matrices[g, row, 3 * n + j] += slope[i]
    return matrices

"""The interface of linear solvers: a stiffness with its supports, and several right-hand sides.

Solvers are records of the registry, so that this module and theirs load nothing compiled before
they solve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from gradedesign.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.sparse import bsr_matrix, spmatrix

    from gradedesign.mechanics.fe.space import TetSpace
    from gradedesign.mechanics.fe.stiffness import Stiffness


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearSystem:
    """A stiffness with one set of supports.

    Degree of freedom ``3 * node + component`` is the order of rows and columns.

    Attributes
    ----------
    matrix : (3 N, 3 N) bsr_matrix, N/mm
        With 3 by 3 blocks, without supports: rows of fixed degrees of freedom are as the others.
    fixed : (3, N) bool array
        Components whose displacement is prescribed.
    space : TetSpace
        Nodes and elements.
    stiffness : Stiffness
        What the matrix was assembled from.
    """

    matrix: bsr_matrix
    fixed: BoolArray
    space: TetSpace
    stiffness: Stiffness

    @property
    def free(self) -> BoolArray:
        """Degrees of freedom to solve for, ``(3 N,)``."""
        return ~self.fixed.T.ravel()

    @property
    def near_null_space(self) -> FloatArray:
        """Rigid motions, which deform nothing, ``(3 N, 6)``; not zero at supports."""
        from gradedesign.mechanics.solver.rigid_modes import rigid_body_modes

        return rigid_body_modes(self.space.nodes).reshape(-1, 6)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearAnswer:
    """Displacements for k right-hand sides; residual and balance are checked by the caller.

    Attributes
    ----------
    x : (k, 3 N) array, mm
        Zero where fixed.
    iterations : (k,) int array or None
        None for a solver that does not iterate.
    method : str
        Name of the method, where the solver's name does not determine it.
    """

    x: FloatArray
    iterations: IntArray | None = None
    method: str = ""


#: ``solve(right, start, rtol)``: right-hand sides (k, 3 N) in N, zero where fixed; a first guess
#: (k, 3 N) in mm; the residual over the right-hand side to reach.
Solve: TypeAlias = Callable[[FloatArray, FloatArray, float], LinearAnswer]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearSolver:
    """A linear solver that ``[run] solver`` can name.

    Attributes
    ----------
    name : str
        Lower case with dashes.
    prepare : callable
        ``prepare(system)`` does the work that later right-hand sides share, such as a
        factorisation, and returns ``solve(right, start, rtol)``, which returns a `LinearAnswer`.
    assemble : callable, optional
        ``assemble(space, stiffness)`` returns the matrix of a `LinearSystem`, for a solver with a
        discretisation of its own.
    most_unknowns : int, optional
        Larger systems are refused before anything is assembled.
    other : LinearSolver, optional
        Solves the load cases in which this solver does not reach the residual, and systems with
        fewer free unknowns than `least_unknowns`.
    """

    name: str
    prepare: Callable[[LinearSystem], Solve]
    assemble: Callable[[TetSpace, Stiffness], spmatrix] | None = None
    most_unknowns: int | None = None
    other: LinearSolver | None = None
    least_unknowns: int = 0

    def refusal(self, unknowns: int) -> str:
        """Say why the solver does not take that many unknowns; empty if it does."""
        if self.most_unknowns is None or unknowns <= self.most_unknowns:
            return ""
        return (
            f"solver '{self.name}' takes at most {self.most_unknowns} unknowns, but this "
            f"analysis has {unknowns}; take another [run] solver or a coarser mesh, or end "
            f"before this analysis with [run] stop_after"
        )

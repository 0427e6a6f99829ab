"""Load vector with its supports, and the checked solution of the linear system."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign.arrays import FloatArray, lock
from gradedesign.mechanics.fe.supports import Supports


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadVector:
    """Supports and nodal forces of one load case."""

    name: str
    supports: Supports
    force: FloatArray  #: ``(3, n)``, N. Consistent nodal forces, thermal ones included.

    def __post_init__(self) -> None:
        shape = self.supports.fixed.shape
        lock(self, force=shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class Balance:
    """Residuals of a solution from equilibrium; all are shares, at most 1e-6."""

    force: float  #: Sum of loads and reactions over the sum of their sizes.
    moment: float  #: Their moment over that sum times the diagonal of the mesh.
    energy: float  #: Strain energy against the work of loads and reactions.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """Displacements of one load case, with the evidence that they solve it."""

    name: str
    displacement: FloatArray  #: ``(3, n)``, mm.
    reaction: FloatArray  #: ``(3, n)``, N. Force of the supports on the body; 0 where free.
    energy: float  #: Strain energy ``u^T K u / 2``, N mm.
    #: Norm of the unbalanced forces on free components over that of the right-hand side.
    residual: float
    iterations: int  #: Of conjugate gradients; 0 for a direct solver alone.
    method: str  #: Solver that gave the displacement.
    balance: Balance

    def __post_init__(self) -> None:
        shape = self.displacement.shape
        lock(self, displacement=(3, None), reaction=shape)

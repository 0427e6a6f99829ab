"""Elasticity by PETSc on MPI ranks, for gradedesign."""

from collections.abc import Iterable

from gradedesign import LinearSolver, hookimpl
from gradedesign_petsc.petsc_solver import PETSC_GAMG


@hookimpl
def gradedesign_solvers() -> Iterable[LinearSolver]:
    """Register the solver."""
    yield PETSC_GAMG

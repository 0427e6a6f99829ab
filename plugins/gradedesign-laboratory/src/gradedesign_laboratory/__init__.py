"""Laboratory of cells for gradedesign: properties, finite blocks, tables, plots, coupons."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from gradedesign import Command, hookimpl
from gradedesign_laboratory.command import coupon, homogenise, tabulate

if TYPE_CHECKING:
    from gradedesign import EigenSolver

__all__ = ["gradedesign_commands", "gradedesign_eigen_solvers"]


@hookimpl
def gradedesign_commands() -> Iterator[Command]:
    """Register ``coupon``, ``homogenise`` and ``tabulate``."""
    yield Command(name="coupon", call=coupon)
    yield Command(name="homogenise", call=homogenise)
    yield Command(name="tabulate", call=tabulate)


@hookimpl
def gradedesign_eigen_solvers() -> Iterator[EigenSolver]:
    """Register the eigenvalue solvers of ``homogenise --buckling``."""
    # The command line imports this package for its help, which needs none of their libraries.
    from gradedesign_laboratory.lanczos import LANCZOS
    from gradedesign_laboratory.scipy_eigen import SCIPY

    yield LANCZOS
    yield SCIPY

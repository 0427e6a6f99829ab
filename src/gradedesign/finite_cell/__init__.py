"""Elasticity on a plain grid that any implicit field cuts: quadratic finite cells.

Examples
--------
A solid, its regions and load cases make a `Problem`; two spacings give a value with a band::

    from gradedesign.finite_cell import analyse, displacement_on, extrapolated

    coarse, fine = analyse(problem, 2.0), analyse(problem, 1.0)
    tip = extrapolated(
        *((r.spacing, displacement_on(r, "tip", "bending", None)) for r in (coarse, fine))
    )
    print(tip.value, tip.unfavourable)
"""

from gradedesign.finite_cell.analysis import Accuracy, analyse
from gradedesign.finite_cell.extrapolation import Estimate, extrapolated
from gradedesign.finite_cell.grid import Plane
from gradedesign.finite_cell.problem import Problem
from gradedesign.finite_cell.result import (
    FiniteCellResult,
    StressSample,
    displacement_at,
    displacement_on,
    stress_sample,
)

__all__ = [
    "Accuracy",
    "Estimate",
    "FiniteCellResult",
    "Plane",
    "Problem",
    "StressSample",
    "analyse",
    "displacement_at",
    "displacement_on",
    "extrapolated",
    "stress_sample",
]

"""Elasticity on a plain grid that any implicit field cuts: quadratic finite cells.

Examples
--------
A solid, its regions and load cases make a `Problem`; two spacings give a value with a band::

    from gradedesign.mechanics.finite_cell import analyse, displacement_on
    from gradedesign.mechanics.limits.banded import banded
    from gradedesign.mechanics.explicit.finite_cells import ORDERS

    found = [analyse(problem, spacing) for spacing in (2.0, 1.0)]
    tip = banded([(r.spacing, displacement_on(r, "tip", "bending", None)) for r in found], ORDERS)
    print(tip.value, tip.low, tip.high)
"""

from gradedesign.mechanics.finite_cell.analysis import analyse
from gradedesign.mechanics.finite_cell.grid import Plane
from gradedesign.mechanics.finite_cell.load_cases import Accuracy
from gradedesign.mechanics.finite_cell.problem import Problem
from gradedesign.mechanics.finite_cell.result import (
    FiniteCellResult,
    StressSample,
    displacement_at,
    displacement_on,
    stress_sample,
)

__all__ = [
    "Accuracy",
    "FiniteCellResult",
    "Plane",
    "Problem",
    "StressSample",
    "analyse",
    "displacement_at",
    "displacement_on",
    "stress_sample",
]

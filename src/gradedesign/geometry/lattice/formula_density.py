"""Density from a formula in x, y, z and the depth below the surface."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import Formula, evaluate_formula
from gradedesign.geometry.lattice.density_source import DensitySource


def formula_field(formula: Formula, distance: Field) -> DensitySource:
    """Value of a formula at points.

    Parameters
    ----------
    formula : Formula
        In x, y, z and d, mm.
    distance : callable
        Signed distance of the part; d is the depth below its surface, 0 outside. Evaluated only if
        the formula contains d.

    Returns
    -------
    callable
        Points ``(3, ...)`` mm to values ``(...)``.

    Examples
    --------
    >>> from gradedesign.common.values.formula import parse_formula
    >>> ball = lambda p: np.linalg.norm(p, axis=0) - 10.0
    >>> density = formula_field(parse_formula("0.5 - 0.03 * d"), ball)
    >>> density(np.array([[0.0], [0.0], [0.0]])).round(12)
    array([0.2])
    """

    def value(points: FloatArray) -> FloatArray:
        points = np.asarray(points, dtype=np.float64)
        values = dict(zip("xyz", points, strict=True))
        if "d" in formula.variables:
            values["d"] = np.maximum(-distance(points), 0.0)
        return evaluate_formula(formula, values)

    return value

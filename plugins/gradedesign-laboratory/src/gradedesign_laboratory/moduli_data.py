"""Plain data of a stiffness: its convention, entries, moduli, directions and averages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign.properties import (
    engineering_constants,
    isotropic_averages,
    youngs_along,
    zener_ratio,
)
from gradedesign_laboratory.directional import youngs_extremes

#: Components of stress in the order of the stiffness.
VOIGT = ("xx", "yy", "zz", "yz", "xz", "xy")


def cell_header(
    family: CellFamily,
    parameters: Mapping[str, float],
    density: float,
    poissons_ratio: float,
    resolution: int,
) -> dict[str, Any]:
    """Plain data that name the homogenised cell and the convention of its stiffness."""
    return {
        "cell": family.name,
        "parameters": {**family.parameters, **parameters},
        "density": density,
        "poissons_ratio": poissons_ratio,
        "resolution": resolution,
        "symmetry": family.symmetry,
        "relative_to": "Young's modulus of the base material",
        "voigt_order": list(VOIGT),
        "shear": "engineering",
    }


def moduli_data(c: FloatArray) -> dict[str, Any]:
    """Plain data that follow from a stiffness ``(6, 6)``: moduli, directions, averages."""
    constants, means = engineering_constants(c), isotropic_averages(c)
    least, softest, greatest, stiffest = youngs_extremes(c)
    diagonals = youngs_along(c, np.array([[1.0, 1, 1], [0, 1, 1], [0, 0, 1]]))
    return {
        "engineering": {
            "E": dict(zip("xyz", map(digits, constants.youngs), strict=True)),
            "G": dict(zip(("yz", "xz", "xy"), map(digits, constants.shear), strict=True)),
            "nu": dict(zip(("yz", "xz", "xy"), map(digits, constants.poisson), strict=True)),
        },
        "youngs": {
            "100": digits(float(diagonals[0])),
            "110": digits(float(diagonals[1])),
            "111": digits(float(diagonals[2])),
            "least": digits(least),
            "least_along": _direction(softest),
            "greatest": digits(greatest),
            "greatest_along": _direction(stiffest),
        },
        "averages": {
            "bulk": _averages(means.bulk_voigt, means.bulk_reuss),
            "shear": _averages(means.shear_voigt, means.shear_reuss),
            "hill_youngs": digits(means.youngs),
            "hill_poisson": digits(means.poisson),
        },
        "zener": digits(zener_ratio(c)),
    }


def _averages(voigt: float, reuss: float) -> dict[str, float]:
    """Voigt's, Reuss' and Hill's average."""
    return {
        "voigt": digits(voigt),
        "reuss": digits(reuss),
        "hill": digits(0.5 * (voigt + reuss)),
    }


def _direction(vector: FloatArray) -> list[float]:
    """Components of a unit vector; of the two opposite ones that with the larger sum."""
    turned = vector if vector.sum() >= 0 else -vector
    return [round(float(v), 3) + 0.0 for v in turned]


def rounded(matrix: FloatArray, figures: int = 7) -> list[list[float]]:
    """Rows of a matrix in significant digits."""
    return [[digits(float(v), figures) for v in row] for row in matrix]


def digits(value: float, figures: int = 7) -> float:
    """Round to significant digits."""
    return float(f"{value:.{figures}g}")

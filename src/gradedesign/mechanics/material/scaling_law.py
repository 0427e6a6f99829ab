"""Scaling laws: effective stiffness and strength of a cell as functions of relative density."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.buckling_law import BucklingLaw
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw

LawKind: TypeAlias = Literal["fe", "experiment", "computed", "fitted", "stated"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScalingLaw:
    """Effective behaviour of one cell family over a window of relative density.

    Attributes
    ----------
    name : str
        Lower case with dashes, unique in the registry.
    families : tuple of str
        Names of the cell families this law describes.
    stiffness : callable
        rho ``(...)`` to the full stiffness ``(6, 6, ...)`` in Voigt order xx, yy, zz, yz, xz, xy
        with engineering shear, relative to the base material's Young's modulus, in the cell's
        axes. It must give the solid material's own stiffness nowhere but at its own formula.
    stiffness_derivative : callable
        d(stiffness)/d(rho), same shapes.
    strength : callable
        rho ``(...)`` to the macroscopic von Mises stress at first yield of the cell, relative
        to the base material's strength, ``(...)``.
    window : (float, float)
        Densities between which the source supports the law.
    kind : {"fe", "experiment", "computed", "fitted", "stated"}
        How it was obtained; the kinds are never mixed. ``fitted``: to a computed law; ``stated``:
        in a case.
    source : str
        Author, year, table or equation.
    test : str
        Load, boundary conditions and specimen behind the numbers.
    coefficients : tuple of (str, float)
        Numbers to print in the report, such as ``("c1", 0.402)``.
    poissons_ratio : float
        The base material's Poisson ratio the law was made for.
    local_stress : LocalStressLaw or None
        Local von Mises stress under any macroscopic stress, where that is known. Sizing then uses
        it in place of ``strength``.
    buckling : BucklingLaw or None
        Macroscopic stress that buckles the cell, where that is known; with a window of its own.
    """

    name: str
    families: tuple[str, ...]
    stiffness: Callable[[FloatArray], FloatArray]
    stiffness_derivative: Callable[[FloatArray], FloatArray]
    strength: Callable[[FloatArray], FloatArray]
    window: tuple[float, float]
    kind: LawKind
    source: str
    test: str
    coefficients: tuple[tuple[str, float], ...] = ()
    poissons_ratio: float = 0.3
    local_stress: LocalStressLaw | None = None
    buckling: BucklingLaw | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LawOrigin:
    """Source of the numbers of a law.

    Attributes
    ----------
    kind : {"fe", "experiment", "computed", "fitted", "stated"}
        How they were obtained; the kinds are never mixed.
    source : str
        Author, year, table or equation.
    test : str
        Load, boundary conditions and specimen behind them.
    poissons_ratio : float
        The base material's Poisson ratio they hold for.
    """

    kind: LawKind
    source: str
    test: str
    poissons_ratio: float = 0.3


def has_strength(law: ScalingLaw) -> bool:
    """Whether a law gives strengths, not stiffness alone."""
    try:
        law.strength(np.asarray(sum(law.window) / 2))
    except DensityError:
        return False
    return True


def isotropic_stiffness(youngs_modulus: FloatArray, poissons_ratio: float) -> FloatArray:
    """Isotropic stiffness ``(6, 6, ...)`` from E ``(...)`` and nu, Voigt with engineering shear."""
    e = np.asarray(youngs_modulus, dtype=np.float64)
    nu = poissons_ratio
    lam = e * nu / ((1 + nu) * (1 - 2 * nu))
    mu = e / (2 * (1 + nu))
    c = np.zeros((6, 6, *e.shape))
    c[:3, :3] = lam
    for i in range(3):
        c[i, i] += 2 * mu
        c[i + 3, i + 3] = mu
    return c


def within_window(name: str, window: tuple[float, float], rho: FloatArray) -> FloatArray:
    """Return densities as float64, refusing any outside the window of law ``name``.

    Raises `DensityError` naming the law, the range found and the window; NaN counts as outside.
    """
    values = np.asarray(rho, dtype=np.float64)
    a, b = window
    inside = (values >= a - 1e-9) & (values <= b + 1e-9)
    if not inside.all():
        bad = values[~inside]
        raise DensityError(
            f"law '{name}' is supported for relative densities {a:g} to {b:g}, but was asked for "
            f"{bad.min():g} to {bad.max():g} at {bad.size} points; narrow [lattice] density or "
            f"name another law"
        )
    return values

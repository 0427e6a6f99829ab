"""Power laws of Gibson and Ashby: stiffness and strength as powers of relative density."""

from __future__ import annotations

from typing import Literal

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.material.scaling_law import ScalingLaw, isotropic_stiffness, within_window


def power_law(
    name: str,
    families: tuple[str, ...],
    c1: float,
    n1: float,
    c3: float | None,
    n3: float | None,
    window: tuple[float, float],
    *,
    kind: Literal["fe", "experiment", "computed"],
    source: str,
    test: str,
    c2: float | None = None,
    n2: float | None = None,
    poissons_ratio: float = 0.3,
) -> ScalingLaw:
    """Law with ``E = c1 rho^n1``, ``G = c2 rho^n2`` and ``strength = c3 rho^n3``.

    Everything is relative to the base material: E **and G to its Young's modulus**, strength to
    its strength. Without ``c2`` and ``n2`` the stiffness is isotropic. The lattice gets the base
    material's Poisson ratio, which published power laws leave open.

    Parameters
    ----------
    name : str
    families : tuple of str
    c1, n1 : float
        Young's modulus along a cell axis.
    c3, n3 : float or None
        Macroscopic stress at first yield; None where the source gives stiffness only, and then
        asking for the strength raises.
    window : (float, float)
        Densities of the source's data.
    kind, source, test
        See `ScalingLaw`.
    c2, n2 : float, optional
        Shear modulus over the base material's *Young's* modulus; makes the stiffness cubic.
    poissons_ratio : float

    Raises
    ------
    ValueError
        If a coefficient is not positive, one of a pair is missing, or the window is empty.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, eqs. 1.2 to 1.4. Its eq. 1.3 divides G by the base
    material's shear modulus, its tables divide by Young's modulus: homogenised values agree with
    the tables.
    """
    coefficients = tuple(
        (key, float(value))
        for key, value in (("c1", c1), ("n1", n1), ("c2", c2), ("n2", n2), ("c3", c3), ("n3", n3))
        if value is not None
    )
    if any(value <= 0 for _, value in coefficients) or not 0 < window[0] < window[1] <= 1:
        raise ValueError(
            f"power law '{name}' has coefficients {dict(coefficients)} and window {window}; "
            f"expected positive coefficients and 0 < window[0] < window[1] <= 1"
        )
    if (c2 is None) != (n2 is None) or (c3 is None) != (n3 is None):
        raise ValueError(f"power law '{name}' lacks one of a pair c2, n2 or c3, n3; give both")

    def strength_terms() -> tuple[float, float]:
        if c3 is None or n3 is None:
            raise DensityError(
                f"law '{name}' has no strength: {source} gives stiffness only; "
                f"name a law with strength in [lattice] law"
            )
        return c3, n3

    def stiffness(rho: FloatArray) -> FloatArray:
        r = within_window(name, window, rho)
        shear = None if c2 is None or n2 is None else c2 * r**n2
        return _stiffness(c1 * r**n1, shear, poissons_ratio)

    def stiffness_derivative(rho: FloatArray) -> FloatArray:
        r = within_window(name, window, rho)
        shear = None if c2 is None or n2 is None else c2 * n2 * r ** (n2 - 1)
        return _stiffness(c1 * n1 * r ** (n1 - 1), shear, poissons_ratio)

    def strength(rho: FloatArray) -> FloatArray:
        c, n = strength_terms()
        return np.asarray(c * within_window(name, window, rho) ** n)

    return ScalingLaw(
        name=name,
        families=families,
        stiffness=stiffness,
        stiffness_derivative=stiffness_derivative,
        strength=strength,
        window=window,
        kind=kind,
        source=source,
        test=test,
        coefficients=coefficients,
        poissons_ratio=poissons_ratio,
    )


def _stiffness(youngs: FloatArray, shear: FloatArray | None, nu: float) -> FloatArray:
    """Stiffness linear in E and G at fixed nu, so that it also serves derivatives."""
    c = isotropic_stiffness(youngs, nu)
    if shear is not None:
        for i in range(3, 6):
            c[i, i] = shear
    return c

"""Power laws of Gibson and Ashby: stiffness and strength as powers of relative density."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.scaling_law import (
    LawOrigin,
    ScalingLaw,
    isotropic_stiffness,
    within_window,
)


def power_law(
    name: str,
    families: tuple[str, ...],
    *,
    youngs: tuple[float, float],
    window: tuple[float, float],
    origin: LawOrigin,
    strength: tuple[float, float] | None = None,
    shear: tuple[float, float] | None = None,
) -> ScalingLaw:
    """Law with ``E = c1 rho^n1``, ``G = c2 rho^n2`` and ``strength = c3 rho^n3``.

    Everything is relative to the base material: E **and G to its Young's modulus**, strength to
    its strength. Without ``shear`` the stiffness is isotropic. The lattice gets the base
    material's Poisson ratio, which published power laws leave open.

    Parameters
    ----------
    youngs : (float, float)
        c1 and n1, of Young's modulus along a cell axis.
    window : (float, float)
        Densities of the source's data.
    strength : (float, float), optional
        c3 and n3, of the macroscopic stress at first yield; where the source gives stiffness only,
        asking for the strength raises.
    shear : (float, float), optional
        c2 and n2, of the shear modulus over the base material's *Young's* modulus; makes the
        stiffness cubic.

    Raises
    ------
    ValueError
        If a coefficient is not positive or the window is empty.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, eqs. 1.2 to 1.4. Its eq. 1.3 divides G by the base
    material's shear modulus, its tables divide by Young's modulus: homogenised values agree with
    the tables.

    Examples
    --------
    >>> from gradedesign import LawOrigin, power_law
    >>> origin = LawOrigin(kind="fe", source="Author, year, table 1", test="periodic cell")
    >>> law = power_law(
    ...     "mine-2026", ("my-cell",), youngs=(0.5, 2.0), window=(0.1, 0.5), origin=origin
    ... )
    >>> E = 1 / np.linalg.inv(law.stiffness(np.array(0.4)))[0, 0]
    >>> round(float(E), 6)  # 0.5 * 0.4**2
    0.08
    """
    coefficients = _coefficients(youngs, shear, strength)
    if any(value <= 0 for _, value in coefficients) or not 0 < window[0] < window[1] <= 1:
        raise ValueError(
            f"power law '{name}' has coefficients {dict(coefficients)} and window {window}; "
            f"expected positive coefficients and 0 < window[0] < window[1] <= 1"
        )
    nu = origin.poissons_ratio

    def stiffness(rho: FloatArray) -> FloatArray:
        r = within_window(name, window, rho)
        return _stiffness(_power(r, youngs), None if shear is None else _power(r, shear), nu)

    def stiffness_derivative(rho: FloatArray) -> FloatArray:
        r = within_window(name, window, rho)
        return _stiffness(_slope(r, youngs), None if shear is None else _slope(r, shear), nu)

    def strong(rho: FloatArray) -> FloatArray:
        if strength is None:
            raise DensityError(
                f"law '{name}' has no strength: {origin.source} gives stiffness only; "
                f"name a law with strength in [lattice] law"
            )
        return np.asarray(_power(within_window(name, window, rho), strength))

    return ScalingLaw(
        name=name,
        families=families,
        stiffness=stiffness,
        stiffness_derivative=stiffness_derivative,
        strength=strong,
        window=window,
        coefficients=coefficients,
        **asdict(origin),
    )


def _coefficients(*pairs: tuple[float, float] | None) -> tuple[tuple[str, float], ...]:
    """Factors and exponents of E, G and strength by their names in the literature."""
    return tuple(
        (f"{letter}{number}", float(value))
        for number, pair in enumerate(pairs, start=1)
        for letter, value in zip("cn", pair or (), strict=False)
    )


def _power(r: FloatArray, pair: tuple[float, float]) -> FloatArray:
    c, n = pair
    return c * r**n


def _slope(r: FloatArray, pair: tuple[float, float]) -> FloatArray:
    c, n = pair
    return c * n * r ** (n - 1)


def _stiffness(youngs: FloatArray, shear: FloatArray | None, nu: float) -> FloatArray:
    """Stiffness linear in E and G at fixed nu, so that it also serves derivatives."""
    c = isotropic_stiffness(youngs, nu)
    if shear is not None:
        for i in range(3, 6):
            c[i, i] = shear
    return c

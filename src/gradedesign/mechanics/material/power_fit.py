"""Power laws ``c rho^n`` fitted to a scaling law, with the window that they hold in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin, ScalingLaw

#: Name in a case of the power law that is fitted to the computed law of its cell.
GIBSON_ASHBY = "gibson-ashby"
#: Largest relative residual of a fit; the window is the widest that keeps to it. Chosen, not
#: measured.
MOST_RESIDUAL = 0.1
#: Densities of the law's window, evenly spaced in their logarithm. Chosen, not measured.
_SAMPLES = 41
#: Highest over lowest density of a fit at least, where a case allows fewer. Chosen, not measured.
_LEAST_SPAN = 1.5
#: Of them in a fit at least: two would always fit.
_LEAST_SAMPLES = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerFit:
    """The power law ``c rho^n`` in a window of densities."""

    #: Value over the base material's, and exponent.
    c: float
    n: float
    window: tuple[float, float]  #: Relative densities that were fitted.
    residual: float  #: Largest relative departure of the fit from the law in the window.


def fit_power(density: FloatArray, value: FloatArray) -> PowerFit | None:
    """Power law through the widest run of values that one follows within `MOST_RESIDUAL`.

    ``density (k,)``: ascending. ``value (k,)``: positive.

    Returns
    -------
    PowerFit or None
        Of least squares in the logarithms; None where no five neighbours follow one.

    Examples
    --------
    >>> rho = np.geomspace(0.1, 0.5, 20)
    >>> fit = fit_power(rho, 0.4 * rho**2)
    >>> round(fit.c, 6), round(fit.n, 6), fit.window
    (0.4, 2.0, (0.1, 0.5))
    """
    x, y = np.log(density), np.log(value)
    ends = [
        (first, last)
        for first in range(x.size)
        for last in range(first + _LEAST_SAMPLES, x.size + 1)
    ]
    # The widest first, of equals the sparsest. In even steps equals differ by rounding, which is
    # not the same on every processor.
    for first, last in sorted(ends, key=lambda e: (round(x[e[0]] - x[e[1] - 1], 9), e[0])):
        slope, start = np.polyfit(x[first:last], y[first:last], 1)
        departure = np.expm1(slope * x[first:last] + start - y[first:last])
        residual = float(np.abs(departure).max())
        if residual <= MOST_RESIDUAL:
            return PowerFit(
                c=float(np.exp(start)),
                n=float(slope),
                window=(float(density[first]), float(density[last - 1])),
                residual=residual,
            )
    return None


def power_fits(
    law: ScalingLaw, density: tuple[float, float] | None = None
) -> dict[str, PowerFit | None]:
    """Power laws of Young's modulus, along the softest cell axis, and of strength.

    ``density`` are the lowest and the highest one that they are meant for, the window of the law by
    default.

    Returns
    -------
    dict of str to PowerFit or None
        ``E`` and ``strength``.

    References
    ----------
    L. J. Gibson, M. F. Ashby, Cellular solids, 2nd edition, Cambridge 1997, eqs. 5.6 and 5.27.
    """
    low, high = law.window
    if density is not None:
        low, high = np.clip(density, low, high)
        low = max(law.window[0], min(low, high / _LEAST_SPAN))
        high = min(law.window[1], max(high, low * _LEAST_SPAN))
    rho = np.geomspace(low, high, _SAMPLES)
    # The powers of both ends may round to beyond them.
    rho[0], rho[-1] = low, high
    return {
        "E": fit_power(rho, softest_modulus(law, rho)),
        "strength": fit_power(rho, np.asarray(law.strength(rho))),
    }


def softest_modulus(law: ScalingLaw, density: FloatArray) -> FloatArray:
    """Young's modulus along the softest cell axis over the base material's, ``(...)``."""
    stiffness = np.moveaxis(law.stiffness(density), (0, 1), (-2, -1))
    compliance = np.linalg.inv(stiffness)
    return np.asarray(1.0 / np.diagonal(compliance, axis1=-2, axis2=-1)[..., :3].max(axis=-1))


def gibson_ashby(law: ScalingLaw, density: tuple[float, float] | None = None) -> ScalingLaw:
    """Isotropic power law fitted to a computed law: E of the softest cell axis, and strength.

    It is fitted to the densities that it is meant for, as in `power_fits`: over fewer one power law
    follows a cell more closely, and farther up or down. Its window is that in which both fits hold;
    without a fit of strength it has none. Raises `DensityError` if no power law follows Young's
    modulus, or the windows of both fits are apart.
    """
    fits = power_fits(law, density)
    modulus, strength = fits["E"], fits["strength"]
    if modulus is None:
        raise DensityError(
            f"no power law follows Young's modulus of law '{law.name}' within {MOST_RESIDUAL:.0%}; "
            f'take law = "auto"'
        )
    held = [fit for fit in (modulus, strength) if fit is not None]
    low, high = max(fit.window[0] for fit in held), min(fit.window[1] for fit in held)
    if not low < high:
        raise DensityError(
            f"power laws follow law '{law.name}' at no common density: E from "
            f"{modulus.window[0]:.3g} to {modulus.window[1]:.3g}, strength elsewhere; take "
            f'law = "auto"'
        )
    within = f"E within {modulus.residual:.1%}"
    if strength is not None:
        within += f", strength within {strength.residual:.1%}"
    return power_law(
        GIBSON_ASHBY,
        law.families,
        youngs=(modulus.c, modulus.n),
        strength=None if strength is None else (strength.c, strength.n),
        window=(low, high),
        origin=LawOrigin(
            kind="fitted",
            source=f"fitted to {law.name}, density {low:.3g} to {high:.3g}: {within}; {law.source}",
            test=law.test,
            poissons_ratio=law.poissons_ratio,
        ),
    )

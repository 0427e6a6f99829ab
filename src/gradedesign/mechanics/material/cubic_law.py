"""Laws of cells with cubic symmetry: fits of bulk, Young's and shear modulus, or tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np
from scipy.interpolate import PchipInterpolator

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.scaling_law import LawOrigin, ScalingLaw, within_window

_Curve = Callable[[FloatArray], FloatArray]


def cubic_law(
    name: str,
    families: tuple[str, ...],
    *,
    youngs: tuple[float, float],
    bulk: tuple[float, float],
    shear: tuple[float, float],
    strength: tuple[Sequence[float], Sequence[float]],
    window: tuple[float, float],
    origin: LawOrigin,
) -> ScalingLaw:
    """Cubic law from power fits of three moduli and a table of strengths.

    Parameters
    ----------
    youngs, bulk, shear : (float, float)
        Factor and exponent of E along a cell axis, of the bulk modulus and of C44, each over the
        base material's Young's modulus.
    strength : two sequences of float
        Densities and, for each, the macroscopic stress at first yield over the base material's
        strength. Interpolated monotonically in logarithms.
    window : (float, float)
        Densities of the source's data.

    Raises
    ------
    ValueError
        If the strength table does not cover the window, or the moduli are not positive definite.

    Notes
    -----
    With ``G' = (C11 - C12) / 2``, cubic symmetry gives ``1 / E = 1 / (9 K) + 1 / (3 G')``.

    Examples
    --------
    >>> from gradedesign import LawOrigin, cubic_law
    >>> origin = LawOrigin(kind="fe", source="Author, year, table 1", test="periodic cell")
    >>> law = cubic_law(
    ...     "mine-2026", ("my-cell",), youngs=(0.5, 2.0), bulk=(0.4, 2.0), shear=(0.2, 2.0),
    ...     strength=([0.1, 0.3, 0.5], [0.03, 0.1, 0.2]), window=(0.1, 0.5), origin=origin,
    ... )
    >>> round(float(law.stiffness(np.array(0.5))[3, 3]), 6)  # C44, 0.2 * 0.5**2
    0.05
    """
    (ce, ne), (cb, nb), (cs, ns) = youngs, bulk, shear

    def constants(rho: FloatArray) -> FloatArray:
        e, k = ce * rho**ne, cb * rho**nb
        tetragonal = 1 / (3 * (1 / e - 1 / (9 * k)))
        return np.stack([k + 4 / 3 * tetragonal, k - 2 / 3 * tetragonal, cs * rho**ns])

    def derivatives(rho: FloatArray) -> FloatArray:
        e, k = ce * rho**ne, cb * rho**nb
        de, dk = ne * e / rho, nb * k / rho
        tetragonal = 1 / (3 * (1 / e - 1 / (9 * k)))
        change = 3 * tetragonal**2 * (de / e**2 - dk / (9 * k**2))
        return np.stack([dk + 4 / 3 * change, dk - 2 / 3 * change, cs * ns * rho ** (ns - 1)])

    return _law(
        name,
        families,
        constants,
        derivatives,
        strength,
        window=window,
        origin=origin,
        coefficients=(*(("E", ce), ("nE", ne), ("K", cb), ("nK", nb), ("C44", cs), ("nC44", ns)),),
    )


def cubic_table_law(
    name: str,
    families: tuple[str, ...],
    *,
    density: Sequence[float],
    C11: Sequence[float],
    C12: Sequence[float],
    C44: Sequence[float],
    strength: Sequence[float],
    origin: LawOrigin,
) -> ScalingLaw:
    """Cubic law from a table, interpolated monotonically in logarithms.

    Parameters
    ----------
    density : sequence of float
        Increasing; its ends are the window of the law.
    C11, C12, C44 : sequence of float
        Over the base material's Young's modulus.
    strength : sequence of float
        Macroscopic stress at first yield over the base material's strength.

    Raises
    ------
    ValueError
        If a column is not positive and increasing, or the stiffness is not positive definite.

    Examples
    --------
    >>> from gradedesign import LawOrigin, cubic_table_law
    >>> origin = LawOrigin(kind="fe", source="Author, year, table 1", test="periodic cell")
    >>> law = cubic_table_law(
    ...     "mine-2026", ("my-cell",), density=[0.1, 0.3, 0.5], C11=[0.02, 0.1, 0.3],
    ...     C12=[0.01, 0.05, 0.1], C44=[0.01, 0.04, 0.1], strength=[0.03, 0.1, 0.2], origin=origin,
    ... )
    >>> law.window, round(float(law.strength(np.array(0.3))), 6)
    ((0.1, 0.5), 0.1)
    """
    columns = [_log_curve(name, density, values) for values in (C11, C12, C44)]
    return _law(
        name,
        families,
        lambda rho: np.stack([value(rho) for value, _ in columns]),
        lambda rho: np.stack([slope(rho) for _, slope in columns]),
        (density, strength),
        window=(float(density[0]), float(density[-1])),
        origin=origin,
        coefficients=(),
    )


def _cubic_stiffness(constants: FloatArray) -> FloatArray:
    """Stiffness ``(6, 6, ...)`` from C11, C12, C44 ``(3, ...)``."""
    c11, c12, c44 = constants
    c = np.zeros((6, 6, *c11.shape))
    c[:3, :3] = c12
    for i in range(3):
        c[i, i] = c11
        c[i + 3, i + 3] = c44
    return c


def _law(
    name: str,
    families: tuple[str, ...],
    constants: _Curve,
    derivatives: _Curve,
    strength: tuple[Sequence[float], Sequence[float]],
    *,
    window: tuple[float, float],
    origin: LawOrigin,
    coefficients: tuple[tuple[str, float], ...],
) -> ScalingLaw:
    """Check the curves and put them behind the window."""
    strong, _ = _log_curve(name, *strength)
    if strength[0][0] > window[0] + 1e-9 or strength[0][-1] < window[1] - 1e-9:
        raise ValueError(
            f"law '{name}': strengths are given for densities {strength[0][0]:g} to "
            f"{strength[0][-1]:g}, which do not cover its window {window}"
        )
    c11, c12, c44 = constants(np.linspace(*window, 101))
    if (c44 <= 0).any() or (c11 - c12 <= 0).any() or (c11 + 2 * c12 <= 0).any():
        raise ValueError(f"law '{name}' is not positive definite over its window {window}")
    return ScalingLaw(
        name=name,
        families=families,
        stiffness=lambda rho: _cubic_stiffness(constants(within_window(name, window, rho))),
        stiffness_derivative=lambda rho: _cubic_stiffness(
            derivatives(within_window(name, window, rho))
        ),
        strength=lambda rho: strong(within_window(name, window, rho)),
        window=window,
        coefficients=coefficients,
        **asdict(origin),
    )


def _log_curve(
    name: str, density: Sequence[float], values: Sequence[float]
) -> tuple[_Curve, _Curve]:
    """Monotone curve through points in log-log coordinates, and its derivative."""
    x, y = np.asarray(density, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if x.shape != y.shape or x.size < 2 or (x <= 0).any() or (y <= 0).any():
        raise ValueError(
            f"law '{name}': a table needs two or more positive values for positive densities"
        )
    if (np.diff(x) <= 0).any() or (np.diff(y) <= 0).any():
        raise ValueError(f"law '{name}': densities and values of a table must increase")
    curve = PchipInterpolator(np.log(x), np.log(y))
    slope = curve.derivative()
    lower, upper = x[0], x[-1]

    def value(rho: FloatArray) -> FloatArray:
        # The window admits a rounding error beyond the table's ends, the curve must too.
        return np.asarray(np.exp(curve(np.log(np.clip(rho, lower, upper)))))

    def derivative(rho: FloatArray) -> FloatArray:
        r = np.clip(rho, lower, upper)
        return np.asarray(value(r) * slope(np.log(r)) / r)

    return value, derivative

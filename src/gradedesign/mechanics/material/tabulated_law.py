"""Scaling law from a table of computed properties."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.buckling_law import BucklingLaw
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw
from gradedesign.mechanics.material.property_table import PropertyTable
from gradedesign.mechanics.material.scaling_law import ScalingLaw, within_window
from gradedesign.mechanics.material.stiffness_constants import constant_errors

_Curve = Callable[[FloatArray], FloatArray]

#: Densities at which a law is checked when it is made. Chosen, not measured.
_CHECKS = 201


def tabulated_law(table: PropertyTable) -> ScalingLaw:
    """Law of kind ``computed`` that runs smoothly and monotonically through a table.

    Returns
    -------
    ScalingLaw
        Named ``table.name``; its window is the range of the table.

    Raises
    ------
    ValueError
        If the strength or stiffness of the table does not grow with density.

    Notes
    -----
    Strength is interpolated in logarithms by piecewise cubics that keep monotone data monotone.
    So are, under cubic symmetry, the three distinct eigenvalues ``C11 + 2 C12``, ``C11 - C12`` and
    ``C44`` of the stiffness: its eigenvectors do not depend on density, so it stays positive
    definite and grows in the sense of energies. Otherwise the entries of the matrix logarithm are
    interpolated, which keeps it positive definite; growth is checked at 201 densities. Strength
    surfaces, if the table has them, become the law's ``local_stress``, critical stresses its
    ``buckling``.

    Examples
    --------
    The law of a cell that no table is shipped for::

        law = tabulated_law(compute_table(cell))
    """
    lower, upper = float(table.density[0]), float(table.density[-1])
    name, window = table.name, (lower, upper)
    log_density = np.log(table.density)
    if (np.diff(table.strength) <= 0).any() or table.strength[0] <= 0:
        raise ValueError(
            f"the strengths {table.strength.tolist()} of table '{name}' do not grow with density; "
            f"compute it at a higher resolution"
        )
    strength, _ = _exponential(log_density, np.log(table.strength))
    build = _cubic if table.symmetry == "cubic" else _matrix_logarithm
    stiffness, stiffness_slope = build(table)
    if table.symmetry != "cubic":
        # Monotone eigenvalues with fixed eigenvectors need no check.
        _require_growth(name, np.linspace(lower, upper, _CHECKS), stiffness, stiffness_slope)

    def inside(curve: _Curve) -> _Curve:
        def at(rho: FloatArray) -> FloatArray:
            # The window admits a rounding error beyond the table's ends, the curves must too.
            return curve(np.clip(within_window(name, window, rho), lower, upper))

        return at

    return ScalingLaw(
        name=name,
        families=(table.family,),
        stiffness=inside(stiffness),
        stiffness_derivative=inside(stiffness_slope),
        strength=inside(strength),
        window=window,
        kind="computed",
        source=f"gradedesign {table.version}, {table.date}",
        test=table.method,
        coefficients=(
            ("stiffness_error", float(table.stiffness_error.max())),
            *((f"{n}_error", float(np.nanmax(e))) for n, e in constant_errors(table).items()),
            ("strength_error", float(table.strength_error.max())),
            *_surface_errors(table),
        ),
        poissons_ratio=table.poissons_ratio,
        local_stress=LocalStressLaw(density=table.density, surfaces=table.surfaces)
        if table.surfaces
        else None,
        buckling=None if table.buckling is None else BucklingLaw(table=table.buckling),
    )


def _surface_errors(table: PropertyTable) -> tuple[tuple[str, float], ...]:
    """Largest errors of the strength surfaces, to print; none without surfaces."""
    if not table.surfaces:
        return ()
    return (
        ("surface_error", max(s.max_error for s in table.surfaces)),
        ("surface_unsafe_error", max(s.unsafe_error for s in table.surfaces)),
    )


def _exponential(x: FloatArray, y: FloatArray) -> tuple[_Curve, _Curve]:
    """``exp`` of a monotone curve through (log density, y), and its derivative by density."""

    @cache
    def curves() -> tuple[PchipInterpolator, PchipInterpolator]:
        # At the first use: of a hundred laws that are installed a run uses one.
        curve = PchipInterpolator(x, y)
        return curve, curve.derivative()

    def value(rho: FloatArray) -> FloatArray:
        curve, _ = curves()
        return np.asarray(np.exp(curve(np.log(rho))))

    def derivative(rho: FloatArray) -> FloatArray:
        _, slope = curves()
        return np.asarray(value(rho) * slope(np.log(rho)) / rho)

    return value, derivative


def _cubic(table: PropertyTable) -> tuple[_Curve, _Curve]:
    """Interpolate the eigenvalues of a cubic stiffness."""
    c = table.stiffness
    normal = np.trace(c[:, :3, :3], axis1=1, axis2=2) / 3
    coupling = (c[:, 0, 1] + c[:, 0, 2] + c[:, 1, 2]) / 3
    shear = np.trace(c[:, 3:, 3:], axis1=1, axis2=2) / 3
    values = np.stack([normal + 2 * coupling, normal - coupling, shear])
    if (values <= 0).any() or (np.diff(values, axis=1) <= 0).any():
        raise ValueError(
            f"the stiffness in table '{table.name}' is not positive definite or does not grow with "
            f"density; compute it at a higher resolution"
        )
    curves = [_exponential(np.log(table.density), np.log(v)) for v in values]
    return (
        lambda rho: _cubic_stiffness(*(value(rho) for value, _ in curves)),
        lambda rho: _cubic_stiffness(*(slope(rho) for _, slope in curves)),
    )


def _cubic_stiffness(volume: FloatArray, normal: FloatArray, shear: FloatArray) -> FloatArray:
    """Stiffness ``(6, 6, ...)`` from its eigenvalues; linear, so it serves derivatives too."""
    c = np.zeros((6, 6, *np.shape(volume)))
    c[:3, :3] = (volume - normal) / 3
    for i in range(3):
        c[i, i] += normal
        c[i + 3, i + 3] = shear
    return c


def _matrix_logarithm(table: PropertyTable) -> tuple[_Curve, _Curve]:
    """Interpolate the matrix logarithm of a stiffness of any symmetry."""
    values, vectors = np.linalg.eigh(table.stiffness)
    if (values <= 0).any():
        raise ValueError(f"the stiffness in table '{table.name}' is not positive definite")
    logarithm = (vectors * np.log(values)[:, None, :]) @ vectors.transpose(0, 2, 1)
    curve = PchipInterpolator(np.log(table.density), logarithm)
    slope = curve.derivative()

    def value(rho: FloatArray) -> FloatArray:
        w, v = np.linalg.eigh(curve(np.log(rho)))
        c = (v * np.exp(w)[..., None, :]) @ np.swapaxes(v, -1, -2)
        return np.moveaxis(c, (-2, -1), (0, 1))

    def derivative(rho: FloatArray) -> FloatArray:
        # Derivative of the matrix exponential in its eigenvectors (Daleckii and Krein).
        x = np.log(rho)
        w, v = np.linalg.eigh(curve(x))
        turned = np.swapaxes(v, -1, -2)
        change = turned @ (slope(x) / np.asarray(rho)[..., None, None]) @ v
        apart = w[..., :, None] - w[..., None, :]
        near = np.abs(apart) < 1e-9
        ratio = np.where(
            near, 1.0, np.expm1(np.where(near, 1.0, apart)) / np.where(near, 1.0, apart)
        )
        c = v @ (change * ratio * np.exp(w)[..., None, :]) @ turned
        return np.moveaxis(c, (-2, -1), (0, 1))

    return value, derivative


def _require_growth(name: str, rho: FloatArray, stiffness: _Curve, slope: _Curve) -> None:
    """Refuse a law whose stiffness is not positive definite or does not grow."""
    least = np.linalg.eigvalsh(np.moveaxis(stiffness(rho), -1, 0))[:, 0]
    change = np.linalg.eigvalsh(np.moveaxis(slope(rho), -1, 0))
    if (least <= 0).any() or (change[:, 0] < -1e-6 * change[:, -1]).any():
        worst = float(rho[int(np.argmin(change[:, 0]))])
        raise ValueError(
            f"the stiffness of table '{name}' does not grow with density near {worst:.3f}; "
            f"compute it at more densities or at a higher resolution"
        )

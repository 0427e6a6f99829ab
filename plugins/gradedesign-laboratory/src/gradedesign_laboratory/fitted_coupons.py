"""Everything that a sheet of coupons says: struts, and blocks over the law of their cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign import CaseError, DensityError, Material, ScalingLaw
from gradedesign.properties import youngs_along
from gradedesign_laboratory.coupon_fit import (
    Estimate,
    RatioFit,
    StrutFit,
    fit_ratio,
    fit_struts,
)
from gradedesign_laboratory.measured_coupons import MeasuredBlock, Readings

#: Mass over the designed one, and modulus and yield over the nominal ones, least and most: beyond,
#: a unit is wrong. Chosen, not measured.
_LEAST, _MOST = 0.1, 10.0
#: Largest ``stiffness`` that a case takes.
_STIFFEST = 1.5
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class CouponFit:
    """Fit of a sheet.

    Attributes
    ----------
    modulus, strength : RatioFit
        Measured over nominal values of blocks, at the densities that were weighed.
    density : Estimate or None
        Weighed over designed solid volume of blocks.
    blocks : tuple of MeasuredBlock
        Whose modulus or yield counts.
    refused, notes : tuple of str
        Quantities that are not stated, with reasons, and remarks on those that are.
    """

    readings: Readings
    material: Material
    struts: StrutFit
    modulus: RatioFit
    strength: RatioFit
    density: Estimate | None
    blocks: tuple[MeasuredBlock, ...]
    refused: tuple[str, ...]
    notes: tuple[str, ...]


def fit_coupons(readings: Readings, material: Material, law: ScalingLaw) -> CouponFit:
    """Fit what a sheet holds.

    The modulus of a block is compared with the law of its cell at the density that its mass gives,
    times its `compressed_ratio`, so that struts that are too thick do not count as stiff metal. Its
    yield is compared with the stress along z at which the cell first yields, by the same law.

    Raises
    ------
    CaseError
        If a mass, modulus or yield is a tenth or ten times the nominal one.
    """
    struts = fit_struts(readings.struts, readings.gauge)
    refused: list[str] = []
    ratios: dict[str, list[tuple[MeasuredBlock, float]]] = {"modulus": [], "yield": []}
    masses = []
    for block in readings.blocks:
        if block.mass is None:
            if block.modulus is not None or block.strength is not None:
                refused.append(f"coupon {block.coupon}: not weighed, so that it counts for nothing")
            continue
        solid = block.mass / (material.density * 1e6)
        masses.append(_within(block, "mass_g", solid / block.designed))
        rho = (solid - block.plates) / (block.cells * block.size) ** 3
        try:
            modulus, strength = nominal_values(law, material, rho)
        except DensityError as error:
            refused.append(f"coupon {block.coupon}: weighed density {rho:.3g}: {error}")
            continue
        for name, value, nominal in (
            ("modulus", block.modulus, modulus * block.ratio),
            ("yield", block.strength, strength),
        ):
            if value is not None:
                ratios[name].append((block, _within(block, f"{name}_MPa", value / nominal)))
    fits = {
        name: fit_ratio(name, [r for _, r in found], [b.density for b, _ in found])
        for name, found in ratios.items()
    }
    modulus_fit = _possible(fits["modulus"])
    heavy = fit_ratio("mass", masses, [b.density for b in readings.blocks if b.mass is not None])
    counted = {b.coupon: b for found in ratios.values() for b, _ in found}
    return CouponFit(
        readings=readings,
        material=material,
        struts=struts,
        modulus=modulus_fit,
        strength=fits["yield"],
        density=heavy.estimate,
        blocks=tuple(counted.values()),
        refused=(*struts.refused, *modulus_fit.refused, *fits["yield"].refused, *refused),
        notes=(
            *struts.notes, *modulus_fit.notes, *fits["yield"].notes, *_edge_notes(readings),
        ),
    )  # fmt: skip


def nominal_values(law: ScalingLaw, material: Material, rho: float) -> tuple[float, float]:
    """Modulus along z and stress along z at first yield of a periodic lattice, MPa.

    Raises
    ------
    DensityError
        If the law does not cover the density.
    """
    at = np.array([rho])
    modulus = float(youngs_along(law.stiffness(at)[:, :, 0], _UP)) * material.youngs_modulus
    if law.local_stress is None:
        return modulus, float(law.strength(at)[0]) * material.yield_strength
    along = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]).T
    local = float(law.local_stress.at(law.local_stress.profile(along), at)[0])
    return modulus, material.yield_strength / local


def _possible(fit: RatioFit) -> RatioFit:
    """A fitted modulus, refused where no process makes a solid so stiff."""
    if fit.estimate is None or fit.estimate.value <= _STIFFEST:
        return fit
    return RatioFit(
        estimate=None,
        refused=(
            f"modulus: {fit.estimate.value:.3g} times nominal, expected at most {_STIFFEST:g}; is "
            f"it the force over the area of the cube, and the base material the right one?",
        ),
    )


def _within(block: MeasuredBlock, column: str, ratio: float) -> float:
    if not _LEAST <= ratio <= _MOST:
        raise CaseError(
            f"coupon {block.coupon}: {column} is {ratio:.3g} times the nominal value; is its unit "
            f"that of the column?"
        )
    return ratio


def _edge_notes(readings: Readings) -> tuple[str, ...]:
    """A remark where the blocks' outer edges across the build direction are off as a whole."""
    off = [
        edge - block.cells * block.size
        for block in readings.blocks
        for edge in block.edges[:2]
        if edge is not None
    ]
    if len(off) < 2:
        return ()
    mean, error = float(np.mean(off)), float(np.std(off, ddof=1)) / len(off) ** 0.5
    if abs(mean) <= 3.0 * error:
        return ()
    return (
        f"outer edges of blocks are {mean:+.3g} mm off on average ({len(off)} edges): scale the "
        f"machine before you trust the struts, faces of parts are taken to be right",
    )

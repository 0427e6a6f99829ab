"""The record of a process and its material that coupons give: a file that a case names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from gradedesign import CaseError
from gradedesign.commands import toml_text
from gradedesign_laboratory.coupon_fit import CONFIDENCE
from gradedesign_laboratory.fitted_coupons import CouponFit


def process_table(fit: CouponFit) -> dict[str, Any]:
    """Table ``[process]`` of the record: keys of a case; empty where nothing is known."""
    struts, table = fit.struts, dict[str, Any]()
    if struts.sizes:
        table["strut_size"] = [
            [f"{angle:g} deg", f"{size.value:.4f} mm"] for angle, size in struts.sizes.items()
        ]
    if struts.scatter is not None:
        table["scatter"] = f"{struts.scatter.value:.4f} mm"
    if fit.modulus.estimate is not None:
        table["stiffness"] = float(f"{fit.modulus.estimate.value:.4g}")
    if not table:
        return {}
    counts = [size.count for size in struts.sizes.values()]
    if fit.modulus.estimate is not None:
        counts.append(fit.modulus.estimate.count)
    if struts.widths is not None:
        table["sizes"] = [f"{width:g} mm" for width in struts.widths]
    return {
        **table,
        "material": fit.material.name,
        "machine": fit.readings.machine,
        "samples": min(counts),
        "source": source_words(fit),
    }


def material_table(fit: CouponFit) -> dict[str, Any]:
    """Table ``[material]`` of the record: that of the library, with the yield that was measured.

    Empty where no yield was. A ratio above 1 is not put in: a block yields as a whole after its
    first points do, which makes the solid no stronger; the source says so.
    """
    found, base = fit.strength.estimate, fit.material
    if found is None:
        return {}
    strength = base.yield_strength * min(found.value, 1.0)
    words = f"{base.name} of the library, yield times {min(found.value, 1.0):.3g}: blocks yield at "
    words += f"{found.value:.3g} ({found.low:.3g} to {found.high:.3g}) of the nominal stress"
    if found.value > 1.0:
        words += ", which makes the solid no stronger"
    table: dict[str, Any] = {
        "name": base.name,
        "youngs_modulus": f"{base.youngs_modulus:.6g} MPa",
        "poissons_ratio": base.poissons_ratio,
        "density": f"{base.density * 1e9:.6g} g/cm^3",
        "yield_strength": f"{strength:.5g} MPa",
    }
    if base.thermal_expansion:
        table["thermal_expansion"] = f"{base.thermal_expansion:.6g} 1/K"
    return {**table, "source": f"{words}; {source_words(fit)}"}


def source_words(fit: CouponFit) -> str:
    """Where the figures come from and for what they hold, in at most some hundred characters."""
    readings, words = fit.readings, list[str]()
    if fit.struts.sizes:
        angles, counts = list(fit.struts.sizes), [s.count for s in fit.struts.sizes.values()]
        words.append(
            f"struts at {angles[0]:g} to {angles[-1]:g} deg, {min(counts)} or more of each"
        )
    if fit.blocks:
        words.append(
            f"{len(fit.blocks)} blocks of {readings.facts.cell}, density "
            f"{_range([b.density for b in fit.blocks])}, cells of "
            f"{_range([b.size for b in fit.blocks])} mm"
        )
    return (
        f"coupons of {readings.day}, process {readings.facts.process} on {readings.machine}: "
        f"{'; '.join(words)}"
    )


def _range(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def fitted_table(fit: CouponFit) -> dict[str, Any]:
    """Table ``[fitted]`` of the record: every estimate with its interval, for people and programs.

    Nothing of it is read by a case.
    """
    readings, struts = fit.readings, fit.struts
    estimates = {
        "scatter_mm": struts.scatter,
        "modulus_over_nominal": fit.modulus.estimate,
        "yield_over_nominal": fit.strength.estimate,
        "mass_over_designed": fit.density,
    }
    sizes = {f"strut_size_{angle:g}_deg_mm": size for angle, size in struts.sizes.items()}
    return {
        "process": readings.facts.process,
        "machine": readings.machine,
        "material": fit.material.name,
        "cell": readings.facts.cell,
        "date": readings.day,
        "confidence": CONFIDENCE,
        **{
            name: {key: _figures(v) for key, v in asdict(value).items()}
            for name, value in {**sizes, **estimates}.items()
            if value is not None
        },
        "refused": list(fit.refused),
        "notes": list(fit.notes),
    }


def _figures(value: float) -> float | int:
    return value if isinstance(value, int) else float(f"{value:.6g}")


def record_text(fit: CouponFit) -> str:
    """The record as a file: tables that a case names, and how they were found.

    Raises
    ------
    CaseError
        If nothing could be fitted, with the reasons.
    """
    tables = {
        "process": process_table(fit),
        "material": material_table(fit),
        "fitted": fitted_table(fit),
    }
    stated = {name: table for name, table in tables.items() if table}
    if set(stated) == {"fitted"}:
        reasons = "\n".join(fit.refused) or "nothing was measured"
        raise CaseError(f"no record can be made of this sheet:\n{reasons}")
    return toml_text(stated)

"""Change of strut widths, scatter and knock-downs of measured coupons, with 95 % intervals.

Widths of struts less the designed ones are taken as normal about a mean of each inclination, with
one standard deviation for all: the interval of a mean is Student's, that of the deviation chi
squared. The variance of the gauge, where it is stated, is taken off both ends. Ratios of blocks are
taken as log-normal. All intervals are exact then: of many sheets 95 % hold the true value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from gradedesign.fields import FloatArray
from gradedesign_laboratory.measured_coupons import MeasuredStrut

#: Confidence of all intervals.
CONFIDENCE = 0.95
#: Struts of an inclination, inclinations, and blocks, least: a mean of two has an interval of 13
#: standard deviations, and one inclination says nothing of others.
LEAST_STRUTS, LEAST_INCLINATIONS, LEAST_BLOCKS = 3, 2, 3
#: Struts beyond the number of inclinations, least, for a scatter: with 5 the upper end of its
#: interval is 2.5 times the value.
LEAST_FREEDOM = 5
#: Probability below which groups that are taken as one are told to differ.
_DIFFERENT = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A fitted value with its 95 % interval.

    Attributes
    ----------
    value, low, high : float
    count : int
        Measurements.
    """

    value: float
    low: float
    high: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class StrutFit:
    """Change of the width of struts, and their scatter, as fitted.

    Attributes
    ----------
    sizes : mapping of float to Estimate
        Change of their width, mm, by inclination in degrees, rising.
    scatter : Estimate or None
        Standard deviation from strut to strut, mm; None where it is not resolved.
    widths : (float, float) or None, mm
        Designed widths, least and most, of the struts that count.
    refused : tuple of str
        Quantities that are not stated, each with its reason.
    notes : tuple of str
        Remarks on those that are.
    """

    sizes: Mapping[float, Estimate]
    scatter: Estimate | None
    widths: tuple[float, float] | None
    refused: tuple[str, ...]
    notes: tuple[str, ...]


def fit_struts(struts: Sequence[MeasuredStrut], gauge: float | None) -> StrutFit:
    """Change of widths by inclination, and their scatter.

    Parameters
    ----------
    gauge : float or None, mm
        Standard deviation of one measurement of a width; it stays in the scatter where it is not
        stated.
    """
    refused, groups = [], _groups(struts)
    few = {a: group for a, group in groups.items() if len(group) < LEAST_STRUTS}
    for inclination, group in few.items():
        refused.append(
            f"strut size at {inclination:g} deg: {len(group)} struts measured, expected at least "
            f"{LEAST_STRUTS}"
        )
    kept = {a: group for a, group in groups.items() if a not in few}
    if len(kept) < LEAST_INCLINATIONS:
        refused.append(
            f"strut size and scatter: {len(kept)} inclinations with {LEAST_STRUTS} struts each, "
            f"expected at least {LEAST_INCLINATIONS}: one says nothing of others"
        )
        return StrutFit(sizes={}, scatter=None, widths=None, refused=tuple(refused), notes=())
    changes = {a: _changes(group) for a, group in kept.items()}
    count = sum(map(len, changes.values()))
    freedom = count - len(changes)
    variance = sum(float(((v - v.mean()) ** 2).sum()) for v in changes.values()) / freedom
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, freedom)) * variance**0.5
    sizes = {a: _around(float(v.mean()), half / len(v) ** 0.5, len(v)) for a, v in changes.items()}
    scatter, why = _scatter(variance, freedom, gauge, count)
    widths = [one.designed for group in kept.values() for one in group]
    return StrutFit(
        sizes=sizes,
        scatter=scatter,
        widths=(min(widths), max(widths)),
        refused=(*refused, *why),
        notes=_notes(kept, gauge),
    )


def _groups(struts: Sequence[MeasuredStrut]) -> dict[float, list[MeasuredStrut]]:
    """Measured struts by inclination, rising; inclinations without any are there."""
    groups: dict[float, list[MeasuredStrut]] = {s.inclination: [] for s in struts}
    for one in struts:
        if one.width is not None:
            groups[one.inclination].append(one)
    return dict(sorted(groups.items()))


def _changes(group: Sequence[MeasuredStrut]) -> FloatArray:
    """Measured less designed widths, mm."""
    return np.array([one.width - one.designed for one in group if one.width is not None])


def _around(value: float, half: float, count: int) -> Estimate:
    return Estimate(value=value, low=value - half, high=value + half, count=count)


def _scatter(
    variance: float, freedom: int, gauge: float | None, count: int
) -> tuple[Estimate | None, tuple[str, ...]]:
    """Standard deviation from strut to strut, or why it is not stated."""
    if freedom < LEAST_FREEDOM:
        return None, (f"scatter: {count} struts, expected {LEAST_FREEDOM} more than inclinations",)
    tails = stats.chi2.ppf([0.5 - CONFIDENCE / 2.0, 0.5 + CONFIDENCE / 2.0], freedom)
    off = 0.0 if gauge is None else gauge**2
    most, least = (float(v) - off for v in variance * freedom / tails)
    if most <= 0.0:
        return None, (
            f"scatter: struts deviate by {variance**0.5:.2g} mm, less than gauge_mm alone would "
            f"let them; state the standard deviation of one measured width",
        )
    if variance - off <= 0.0:
        return None, (f"scatter: not told from the error of the gauge; below {most**0.5:.2g} mm",)
    low = max(least, 0.0) ** 0.5
    value = Estimate(value=(variance - off) ** 0.5, low=low, high=most**0.5, count=count)
    return value, ()


def _notes(kept: Mapping[float, Sequence[MeasuredStrut]], gauge: float | None) -> tuple[str, ...]:
    """Remarks: widths of one inclination that change differently, and a gauge without an error."""
    notes = []
    for inclination, group in kept.items():
        by_width: dict[float, list[float]] = {}
        for one in group:
            if one.width is not None:
                by_width.setdefault(one.designed, []).append(one.width - one.designed)
        words = _differing(by_width)
        if words:
            notes.append(
                f"struts of {inclination:g} deg change by their width ({words}): one value is "
                f"stated for all of them"
            )
    if gauge is None:
        notes.append("gauge_mm is blank: the error of the gauge is part of the scatter")
    return tuple(notes)


def _differing(groups: Mapping[float, Sequence[float]]) -> str:
    """Means of groups by their key where they differ by more than chance; else nothing."""
    several = {key: np.array(values) for key, values in groups.items() if len(values) > 1}
    if len(several) < 2 or all(np.ptp(v) == 0.0 for v in several.values()):
        return ""
    if float(stats.f_oneway(*several.values()).pvalue) >= _DIFFERENT:
        return ""
    return ", ".join(f"{key:g}: {values.mean():+.3g}" for key, values in sorted(several.items()))


@dataclass(frozen=True, slots=True, kw_only=True)
class RatioFit:
    """A ratio of measured to nominal values.

    Attributes
    ----------
    estimate : Estimate or None
        None where too few were measured.
    refused, notes : tuple of str
        As of `StrutFit`.
    """

    estimate: Estimate | None
    refused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def fit_ratio(name: str, ratios: Sequence[float], densities: Sequence[float]) -> RatioFit:
    """Median ratio of measured to nominal values of blocks.

    Parameters
    ----------
    name : str
        Of the quantity, for messages.
    ratios, densities : sequence of float
        Of every block: its ratio, and the density that it was designed with.
    """
    if len(ratios) < LEAST_BLOCKS:
        words = f"{name}: {len(ratios)} blocks with mass and {name}, expected at least"
        return RatioFit(estimate=None, refused=(f"{words} {LEAST_BLOCKS}",))
    logs = np.log(np.array(ratios, dtype=np.float64))
    freedom = len(logs) - 1
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, freedom) * logs.std(ddof=1) / len(logs) ** 0.5)
    middle = float(logs.mean())
    low, value, high = (float(v) for v in np.exp([middle - half, middle, middle + half]))
    by_density: dict[float, list[float]] = {}
    for density, ratio in zip(densities, ratios, strict=True):
        by_density.setdefault(density, []).append(ratio)
    words = _differing(by_density)
    notes = (f"{name} over nominal changes with the density ({words}): one value is stated",)
    return RatioFit(
        estimate=Estimate(value=value, low=low, high=high, count=len(logs)),
        notes=notes if words else (),
    )

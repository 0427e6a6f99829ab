"""Correction of the homogenised model by an explicit analysis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gradedesign.arrays import FloatArray
from gradedesign.design.loop.iteration_steps import Prediction, predict
from gradedesign.mechanics.explicit.correction import (
    Correction,
    Discrepancy,
    damped,
    damping_for,
    discrepancy_between,
    stiffness_exponent,
    stiffness_update,
)
from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, predicted_row
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import limit_rows
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """Correction that sizing used, and the discrepancies of earlier iterations in order."""

    correction: Correction
    discrepancies: tuple[Discrepancy, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lesson:
    """Result of comparing an explicit analysis with its prediction."""

    #: Every limit by the explicit analysis, or by its prediction where that measures nothing.
    rows: tuple[LimitRow, ...]
    explicit: dict[LimitKey, float]  #: Of the limits that it measures.
    discrepancy: Discrepancy
    correction: Correction  #: For the next iteration.


def learn(
    model: HomogenisedModel,
    limits: Sequence[Limit],
    prior: Prior,
    predicted: Prediction,
    result: ExplicitResult,
    rho: FloatArray,
) -> Lesson:
    """Compare an explicit analysis with its prediction and correct the model by the difference."""
    rows = _judged_rows(limits, result, predicted)
    explicit = {row.key: row.value for row in rows if not row.homogenised}
    discrepancy = discrepancy_between(
        {key: prediction.value for key, prediction in predicted.values.items()},
        explicit,
        governing=_most_used(limits, explicit),
    )
    prior = replace(prior, discrepancies=(*prior.discrepancies, discrepancy))
    return Lesson(
        rows=rows,
        explicit=explicit,
        discrepancy=discrepancy,
        correction=_corrected(model, limits, prior, predicted, explicit, rho),
    )


def _judged_rows(
    limits: Sequence[Limit], result: ExplicitResult, predicted: Prediction
) -> tuple[LimitRow, ...]:
    """Every limit by the explicit analysis, or by its prediction where that measures nothing."""
    return (
        *limit_rows(limits, result, "explicit analysis"),
        *(
            predicted_row(limit, predicted.values[limit.key])
            for limit in limits
            if not limit.explicit
        ),
    )


def _most_used(limits: Sequence[Limit], explicit: Mapping[LimitKey, float]) -> LimitKey | None:
    """The limit on stiffness that is used most; None without any."""
    utilisations = {
        limit.key: limit.utilisation(explicit[limit.key])
        for limit in limits
        if limit.follows_stiffness and limit.key in explicit
    }
    return max(utilisations, key=lambda key: utilisations[key], default=None)


def _corrected(
    model: HomogenisedModel,
    limits: Sequence[Limit],
    prior: Prior,
    predicted: Prediction,
    explicit: Mapping[LimitKey, float],
    rho: FloatArray,
) -> Correction:
    """Factors that make the homogenised model agree with this explicit analysis."""
    correction, discrepancy = prior.correction, prior.discrepancies[-1]
    damping = damping_for(prior.discrepancies)
    factors = {limit.key: correction.factor(limit.key) for limit in limits if limit.explicit}
    bounds = [limit.key for limit in limits if limit.explicit and not limit.follows_stiffness]
    for key in bounds:
        factors[key] = damped(factors[key], factors[key] * (1.0 + discrepancy.of(key)), damping)
    worst = discrepancy.governing
    if worst is None:
        return replace(correction, factors=tuple(factors.items()))
    before = {key: prediction.value for key, prediction in predicted.values.items()}
    limit = next(limit for limit in limits if limit.key == worst)
    ratio = stiffness_update(
        limit.compliance(explicit[worst]), limit.compliance(before[worst]), predicted.lattice_share
    )
    mean = predicted.mean_density
    factor = correction.stiffness * (mean / correction.reference) ** correction.exponent
    samples = (*correction.samples, (mean, damped(factor, factor * ratio, damping)))
    trial = Correction(
        stiffness=samples[-1][1],
        exponent=stiffness_exponent(samples),
        reference=mean,
        samples=samples,
        factors=correction.factors,
    )
    again = {key: new.value for key, new in predict(model, limits, trial, rho).values.items()}
    for key, old in factors.items():
        if key in bounds and again[key] and before[key]:
            # The stiffness changes the homogenised stress too: keep the product right.
            factors[key] = old * before[key] / again[key]
        elif key not in bounds and key in explicit:
            # The remaining discrepancy goes to each limit's own factor.
            factors[key] = damped(old, old * explicit[key] / again[key], damping)
    return replace(trial, factors=tuple(factors.items()))

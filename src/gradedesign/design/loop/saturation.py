"""Estimate of whether higher densities could make a design hold the limit that it breaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.iteration_steps import (
    corrected_limits,
    corrected_model,
)
from gradedesign.design.resolve.cell_choice import element_bounds
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.load_balance import open_regions, plate_key
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import Factors, with_factors
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.state import SolvedState, solved_state

#: A limit is out of reach if this many times the gain that the model predicts is not enough.
SAFETY = 2.0
#: Below this gain, the densities that matter for a value are reported to stand at their bound.
#: Chosen, not measured.
_NO_GAIN = 0.02
#: Windows within this relative distance are one. Chosen, not measured.
_ALIKE = 1e-2


def saturated(
    model: DesignModel, iterations: Sequence[DesignIteration], factors: Factors
) -> str | None:
    """Sentence on the limit that no density of this lattice can hold, or None.

    Every density matters by its sensitivity: a limit is out of reach once all densities at their
    bounds would not gain enough. Solid members can hold whatever the solid part holds. A limit
    that an earlier design held is within reach,
    whatever the model predicts now.

    Returns str or None: one sentence: the limit, and what would help.

    ``iterations``: in order, with their explicit values; limits that the last one breaks are looked
    at. ``factors``: by LimitKey; factors of acceptance.
    """
    if iterations[-1].members is not None:
        return None
    limits = {limit.key: limit for limit in model.limits}
    missed = [
        row
        for row in never_held([iteration.rows for iteration in iterations], factors)
        if row.key in limits and row.utilisation > limits[row.key].scatter
    ]
    if not missed:
        return None
    solved = _solved(model.homogenised, model.limits, iterations[-1])
    for row in sorted(missed, key=lambda r: -r.utilisation):
        slope = _relative_slope(solved, solved.limits[row.key])
        gain = density_gain(slope, solved.state.rho, element_bounds(model.cells))
        if row.utilisation * (1.0 - SAFETY * gain) > 1.0:
            return sentence(model, row, gain)
    return None


def never_held(designs: Sequence[Sequence[LimitRow]], factors: Factors) -> list[LimitRow]:
    """Rows of the last design whose limit it breaks, as every design before it did.

    ``designs``: explicit values of the designs, in order. ``factors``: by LimitKey; accepted over
    explicit values.
    """
    *earlier, last = (with_factors(rows, factors) for rows in designs)
    held = {(row.key, row.load_case) for rows in earlier for row in rows if row.passed}
    return [row for row in last if not row.passed and (row.key, row.load_case) not in held]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solved:
    """A design in the corrected homogenised model."""

    limits: dict[LimitKey, Limit]
    state: SolvedState
    system: ElasticSystem


def _solved(part: HomogenisedModel, limits: Sequence[Limit], iteration: DesignIteration) -> _Solved:
    model = corrected_model(part, iteration.correction)
    limits = corrected_limits(limits, iteration.correction)
    system = homogenised_system(model, iteration.rho)
    return _Solved(
        limits={limit.key: limit for limit in limits},
        state=solved_state(model, iteration.rho, limits, system),
        system=system,
    )


def _relative_slope(solved: _Solved, limit: Limit) -> FloatArray:
    """Derivative of a utilisation by every density, over the utilisation, ``(M,)``."""
    response = limit.responses(solved.state)[0]
    adjoints = solve_adjoints(solved.state.model, solved.system, [response])
    slope = limit.utilisation_slope(response.value) / limit.utilisation(response.value)
    return response_gradients(solved.state, [response], adjoints)[0] * slope


def density_gain(
    slope: FloatArray, rho: FloatArray, bounds: tuple[FloatArray | float, FloatArray | float]
) -> float:
    """Share of a value that densities at the better of their bounds would take away.

    ``slope (M,)``: derivative of the value, or of its utilisation, by every density, over itself.
    ``rho (M,)``. ``bounds``: two, each ``(M,)`` or one number.

    Notes
    -----
    At first order. Displacements and work are convex in the densities, so that this overrates it.
    """
    low, high = bounds
    return float(np.maximum(-slope * (high - rho), slope * (rho - low)).sum())


def sentence(model: DesignModel, row: LimitRow, gain: float) -> str:
    """The limit that is out of reach, and what would help."""
    plan, cells, case = model.plan, model.cells, model.plan.case
    upper = cells.bounds[1]
    window = min(cells.cell.window[1], cells.law.window[1])
    helps = ["another cell", "smaller cells"]
    if not plan.domain.ties_faces:
        helps.insert(1, "a skin")
    if window > upper * (1 + _ALIKE):
        helps.insert(0, f"[lattice] density up to {window:.3g}")
    size = cells.layout.typical
    if row.key.region in open_regions(case.load_case, plan.part, plan.domain, size):
        helps.insert(0, plate_key(row.key.region, size))
    if row.unfavourable == "low":
        why = f"densities at the better of their bounds would raise it by about {gain:.0%}"
    elif gain < _NO_GAIN:
        why = f"every density that matters for it stands at the upper bound of {upper:.3g}"
    else:
        why = (
            f"raising every density to the upper bound of {upper:.3g} would take about {gain:.0%} "
            f"of it away"
        )
    return (
        f"this lattice cannot reach the limit on {row.name} ({row.load_case}): {why}; "
        f"{', '.join(helps[:-1])} or {helps[-1]} would help"
    )

"""Whether a design that breaks a limit could still be made to hold it by higher densities."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.fe.elastic_system import ElasticSystem
from gradedesign.fe.solution import Solution
from gradedesign.ladder.buckling import BUCKLING, buckling_limit
from gradedesign.ladder.round import (
    corrected_limits,
    corrected_model,
    corrected_stress_limit,
    displacement_key,
)
from gradedesign.ladder.rounds import Round
from gradedesign.ladder.setup import Setup
from gradedesign.ladder.verdict import Factors, LimitRow, with_factors
from gradedesign.sizing.buckling_limit import density_for_buckling
from gradedesign.sizing.homogenised import homogenised_system, solve_homogenised, solve_vectors
from gradedesign.sizing.homogenised_model import HomogenisedModel
from gradedesign.sizing.lattice_stress import lattice_stress
from gradedesign.sizing.responses import (
    DisplacementLimit,
    adjoint_loads,
    displacement_gradient,
    displacement_values,
    stiffness_derivative,
)
from gradedesign.sizing.stress_limit import density_for_stress
from gradedesign.verify.correction import Correction

#: A limit is out of reach if this many times what the model says could be gained is not enough.
SAFETY = 2.0
#: Below this gain, the densities that matter for a displacement are told to stand at their bound.
NO_GAIN = 0.02
#: A density counts as at its upper bound within this relative distance.
AT_BOUND = 1e-2
#: A stress missed by less may still fall by what happens around it.
STRESS_MARGIN = 1.03


def saturated(setup: Setup, done: Round, factors: Factors) -> str | None:
    """Say which limit no density of this lattice can hold, or None.

    Of a displacement every density matters by its sensitivity: a limit is out of reach once all
    densities at their bounds would not gain what is missing. Of stress and buckling those
    tetrahedra matter whose own stress asks for a higher density.

    Parameters
    ----------
    setup : Setup
    done : Round
        The last one, with its explicit values.
    factors : mapping of (name, load case) to float
        What acceptance taught.

    Returns
    -------
    str or None
        One sentence: the limit, and what would help.
    """
    missed = [row for row in with_factors(done.rows, factors) if not row.passed]
    judged = [row for row in missed if _depends_on_density(row)]
    if not judged:
        return None
    solved = _solved(setup, done)
    for row in sorted(judged, key=lambda r: -r.use):
        gain = _gain(setup, solved, row, factors)
        if gain is not None and row.use * (1.0 - SAFETY * gain) > 1.0:
            return sentence(setup, row, gain)
    return None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solved:
    """A design in the corrected homogenised model."""

    correction: Correction
    model: HomogenisedModel
    rho: FloatArray
    system: ElasticSystem
    solutions: tuple[Solution, ...]


def _solved(setup: Setup, done: Round) -> _Solved:
    model = corrected_model(setup, done.correction)
    system = homogenised_system(model, done.rho)
    return _Solved(
        correction=done.correction,
        model=model,
        rho=done.rho,
        system=system,
        solutions=solve_homogenised(model, done.rho, system),
    )


def _depends_on_density(row: LimitRow) -> bool:
    if row.name == "stress in lattice":
        return row.use > STRESS_MARGIN
    return row.unit == "mm" or row.name == BUCKLING


def _gain(setup: Setup, solved: _Solved, row: LimitRow, factors: Factors) -> float | None:
    """Share of a row's value that densities at their bounds could take away; None: unknown."""
    model, rho = solved.model, solved.rho
    for limit in corrected_limits(setup, solved.correction):
        if displacement_key(limit) == (row.name, row.load_case):
            return displacement_gain(relative_slope(solved, limit), rho, setup.bounds)
    carried = lattice_stress(model, rho, solved.solutions)
    wanted = None
    stress, buckling = corrected_stress_limit(setup, solved.correction), buckling_limit(setup)
    if row.name == BUCKLING and buckling is not None:
        wanted = density_for_buckling(buckling, model, carried)
    elif stress is not None:
        factor = factors.get(("stress in lattice", ""), 1.0)
        wanted = density_for_stress(replace(stress, limit=stress.limit / factor), model, carried)
    if wanted is None or not needy_at_bound(wanted, rho, setup):
        return None
    return 0.0


def relative_slope(solved: _Solved, limit: DisplacementLimit) -> FloatArray:
    """Derivative of a displacement by every density, over the displacement, ``(M,)``."""
    model, name = solved.model, limit.load_case
    adjoint = solve_vectors(solved.system, adjoint_loads(model, [limit], solved.solutions))[0]
    slope = displacement_gradient(
        model,
        solved.rho,
        stiffness_derivative(model, solved.rho),
        next(case for case in model.cases if case.name == name),
        next(s for s in solved.solutions if s.name == name),
        adjoint,
    )
    return slope / displacement_values([limit], solved.solutions)[0]


def displacement_gain(slope: FloatArray, rho: FloatArray, bounds: tuple[float, float]) -> float:
    """Share of a displacement that densities at the better of their bounds would take away.

    Parameters
    ----------
    slope : (M,) array
        Derivative of the displacement by every density, over the displacement.
    rho : (M,) array
    bounds : (float, float)

    Notes
    -----
    At first order. A displacement is convex in the densities, so that this overrates it.
    """
    low, high = bounds
    return float(np.maximum(-slope * (high - rho), slope * (rho - low)).sum())


def needy_at_bound(wanted: FloatArray, rho: FloatArray, setup: Setup) -> bool:
    """Whether tetrahedra ask for more density than they have, and all are at the upper bound."""
    lattice = setup.model.solid_share < 1
    needy = lattice & (wanted > rho * (1 + AT_BOUND))
    return bool(needy.any() and (rho[needy] >= setup.bounds[1] * (1 - AT_BOUND)).all())


def sentence(setup: Setup, row: LimitRow, gain: float) -> str:
    """The limit that is out of reach, and what would help."""
    upper = setup.bounds[1]
    window = min(setup.cell.window[1], setup.law.window[1])
    helps = ["another cell", "smaller cells"]
    if setup.case.lattice.skin is None:
        helps.insert(1, "a skin")
    if window > upper * (1 + AT_BOUND):
        helps.insert(0, f"[lattice] density up to {window:.3g}")
    why = (
        f"every density that matters for it stands at the upper bound of {upper:.3g}"
        if gain < NO_GAIN
        else f"raising every density to the upper bound of {upper:.3g} would take about {gain:.0%} "
        f"of it away"
    )
    return (
        f"this lattice cannot reach the limit on {row.name} ({row.load_case}): {why}; "
        f"{', '.join(helps[:-1])} or {helps[-1]} would help"
    )

"""Whether a design that breaks a limit could still be made to hold it by higher densities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
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
from gradedesign.sizing.lattice_stress import lattice_stress
from gradedesign.sizing.responses import (
    DisplacementLimit,
    adjoint_loads,
    displacement_gradient,
    displacement_values,
    stiffness_derivative,
)
from gradedesign.sizing.stress_limit import density_for_stress

#: Densities count as at their upper bound where raising them all would take less than this share
#: of the displacement away.
LEAST_GAIN = 0.02
#: A density counts as at its upper bound within this relative distance.
AT_BOUND = 1e-2
#: A stress missed by less may still fall by what happens around it.
STRESS_MARGIN = 1.03


def saturated(setup: Setup, done: Round, factors: Factors) -> str | None:
    """Say which limit no density of this lattice can hold, or None.

    Of a displacement every density matters by its sensitivity: a limit is out of reach once all
    densities at their upper bound would gain next to nothing, and not what is missing. Of stress
    and buckling those tetrahedra matter whose own stress asks for a higher density.

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
    if not missed:
        return None
    correction = done.correction
    model = corrected_model(setup, correction)
    system = homogenised_system(model, done.rho)
    solutions = solve_homogenised(model, done.rho, system)
    limits = {displacement_key(one): one for one in corrected_limits(setup, correction)}
    derivative = stiffness_derivative(model, done.rho)
    cases = {case.name: case for case in model.cases}
    by_name = {s.name: s for s in solutions}

    def gradient(limit: DisplacementLimit) -> FloatArray:
        """Of one displacement by all densities, over its value."""
        adjoint = solve_vectors(system, adjoint_loads(model, [limit], solutions))[0]
        name = limit.load_case
        slope = displacement_gradient(
            model, done.rho, derivative, cases[name], by_name[name], adjoint
        )
        return slope / displacement_values([limit], solutions)[0]

    for row in sorted(missed, key=lambda r: -r.use):
        limit = limits.get((row.name, row.load_case))
        if limit is not None:
            out = displacement_out_of_reach(row, gradient(limit), done.rho, setup.bounds[1])
        elif row.name == "stress in lattice" and row.use > STRESS_MARGIN:
            asked = corrected_stress_limit(setup, correction)
            tight = None if asked is None else replace(asked, limit=asked.limit / _factor(factors))
            carried = lattice_stress(model, done.rho, solutions)
            out = tight is not None and needy_at_bound(
                density_for_stress(tight, model, carried), done.rho, setup
            )
        elif row.name == BUCKLING:
            resists = buckling_limit(setup)
            carried = lattice_stress(model, done.rho, solutions)
            out = resists is not None and needy_at_bound(
                density_for_buckling(resists, model, carried), done.rho, setup
            )
        else:
            out = False
        if out:
            return sentence(setup, row)
    return None


def displacement_out_of_reach(
    row: LimitRow, slope: FloatArray, rho: FloatArray, upper: float
) -> bool:
    """Whether all densities at their upper bound would leave a missed displacement missed.

    Parameters
    ----------
    row : LimitRow
        With its judged value.
    slope : (M,) array
        Derivative of the displacement by every density, over the displacement.
    rho : (M,) array
    upper : float

    Notes
    -----
    The gain is taken at first order. Displacements are convex in the densities, so that this
    overrates it.
    """
    gain = float(np.maximum(-slope, 0.0) @ np.maximum(upper - rho, 0.0))
    return gain < LEAST_GAIN and row.use * (1.0 - gain) > 1.0


def needy_at_bound(wanted: FloatArray, rho: FloatArray, setup: Setup) -> bool:
    """Whether tetrahedra ask for more density than they have, and all are at the upper bound."""
    lattice = setup.model.solid_share < 1
    needy = lattice & (wanted > rho * (1 + AT_BOUND))
    return bool(needy.any() and (rho[needy] >= setup.bounds[1] * (1 - AT_BOUND)).all())


def sentence(setup: Setup, row: LimitRow) -> str:
    """The limit that is out of reach, and what would help."""
    upper = setup.bounds[1]
    window = min(setup.calibration.window[1], setup.law.window[1])
    helps = ["another cell", "smaller cells"]
    if setup.case.lattice.skin is None:
        helps.insert(1, "a skin")
    if window > upper * (1 + AT_BOUND):
        helps.insert(0, f"[lattice] density up to {window:.3g}")
    return (
        f"{row.name} ({row.load_case}) is {row.value:.4g} {row.unit}, {row.use:.1%} of the allowed "
        f"{row.limit:.4g} {row.unit}, with every density that matters for it at the upper bound of "
        f"{upper:.3g}: this lattice cannot reach the limit; {', '.join(helps[:-1])} or {helps[-1]} "
        f"would help"
    )


def _factor(factors: Factors) -> float:
    return factors.get(("stress in lattice", ""), 1.0)

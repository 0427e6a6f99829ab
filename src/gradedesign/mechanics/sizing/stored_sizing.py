"""Results of sizing in the user's cache, reused for the same model whatever grids and budgets."""

from __future__ import annotations

import inspect
import sys
import uuid
from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.common.system.program_key import program_key
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.material.scaling_law import has_strength
from gradedesign.mechanics.sizing.problem import element_densities, member_field
from gradedesign.mechanics.sizing.size import (
    INSISTENCE,
    TOLERANCE,
    SizingProblem,
    SizingResult,
    SizingStep,
    size,
)

KIND = "sizing"
#: Fields of a step of the history that are one number, beside its own.
_NUMBERS = ("mass_g", "mean_density", "change", "members_g")


def stored_sizing(
    problem: SizingProblem,
    stated: Sequence[str | float],
    *,
    start: FloatArray | None,
    max_iterations: int,
    insistence: int = INSISTENCE,
    keep: float,
    tolerance: float = TOLERANCE,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Size, or take the result for the same input from the user's cache.

    A run that ended in its explicit analysis, or whose grid alone is changed, does not size again.
    Steps that are found again are reported as those that are made.

    Parameters
    ----------
    problem : SizingProblem
        With the corrections and targets of its iteration.
    stated : sequence of str and float
        Whatever else tells it from others: what the case and its cell state.
    start, max_iterations, insistence, keep, tolerance, on_step
        As for `size`.
    """
    effort = (max_iterations, insistence, keep, tolerance)
    key = _sizing_key(problem, stated, start, effort)
    stored = load_arrays(KIND, key)
    if stored is not None:
        result = _unpacked(problem, stored)
        for step in result.history:
            if on_step is not None:
                on_step(step)
        return result
    result = size(
        problem, start=start, max_iterations=max_iterations, insistence=insistence, keep=keep,
        tolerance=tolerance, on_step=on_step,
    )  # fmt: skip
    store_arrays(KIND, key, **_packed(result))
    return result


def _sizing_key(
    problem: SizingProblem,
    stated: Sequence[str | float],
    start: FloatArray | None,
    effort: tuple[float, ...],
) -> str:
    """Content key of everything that a sizing depends on."""
    model, law, members = problem.model, problem.model.law, problem.members
    limits = [
        (limit.key, limit.allowed, limit.factor, _source_of(limit)) for limit in problem.limits
    ]
    curves = []
    for scaling_law in law.laws:
        densities = np.linspace(*scaling_law.window, 33)
        curves.append(scaling_law.stiffness(densities))
        if has_strength(scaling_law):
            curves.append(scaling_law.strength(densities))
    correction = (model.stiffness_factor, model.stiffness_exponent, model.reference_density)
    return content_key(
        KIND,
        program_key(),
        *stated,
        repr(
            [
                (scaling_law.name, scaling_law.source, scaling_law.coefficients)
                for scaling_law in law.laws
            ]
        ),
        *curves,
        *(
            np.zeros(0) if values is None else values
            for values in (law.weights, law.stiffness_factor, law.strength_factor)
        ),
        *(problem.windows or ()),
        model.space.mesh.points,
        model.space.mesh.tets,
        model.solid_fraction,
        np.zeros(0) if model.solid_moments is None else model.solid_moments,
        np.asarray(model.rotation),
        np.zeros(0) if model.walls is None else model.walls.kind,
        np.zeros(0) if model.effective is None else model.effective.effective,
        repr(correction),
        repr(limits),
        repr((*problem.bounds, problem.target, *effort)),
        repr(members if members is None else (members.sharpness, members.price, members.threshold)),
        np.zeros(0) if members is None or members.allowed is None else members.allowed,
        np.zeros(0) if start is None else start,
    )


def _source_of(limit: Limit) -> str:
    """Text of the code of a limit, which a plugin may bring: `program_key` is the core's alone."""
    try:
        return inspect.getsource(sys.modules[type(limit).__module__])
    except (OSError, TypeError, KeyError):
        # Made at run time: nobody can say whether a stored answer is that of the same code.
        return uuid.uuid4().hex


def _packed(result: SizingResult) -> dict[str, FloatArray]:
    steps = [asdict(step) for step in result.history]
    return {
        "variables": result.variables,
        "steps": np.array([[float(s[name]) for name in _NUMBERS] for s in steps]),
        "utilisations": np.array([s["utilisations"] for s in steps]).reshape(len(steps), -1),
        "flags": np.array([result.converged, result.feasible]),
    }


def _unpacked(problem: SizingProblem, stored: dict[str, FloatArray]) -> SizingResult:
    history = []
    for number, (row, utilisations) in enumerate(
        zip(stored["steps"], stored["utilisations"], strict=True)
    ):
        fields = dict(zip(_NUMBERS, map(float, row), strict=True))
        history.append(
            SizingStep(iteration=number, utilisations=tuple(map(float, utilisations)), **fields)
        )
    return SizingResult(
        rho=element_densities(problem, stored["variables"]),
        members=member_field(problem, stored["variables"]),
        variables=stored["variables"],
        history=tuple(history),
        converged=bool(stored["flags"][0]),
        feasible=bool(stored["flags"][1]),
    )

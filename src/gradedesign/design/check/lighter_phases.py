"""The lighter body where a case allows lattice, solid and void."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from gradedesign.common.system.progress import report_step
from gradedesign.design.check.price import PricedBody, left_out, sized_body
from gradedesign.design.loop.iteration_steps import SizingPlan, design_filter, size_design
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import GradeDesignError
from gradedesign.mechanics.explicit.correction import Correction


def lighter_phases(
    made: Mapping[tuple[str, ...], Callable[[], DesignModel]],
) -> tuple[DesignModel, tuple[PricedBody, ...], str]:
    """Of a filled body and one without cells the lighter one that holds the limits.

    Each is sized as in the first iteration of its run, which finds its design stored, and cut into
    members that print. All three phases sized together end as one of these, see
    ``docs/decisions/sizing.md``.

    ``made``: the prepared part of each body by its phases, the filled one first. Where none holds,
    the first that can be sized is made; where none can be sized, the first one's error is raised.

    Returns ``model``: of the lighter body; ``bodies``: all of them; ``words``: a sentence on them.
    """
    models, bodies = dict[str, DesignModel](), list[PricedBody]()
    errors = list[GradeDesignError]()
    for phases, make in made.items():
        name = " and ".join(phases)
        report_step(f"sizing: {name}")
        try:
            model = make()
            sized = size_design(model, Correction(), {}, design_filter(model), SizingPlan())
            bodies.append(sized_body(name, model.homogenised, sized))
            models[name] = model
        except GradeDesignError as error:
            errors.append(error)
            bodies.append(left_out(name, str(error)))
    if not models:
        raise errors[0]
    able = [body for body in bodies if body.name in models]
    holding = [body for body in able if body.holds] or able[:1]
    lighter = min(holding, key=lambda body: body.mass_g or 0.0).name
    each = [
        f"{body.name} left out, {body.note}"
        if body.mass_g is None
        else f"{body.name} {body.mass_g:.4g} g{'' if body.holds else ', ' + body.note}"
        for body in bodies
    ]
    words = f"sized: {'; '.join(each)}. The run makes {lighter}"
    asked = tuple(replace(body, asked=body.name == lighter) for body in bodies)
    return models[lighter], asked, words

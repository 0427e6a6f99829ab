"""Result records from the outcome of the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from gradedesign.arrays import FloatArray
from gradedesign.design.acceptance.body import void_warnings
from gradedesign.design.acceptance.body_comparison import comparison_warnings
from gradedesign.design.acceptance.printed_body import PrintedBody
from gradedesign.design.acceptance.whole_solid import NARROW
from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.loop.accepted_rows import unjudged_words, without_band
from gradedesign.design.loop.ended import Ended
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.iteration_steps import predict
from gradedesign.design.resolve.cell_choice import CellChoice, element_bounds
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.lattice_files import outer_data
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.verdict.acceptance_data import acceptance_data, measure_data
from gradedesign.design.verdict.at_lower_density import at_lower_density
from gradedesign.design.verdict.common import (
    common_entries,
    latticed_mass,
    solid_mass,
    zone_measures,
)
from gradedesign.design.verdict.printable import thickness_data
from gradedesign.design.verdict.reasons import (
    judged_on,
    mapping_data,
    why_met,
    why_not,
    with_method,
)
from gradedesign.design.verdict.result import RunResult
from gradedesign.design.verdict.shown import Shown
from gradedesign.design.verdict.stress_warnings import coarse_layer, stress_warnings
from gradedesign.design.verdict.thin_members import thin_members
from gradedesign.geometry.tets.meshed_surface import failed_attempts
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.limits.limit import Limit, predicted_row
from gradedesign.mechanics.limits.verdict import TIGHT, is_tight, why_infeasible
from gradedesign.mechanics.sizing.homogenised import lattice_mass, total_mass
from gradedesign.mechanics.sizing.size import SizingResult

#: A band whose half is wider than this share of its value is warned of where its limit is used.
#: Chosen, not measured.
_UNRESOLVED = 0.10


def infeasible_result(model: DesignModel, registry: Registry) -> RunResult:
    """The fully solid part breaks a limit, even at the favourable end of its band."""
    return RunResult(
        status="infeasible",
        lightest=False,
        ended_by="solid",
        reason=why_infeasible(model.solid),
        limits=model.solid,
        **common_entries(model, registry),
    )


def partial_result(
    model: DesignModel,
    registry: Registry,
    stage: str,
    *,
    sized: SizingResult | None = None,
) -> RunResult:
    """Result of a run that ended at its ``stop_after``."""
    rows, numbers = model.solid, dict[str, Any]()
    measures: dict[str, Any] = {}
    common = common_entries(model, registry)
    if sized is not None and not sized.feasible:
        common["warnings"] += (
            f"the sized lattice breaks a limit: the most used one to "
            f"{sized.history[-1].utilisation:.1%}, by the homogenised prediction; a "
            f"higher upper density or a wider limit would help",
        )
    if sized is not None:
        part, weights = model.homogenised, model.homogenised.lattice_volumes
        mass = total_mass(part, sized.rho) * 1e6
        numbers = {
            "mass_g": mass,
            "lattice_mass_g": lattice_mass(part, sized.rho) * 1e6,
            "lattice_density": float(weights @ sized.rho / weights.sum()),
            "relative_density": mass / solid_mass(part),
        }
        measures = {
            "sizing": {
                **mapping_data(model.plan.case.lattice, sized.variables),
                "iterations": len(sized.history),
                "converged": sized.converged,
                "feasible": sized.feasible,
                "density": [float(sized.rho.min()), float(sized.rho.max())],
            },
            **zone_measures(part, model.cells.zoning, sized.rho),
        }
        predicted = predict(part, model.limits, Correction(), sized.rho).values
        rows = tuple(predicted_row(limit, predicted[limit.key]) for limit in model.limits)
    return RunResult(
        status="partial",
        lightest=False,
        ended_by="stop_after",
        reason=f'stopped after "{stage}" as [run] stop_after asks; nothing is proven',
        limits=rows,
        measures={
            **measures,
            "cell_map": dict(model.cells.layout.report),
            **model.plan.domain.facts(),
        },
        **numbers,
        **common,
    )


def verdict_result(
    model: DesignModel,
    registry: Registry,
    iterations: Sequence[DesignIteration],
    accepted: Accepted | None,
    ended: Ended,
    shown: Shown,
) -> RunResult:
    """Met or not, with the best design that was found and its printed file."""
    plan, case, part = model.plan, model.plan.case, model.homogenised
    common = common_entries(model, registry)
    printed, result = shown.printed, shown.analysed.result
    warnings = list(common.pop("warnings"))
    if accepted is None:
        rows, design, tight = shown.rows, best_iteration(iterations), False
        status = "not_met"
        reason = f"{why_not(rows, ended, model.solid)}; {judged_on(printed.comparison)}"
        if without_band(rows):
            warnings.append(unjudged_words(rows, ["coarser elements do not hold the solid"], []))
    else:
        rows, design = accepted.rows, accepted.iteration
        tight = is_tight(rows, at_lower_bound=design.at_lower_bound)
        if accepted.holds:
            status = "met"
            reason, tight, ended = why_met(rows, ended, tight=tight)
        else:
            status, reason = "not_met", why_not(rows, ended, model.solid)
        result = accepted.acceptance.whole or accepted.whole.result
        warnings += _acceptance_warnings(accepted)
        # A grid that was coarsened to fit the memory, or refined, is part of the verdict.
        warnings += accepted.analysed.result.solved.division.refused
    yields, told = stress_warnings(model.limits, result)
    warnings += [*told, *_body_warnings(printed, accepted, checked=case.print is not None)]
    warnings += thin_members(printed.thickness, case.lattice.least_member, design.members)
    mapping = mapping_data(case.lattice, design.variables)
    mass, lattice = (printed.mass_g(plan.material.density, name) for name in (None, "lattice"))
    warnings += _design_notes(model.limits, model.cells, part.lattice_volumes, design.rho, lattice)
    return RunResult(
        status=status,
        lightest=status == "met" and tight,
        reason=with_method(reason, mapping),
        ended_by=ended.by,
        limits=rows,
        mass_g=mass,
        lattice_mass_g=lattice,
        relative_density=mass / solid_mass(part),
        lattice_density=lattice / latticed_mass(part),
        iterations=tuple(i.summary for i in iterations),
        acceptance={} if accepted is None else acceptance_data(accepted),
        measures={
            **measure_data(result),
            **({"sizing": mapping} if mapping else {})
            | zone_measures(part, model.cells.zoning, design.rho),
            "cell_map": dict((accepted.analysed if accepted else model.cells).layout.report),
            **shown.analysed.design.domain.facts(),
        },
        printed=printed_data(printed) | outer_data(case.print, case.part.file, plan.part.surface),
        yields=(*yields, *common.pop("yields")),
        warnings=(*yields, *warnings),
        **common,
    )


def _body_warnings(printed: PrintedBody, accepted: Accepted | None, *, checked: bool) -> list[str]:
    """How the analysed solid differs from the printed one, and what is closed in the latter.

    Where printability is ``checked``, that says more of voids.
    """
    factors = () if accepted is None else accepted.factors.values()
    warnings = [*comparison_warnings(printed.comparison, factors)]
    if not checked:
        body = printed.comparison.printed
        warnings += void_warnings(body.cavities, body.cavities_mm3, body.volume_mm3)
    return warnings


def printed_data(printed: PrintedBody) -> dict[str, Any]:
    """Plain data on the printed file for result.json."""
    comparison = printed.comparison
    return {
        "volumes_mm3": dict(printed.volumes_mm3),
        "joints_mm3": printed.joints_mm3,
        **thickness_data(printed.thickness),
        "comparison": {
            **asdict(comparison),
            "volume_difference": comparison.volume_difference,
            "contour_loss": comparison.contour_loss,
        },
    }


def _design_notes(
    limits: Sequence[Limit],
    cells: CellChoice,
    volumes: FloatArray,
    rho: FloatArray,
    lattice: float,
) -> list[str]:
    """Remarks on the densities of a design whose lattice weighs so much, g."""
    noted = [note for limit in limits for note in limit.notes(volumes, rho)]
    return noted + at_lower_density(rho, element_bounds(cells)[0], volumes, lattice)


def best_iteration(iterations: Sequence[DesignIteration]) -> DesignIteration:
    """The iteration whose worst limit is used least."""
    return min(iterations, key=lambda i: i.summary.utilisation)


def _acceptance_warnings(accepted: Accepted) -> list[str]:
    layer = coarse_layer(accepted.analysed.solid, accepted.whole.result)
    warnings = [*accepted.islands.filled_words]
    for row in accepted.rows:
        coarse = layer if row.converges else ""
        if row.band is None or row.band.half_width <= (NARROW if coarse else _UNRESOLVED):
            continue
        if row.utilisation >= TIGHT:
            warnings.append(
                f"the band of {row.name} ({row.load_case}) is {row.band.low:.4g} to "
                f"{row.band.high:.4g} {row.unit}, {row.band.half_width:.0%} to either side of its "
                f"middle: the verdict takes the unfavourable end, and a finer analysis may allow a "
                f"lighter design{coarse and '; '}{coarse}"
            )
    # What submodels or another mesh have decided since is not said.
    open_still = {(row.key, row.load_case) for row in accepted.rows if row.undecided}
    warnings += [words for limit, words in accepted.whole.undecided.items() if limit in open_still]
    missing = without_band(accepted.rows)
    if missing:
        warnings.append(
            f"{', '.join(dict.fromkeys(row.name for row in missing))}: no second resolution could "
            f"be analysed, so nothing is known of the error and the limit does not hold"
        )
        warnings += accepted.whole.refused
    for w in accepted.acceptance.submodels:
        if not w.matches:
            warnings.append(
                f"the submodel at {tuple(round(c, 1) for c in w.submodel.centre)} mm differs from "
                f"the analysis that drives it by {w.force_discrepancy:.1%} in boundary force and "
                f"{w.energy_discrepancy:.1%} in strain energy, more than 3 %"
                f"{', enlarged too' if w.submodel.enlarged else ''}: stress is judged on the worse "
                f"of the two"
            )
    warnings += accepted.acceptance.refused
    for attempt in failed_attempts(accepted.acceptance.attempts):
        warnings.append(f"the mesher of the acceptance was asked again after: {attempt}")
    return warnings

"""The report an engineer signs: one self-contained HTML file, verdict first."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gradedesign.common.system.atomic import write_text
from gradedesign.design.verdict.result import scope_words, symmetry_words
from gradedesign.design.verdict.stress_numbers import stress_numbers
from gradedesign.program.outputs.output import FinishedRun, Output
from gradedesign.program.pictures.page import content_policy, scene_html

if TYPE_CHECKING:
    from jinja2 import Environment

    from gradedesign.design.verdict.result import RunResult
    from gradedesign.program.outputs.report_section import ReportSection

#: Statuses as the verdict shows them.
_STATUS = {
    "met": "MET",
    "not_met": "NOT MET",
    "infeasible": "INFEASIBLE",
    "partial": "PARTIAL: nothing is proven",
    "failed": "FAILED",
}

#: What ended a run, after "because".
_ENDED = {
    "tight": "the accepted design uses a limit to 97 % or more",
    "enclosed": "a design of at most 1 % less mass breaks a limit",
    "iterations": "its iterations were used up",
    "time": "its time was used up",
    "stuck": "the last iteration changed nothing",
    "saturated": "no density of this lattice can hold a limit",
    "refused": "the next design could not be analysed",
    "unjudged": "its designs could be analysed at one resolution only, or not meshed anew",
    "unaccepted": "the printed surface of a design could not be judged",
    "solid": "the fully solid part breaks a limit",
    "stop_after": "the case asks for no more",
    "error": "of an error",
}

#: Stages that follow each other; others are parts of these.
_STAGES = (
    "part", "solid", "iteration", "explicit", "acceptance", "printed", "price", "density",
    "lattice", "output",
)  # fmt: skip

_PICTURES = {
    "loads": "Supports and loads on the solid part",
    "density": "Relative density that sizing chose",
    "lattice": "The surface that is printed, as read back from the file",
    "stress": "Von Mises stress of the explicit analysis",
    "deformed": "Deformed body of the explicit analysis",
}


#: Limits that the first screen names. Chosen, not measured.
_TIGHTEST = 3
#: Attributes of a result that its section on mass shows, with their form.
_MASSES = (
    ("mass, g", "mass_g", ".5g"),
    ("of that the lattice, g", "lattice_mass_g", ".5g"),
    ("fully solid part, g", "solid_mass_g", ".5g"),
    ("share of the solid part's mass", "relative_density", ".1%"),
    ("mean relative density of the lattice", "lattice_density", ".3f"),
)


def _write_report(run: FinishedRun) -> tuple[str, ...]:
    """Write ``report.html``, of the finished result and its pictures."""

    def render(path: Path) -> None:
        text = render_report(
            run.result(), run.pictures(), run.case_text, run.scene(), sections=run.sections
        )
        write_text(path, text)

    run.write("report.html", render, key="report")
    return ()


def render_report(
    result: RunResult,
    pictures: Mapping[str, bytes],
    case_text: str,
    scene: Mapping[str, Any] | None = None,
    *,
    sections: Iterable[ReportSection] = (),
) -> str:
    """Render the report.

    Returns str: HTML that opens without a network; all text from outside is escaped.

    ``pictures``: PNG bytes by name, as in the result's ``files``. ``case_text``:
    the case file, printed as it was. ``scene``: data of the scene of the first screen, see
    `scene_html`. ``sections``: those that follow what the verdict rests on.
    """
    names: dict[str, list[str]] = {}
    for row in result.limits:
        if row.measure:
            names.setdefault(row.measure, []).append(row.name)
    shown = None
    if scene is not None:
        data = {**scene, "embedded": True}
        shown = scene_html(data, None, instead="the pictures below stand for the scene")
    return _environment().get_template("report.html").render(
        result=result,
        scene=shown,
        policy=content_policy(() if shown is None else shown.script_hashes),
        tightest=_tightest(result),
        stated_density=result.measures.get("density"),
        statuses=_STATUS,
        run_words=_run_words(result),
        sections=[(s.title, parts) for s in sections if (parts := list(s.content(result)))],
        how_taken=names,
        masses=[
            (label, f"{value:{form}}")
            for label, name, form in _MASSES
            if (value := getattr(result, name)) is not None
        ],
        discrepancy_names=[
            f"discrepancy of {limit.label}"
            for iteration in result.iterations[:1]
            for limit in iteration.measured
        ],
        scope_words=scope_words(result.acceptance),
        symmetry_words=symmetry_words(result),
        stresses=stress_numbers(result),
        beside_file=lambda entry: _beside_file(result, entry),
        lowest_decide=[row.name for row in result.limits if row.band and row.unfavourable == "low"],
        pictures=[
            (name, caption, base64.b64encode(pictures[name]).decode("ascii"))
            for name, caption in _PICTURES.items()
            if name in pictures
        ],
        case_text=case_text,
    )  # fmt: skip


def _tightest(result: RunResult) -> list[str]:
    """The limits that are used most, in words, the tightest first."""
    rows = sorted(result.limits, key=lambda row: -row.utilisation)[:_TIGHTEST]
    several = len({row.key.load_case for row in result.limits} - {""}) > 1
    named = [
        f"{row.name} ({row.key.load_case})" if several and row.key.load_case else row.name
        for row in rows
    ]
    return [f"{name} {row.utilisation:.1%}" for name, row in zip(named, rows, strict=True)]


@cache
def _environment() -> Environment:
    """The templates beside this file; a name that is not there is an error, never empty."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # costs a tenth of a second

    environment = Environment(
        loader=PackageLoader("gradedesign.program.outputs"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": format, "percent": _percent, "ends": _ends, "held": _held,
        "together": _together, "with_unit": _with_unit,
    }  # fmt: skip
    return environment


def _percent(value: float | None) -> str:
    """Write a share with its sign, or a dash."""
    return "–" if value is None else f"{value:+.1%}"


def _beside_file(result: RunResult, entry: Mapping[str, Any]) -> float | None:
    """Relative difference in volume of the wholly analysed solid to the printed file."""
    volume = sum(result.printed.get("volumes_mm3", {}).values())
    return entry["volume_mm3"] / volume - 1.0 if volume and entry["scope"] == "whole" else None


def _ends(entry: Mapping[str, Any]) -> str:
    """Write both ends of the band of a limit in acceptance, or a dash where there is none."""
    return "–" if entry["low"] is None else f"{entry['low']:.4g} to {entry['high']:.4g}"


def _together(words: str) -> str:
    """Keep words on one line."""
    return words.replace(" ", "\u00a0")


def _with_unit(value: float, unit: str) -> str:
    """Write a value with its unit, on one line where that is no phrase."""
    space = " " if " " in unit else "\u00a0"
    return f"{value:.4g}{space}{unit}"


def _held(displacement: float | None) -> str:
    """Write the displacement that a support prescribes, mm, or that it leaves the part free."""
    return "free" if displacement is None else f"{displacement:g}"


def _run_words(result: RunResult) -> str:
    """Duration of the run, its budgets, and what ended it."""
    budget, timing = result.budget, result.timing_s
    words = []
    if count := len(result.iterations):
        most = f" of {budget['max_iterations']} at most" if "max_iterations" in budget else ""
        words.append(f"{count} iteration{'' if count == 1 else 's'}{most}")
    if timing:
        stages = [s for s in _STAGES if s in timing] or list(timing)
        seconds = sum(timing[s] for s in stages)
        if "iteration" not in timing:
            seconds += timing.get("sizing", 0.0)
        allowed = f" of {budget['time_s']:.0f} s" if "time_s" in budget else ""
        words.append(f"{seconds:.0f} s{allowed}")
    if result.ended_by:
        words.append(f"ended because {_ENDED.get(result.ended_by, result.ended_by)}")
    return "; ".join(words)


REPORT = Output(name="report", write=_write_report, last=True)

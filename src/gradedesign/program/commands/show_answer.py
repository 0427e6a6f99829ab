"""The first answer of ``gradedesign check --estimate``, for reading and as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gradedesign.design.case.read_case import NO_VALUES
from gradedesign.mechanics.limits.verdict import why_infeasible
from gradedesign.program.commands.show import duration, print_table, print_text

if TYPE_CHECKING:
    from gradedesign.design.check.first_answer import FirstAnswer
    from gradedesign.design.check.price import PricedBody


def answer_data(answer: FirstAnswer) -> dict[str, Any]:
    """Plain data of a first answer."""
    governing = answer.governing
    return {
        "constant_density": [
            {
                "limit": limit.row.name,
                "load_case": limit.row.load_case,
                "utilisation_when_solid": limit.row.utilisation,
                "density": limit.density,
                "mass_g": limit.mass_g,
                "reason": limit.reason or None,
            }
            for limit in answer.constant
        ],
        "feasible": answer.feasible,
        "infeasible_because": None if answer.feasible else _why_infeasible(answer),
        "constant_density_of_all": None if governing is None else governing.density,
        "constant_mass_g": None if governing is None else governing.mass_g,
        "sized": None
        if answer.sized_mass_g is None
        else {
            "mass_g": answer.sized_mass_g,
            "mean_density": answer.sized_density,
            "largest_utilisation": answer.sized_utilisation,
        },
        "bodies": [
            {**asdict(body), "run_seconds": answer.run_s.get(body.name)} for body in answer.bodies
        ],
        "why_lattice": answer.why_lattice,
    }


def print_answer(answer: FirstAnswer) -> None:
    """Print a first answer."""
    print_table(
        "First answer: one density for the whole lattice, from the solid part",
        ("limit", "load case", "used when solid", "density", "mass g"),
        [
            (
                limit.row.name,
                limit.row.load_case,
                f"{limit.row.utilisation:.1%}",
                "none" if limit.density is None else f"{limit.density:.3f}",
                "" if limit.mass_g is None else f"{limit.mass_g:.4g}",
            )
            for limit in answer.constant
        ],
    )
    for limit in answer.constant:
        if limit.reason:
            print_text(f"{limit.row.name}, {limit.row.load_case}: {limit.reason}", hang=2)
    governing = answer.governing
    if governing is not None:
        print_text(
            f"constant density for all limits: {governing.density:.3f}, "
            f"{governing.mass_g:.4g} g, set by {governing.row.name}",
            hang=2,
        )
    if answer.sized_mass_g is not None:
        print_text(
            f"sized once on the homogenised part: {answer.sized_mass_g:.4g} g at mean density "
            f"{answer.sized_density:.3f}, the most used limit at {answer.sized_utilisation:.1%}",
            hang=2,
        )
    if not answer.feasible:
        print_text(f"INFEASIBLE: {_why_infeasible(answer)}", hang=2)
        return
    print_bodies(answer.bodies, answer.why_lattice, run_s=answer.run_s)
    print_text("no lattice was analysed: a run judges these limits on the printed solid", hang=2)


def print_bodies(
    bodies: Sequence[PricedBody],
    why_lattice: str,
    *,
    accepted_g: float | None = None,
    run_s: Mapping[str, float] = NO_VALUES,
) -> None:
    """Print what other bodies would weigh, and the mass of the one that was built and accepted.

    ``run_s``: seconds that a run of each is predicted to take, by name, where they are known.
    """
    if not bodies:
        return
    built = "" if accepted_g is None else f"; the accepted one weighs {accepted_g:.4g} g"
    columns = ("body", "mass g", "most used limit", *(["its run"] if run_s else ()), "note")
    rows = []
    for body in bodies:
        used = body.largest_utilisation
        row = [body.name, "-" if body.mass_g is None else f"{body.mass_g:.4g}"]
        row.append("-" if used is None else f"{used:.1%}")
        if run_s:
            row.append(duration(run_s[body.name]) if body.name in run_s else "-")
        rows.append([*row, body.words])
    title = f"Bodies that hold the same limits, predicted on the homogenised part{built}"
    print_table(title, columns, rows)
    if why_lattice:
        print_text(why_lattice, hang=2)


def _why_infeasible(answer: FirstAnswer) -> str:
    """The sentence with which a run ends."""
    return why_infeasible([limit.row for limit in answer.constant])

"""The first answer of ``gradedesign check --estimate``, for reading and as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gradedesign.mechanics.limits.verdict import why_infeasible
from gradedesign.program.commands.show import print_table, print_text

if TYPE_CHECKING:
    from gradedesign.design.check.first_answer import FirstAnswer


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
            {
                "name": body.name,
                "mass_g": body.mass_g,
                "largest_utilisation": body.utilisation,
                "asked": body.asked,
                "note": body.note or None,
            }
            for body in answer.bodies
        ],
        "why_lattice": answer.why_lattice or None,
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
    _print_bodies(answer)
    print_text("no lattice was analysed: a run judges these limits on the printed solid", hang=2)


def _print_bodies(answer: FirstAnswer) -> None:
    """Print what other bodies would weigh."""
    print_table(
        "Bodies that hold the same limits, predicted on the homogenised part",
        ("body", "mass g", "most used limit", "asked for", "note"),
        [
            (
                body.name,
                "none" if body.mass_g is None else f"{body.mass_g:.4g}",
                "" if body.utilisation is None else f"{body.utilisation:.1%}",
                "yes" if body.asked else "",
                body.note,
            )
            for body in answer.bodies
        ],
    )
    if answer.why_lattice:
        print_text(answer.why_lattice, hang=2)


def _why_infeasible(answer: FirstAnswer) -> str:
    """The sentence with which a run ends."""
    return why_infeasible([limit.row for limit in answer.constant])

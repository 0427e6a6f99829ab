"""The first answer of ``gradedesign check --estimate``, for reading and as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gradedesign.cli.show import print_table, print_text

if TYPE_CHECKING:
    from gradedesign.check.first_answer import FirstAnswer


def answer_data(answer: FirstAnswer) -> dict[str, Any]:
    """Plain data of a first answer."""
    governing = answer.governing
    return {
        "constant_density": [
            {
                "limit": one.row.name,
                "load_case": one.row.load_case,
                "use_when_solid": one.row.use,
                "density": one.density,
                "mass_g": one.mass_g,
                "reason": one.reason or None,
            }
            for one in answer.constant
        ],
        "constant_density_of_all": None if governing is None else governing.density,
        "constant_mass_g": None if governing is None else governing.mass_g,
        "sized": None
        if answer.sized_mass_g is None
        else {
            "mass_g": answer.sized_mass_g,
            "mean_density": answer.sized_density,
            "largest_use": answer.sized_use,
        },
    }


def print_answer(answer: FirstAnswer) -> None:
    """Print a first answer."""
    print_table(
        "First answer: one density for the whole lattice, from the solid part",
        ("limit", "load case", "used when solid", "density", "mass g"),
        [
            (
                one.row.name,
                one.row.load_case,
                f"{one.row.use:.1%}",
                "none" if one.density is None else f"{one.density:.3f}",
                "" if one.mass_g is None else f"{one.mass_g:.4g}",
            )
            for one in answer.constant
        ],
    )
    for one in answer.constant:
        if one.reason:
            print_text(f"{one.row.name}, {one.row.load_case}: {one.reason}", hang=2)
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
            f"{answer.sized_density:.3f}, the most used limit at {answer.sized_use:.1%}",
            hang=2,
        )
    print_text("no lattice was analysed: a run judges these limits on the printed solid", hang=2)

"""Sentences on the share of a verdict that rests on the printed surface, and of the whole part."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gradedesign.design.verdict.result import RunResult


def scope_words(acceptance: Mapping[str, Any]) -> str:
    """Scope of acceptance on the printed surface, as plain text; empty before acceptance."""
    if not acceptance:
        return ""
    share = f"{acceptance['share_of_volume']:.1%} of the printed volume"
    basis = (
        "every limit is judged on the whole printed surface: read back from the file and analysed "
        "by finite cells at two resolutions or more"
    )
    if acceptance["scope"] == "none":
        stressed = any(entry["unit"] == "MPa" for entry in acceptance["limits"])
        why = (
            "a limit is broken whatever they show"
            if stressed
            else "no limit is on stress, which alone they judge"
        )
        return f"{basis}; no submodels were meshed again, since {why}"
    if acceptance["scope"] == "whole":
        return (
            f"{basis}; an independent mesher meshed it again whole ({share}) for stress, and "
            f"bands of displacements include what that mesh shows"
        )
    count = len(acceptance["submodels"])
    submodels = f"{count} most stressed submodels" if count != 1 else "most stressed submodel"
    return (
        f"{basis}; an independent mesher meshed it again in its {submodels} ({share}), whose "
        f"stress over that of the finite cells scales the stress in the lattice"
    )


def symmetry_words(result: RunResult) -> str:
    """The whole part of a case with planes of symmetry, as plain text; empty without any."""
    if not result.symmetry:
        return ""
    times = result.symmetry["copies"]
    masses = f"{result.symmetry['solid_mass_g']:.4g} g if solid"
    if result.mass_g is not None:
        masses = f"{times * result.mass_g:.4g} g, {masses}"
    return (
        f"Mirrored on {', '.join(result.symmetry['planes'])}: the whole part is {times} times this "
        f"one, {masses}; files, loads and other masses are those of the modelled one"
    )

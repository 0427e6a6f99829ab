"""Sentence on the share of a verdict that rests on the printed surface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def scope_words(acceptance: Mapping[str, Any]) -> str:
    """Scope of acceptance on the printed surface, as plain text; empty before acceptance."""
    if not acceptance:
        return ""
    share = f"{acceptance['share_of_volume']:.1%} of the printed volume"
    if acceptance["scope"] == "whole":
        return (
            f"displacement and stress are judged on the printed surface: read back from the file, "
            f"meshed again by an independent mesher and analysed whole ({share})"
        )
    count = len(acceptance["windows"])
    submodels = f"{count} most stressed submodels" if count != 1 else "most stressed submodel"
    return (
        f"displacements are judged by the explicit analysis of a mesh of the lattice's field; the "
        f"printed surface was read back and meshed again by an independent mesher only in its "
        f"{submodels} ({share}), whose stress over that of the explicit analysis scales the stress "
        f"in the lattice"
    )

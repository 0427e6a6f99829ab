"""Choice of the scaling law of a cell over the densities of a case."""

from __future__ import annotations

import logging

from gradedesign.common.values.suggest import instead
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError
from gradedesign.mechanics.material.power_fit import GIBSON_ASHBY, gibson_ashby
from gradedesign.mechanics.material.scaling_law import ScalingLaw, has_strength

log = logging.getLogger(__name__)

#: Kinds that ``law = "auto"`` may take, best first. Test laws hold for their machine and
#: specimen, 5 to 8 times below ideal ones, so they are used only by name.
AUTO_KINDS = ("computed", "fe")


def choose_law(
    registry: Registry, family: str, law: str, density: tuple[float, float]
) -> ScalingLaw:
    """Find the law a case names, or pick one.

    ``auto`` takes, of the laws for the family whose window meets the asked densities and that
    give both stiffness and strength, the first by

    1. kind: ``computed``, then ``fe``, never ``experiment``;
    2. the share of the asked densities that the window covers, largest first;
    3. name.

    Raises `DensityError` as `gibson_ashby`. Raises `CaseError` for an unknown law, or one for other
    families; lists those for this one. Also if no window meets the densities; lists the laws with
    their windows.

    ``family``: name of the cell family. ``law``: ``auto``, the name of a law, or ``gibson-ashby``:
    the power law fitted, over the asked densities, to the first of the computed laws that ``auto``
    would take. ``density``: range the case asks for. The law need not cover all of it: sizing stays
    within the window.
    """
    for_family = {n: k for n, k in registry.scaling_laws.items() if family in k.families}
    choices = ["auto", GIBSON_ASHBY, *for_family]
    if law not in ("auto", GIBSON_ASHBY):
        if law in for_family:
            _require_overlap([for_family[law]], family, density)
            return for_family[law]
        if law in registry.scaling_laws:
            families = ", ".join(registry.scaling_laws[law].families)
            raise CaseError(
                f"law '{law}' describes {families}, not '{family}'; {instead(law, choices)}"
            )
        if registry.notes:
            lookup(registry, "scaling_laws", law)
        raise CaseError(f"no law named '{law}'; {instead(law, choices)}")
    usable = [k for k in usable_laws(registry, family) if law == "auto" or k.kind == "computed"]
    if not usable:
        named = ", ".join(for_family) or "none"
        raise CaseError(
            f"no computed or finite-element law with stiffness and strength describes cell "
            f"'{family}', so law = \"{law}\" has no choice; laws that can be named: {named}"
        )
    meeting = _require_overlap(usable, family, density)
    chosen = min(
        meeting, key=lambda k: (AUTO_KINDS.index(k.kind), -round(_overlap(k, density), 6), k.name)
    )
    if law == GIBSON_ASHBY:
        (chosen,) = _require_overlap([gibson_ashby(chosen, density)], family, density)
    log.info("law for cell %s: %s (%s)", family, chosen.name, chosen.source)
    return chosen


def usable_laws(registry: Registry, family: str) -> list[ScalingLaw]:
    """Laws for a family that ``auto`` may take: computed or by FE, with stiffness and strength."""
    return [
        law
        for law in registry.scaling_laws.values()
        if family in law.families and law.kind in AUTO_KINDS and has_strength(law)
    ]


def _overlap(law: ScalingLaw, density: tuple[float, float]) -> float:
    """Length of the density range that a law's window covers; negative if they are apart."""
    return min(law.window[1], density[1]) - max(law.window[0], density[0])


def _require_overlap(
    laws: list[ScalingLaw], family: str, density: tuple[float, float]
) -> list[ScalingLaw]:
    """Return the laws whose window meets the densities; a single density may lie on its edge."""
    meeting = [law for law in laws if _overlap(law, density) >= -1e-9]
    if not meeting:
        windows = "; ".join(f"{k.name} {k.window[0]:g} to {k.window[1]:g}" for k in laws)
        raise CaseError(
            f"no law for cell '{family}' is supported between densities {density[0]:g} and "
            f"{density[1]:g}; windows: {windows}; change [lattice] density"
        )
    return meeting

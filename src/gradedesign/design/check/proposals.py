"""Proposals for the answers that a case needs, each with its reason."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from gradedesign.design.check.draft_case import DraftCase
from gradedesign.design.resolve.registry import Registry
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.round_shapes import RoundShapes
from gradedesign.mechanics.material.scaling_law import has_strength

#: Density at which cells are compared: where lattices of lightened parts mostly lie, which many
#: families reach. Chosen, not measured.
_DENSITY = 0.2
#: Equal holes from which on they are taken for a pattern of bolts. Chosen, not measured.
_BOLTS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """A name that may answer a question, and why."""

    name: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proposals:
    """Proposals for a part, of what is installed; None where nothing speaks for any answer."""

    draft: DraftCase
    registry: Registry

    def material(self) -> Proposal | None:
        """The material that most of the installed printing processes were measured with."""
        known = Counter(process.material for process in self.registry.processes.values())
        found = [(known[name], name) for name in self.registry.materials if known[name]]
        if not found:
            return None
        times, name = max(found)
        why = f"{times} installed printing processes were measured with it"
        return Proposal(name=name, why=why)

    def support(self) -> Proposal | None:
        """The most frequent holes, the smallest of these, or else the largest flat face."""
        holes = [(hole.count, -hole.diameter, name) for name, hole in self._holes()]
        times, _, name = max(holes, default=(0, 0.0, ""))
        if times >= _BOLTS:
            return Proposal(name=name, why=f"{times} equal holes, as for bolts")
        flat = [(_rounded(region.area), name) for name, region in self._flat()]
        return Proposal(name=max(flat)[1], why="the largest flat face") if flat else None

    def load(self, held: Collection[str]) -> Proposal | None:
        """The largest single hole that is not held, or else the flat face farthest from it."""
        draft = self.draft
        holes = [
            (_rounded(hole.area), name)
            for name, hole in self._holes()
            if name not in held and hole.count == 1
        ]
        if holes:
            return Proposal(name=max(holes)[1], why="the largest single hole that is not held")
        centre = np.mean([draft.regions[name].centroid for name in held], axis=0)
        flat = [
            (_rounded(float(np.linalg.norm(region.centroid - centre))), name)
            for name, region in self._flat()
            if name not in held
        ]
        return Proposal(name=max(flat)[1], why="the flat face farthest from it") if flat else None

    def cells(self) -> list[Proposal]:
        """Cells with a computed law, the strongest at one density first."""
        strength = {
            name: float(law.strength(np.array(_DENSITY)))
            for law in self.registry.scaling_laws.values()
            if law.kind == "computed" and law.window[0] <= _DENSITY <= law.window[1]
            if has_strength(law)
            for name in law.families
        }
        return [
            Proposal(name=name, why=f"{share:.1%} of the solid's strength at density {_DENSITY:g}")
            for name, share in sorted(strength.items(), key=lambda found: -found[1])
        ]

    def _holes(self) -> list[tuple[str, RoundShapes]]:
        return [(name, s) for name, s in self.draft.shapes.items() if s.kind == "hole"]

    def _flat(self) -> list[tuple[str, Region]]:
        shapes = self.draft.shapes
        return [(name, r) for name, r in self.draft.regions.items() if name not in shapes]


def _rounded(size: float) -> float:
    """A size without its last figures: of equals the name decides, not rounding."""
    return float(f"{size:.6g}")

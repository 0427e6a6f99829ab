"""Mean displacement: the displacement of a region, averaged over its area, must stay below a limit.

One component of it, or its length. The mean of the length, not the length of the mean: a face that
twists about its middle moves, though its mean vector stays at rest.

The deflection of a bare lattice face: the largest nodal value there is that of a single wall end
that dents under its share of the load, while the mean, times the force, is the work of a load that
is spread evenly over the face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.displacement import DisplacementKind, DisplacementLimit
from gradedesign.mechanics.limits.limits_schema import DisplacementLimit as DisplacementEntry
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Response


class MeanDisplacementEntry(DisplacementEntry):
    """Mean displacement of a region over its area: of its length, or of one component of it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeanDisplacementLimit(DisplacementLimit):
    """Mean displacement of a region in one load case: of a component, or of its length."""

    shares: FloatArray  #: ``(k,)``. Share of the region's area that each node stands for.

    def __post_init__(self) -> None:
        DisplacementLimit.__post_init__(self)
        shares = locked(self.shares, (len(self.nodes),), name="shares")
        object.__setattr__(self, "shares", shares)

    @property
    def measure(self) -> str:
        """The mean over the area."""
        if self.component is None:
            return "mean length over the area of the region"
        return "mean over the area of the region"

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """The mean with its derivative by the nodal displacements of the region."""
        return (self._response(state.displacement(self.key.load_case), self.nodes),)

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """Mean over the area where the solid reaches the region, mm."""
        region, load_case = self.key.region, self.key.load_case
        if self.component is None:
            return (self.row(analysis.mean_length(region, load_case), judged_by),)
        mean = analysis.mean_displacement(region, load_case)[self.component]
        return (self.row(abs(mean), judged_by),)

    @property
    def _shares(self) -> FloatArray:
        return self.shares

    def _value_and_slope(self, moved: FloatArray, shares: FloatArray) -> tuple[float, FloatArray]:
        """Mean length, or absolute mean of a component, and its derivative."""
        slope = np.zeros_like(moved)
        if self.component is None:
            lengths = np.linalg.norm(moved, axis=0)
            # A place at rest has no direction; zero is one of its slopes.
            np.divide(moved * shares, lengths, out=slope, where=lengths > 0)
            return float(lengths @ shares), slope
        mean = float(moved[self.component] @ shares)
        slope[self.component] = shares if mean >= 0 else -shares
        return abs(mean), slope


#: ``mean_displacement = [{region = "tip", component = "z", magnitude = "2 mm"}]``.
KIND = DisplacementKind(
    name="mean_displacement", made=MeanDisplacementLimit, shared=True, entry=MeanDisplacementEntry
).kind()

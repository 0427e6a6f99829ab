"""The least density that memory and time of a case hold, of those that a window is sampled at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.design.acceptance.whole_resolution import TIME_SHARE, seconds, whole_estimates
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis, PlannedSolid

#: Densities at which the window is looked at. Chosen, not measured.
SAMPLES = 400
#: Iterations that a run is predicted to take where it may: most reach a used limit in two to four.
USUAL_ITERATIONS = 3
#: Share of the stated time that these and acceptance may be predicted to take: sizing and stress in
#: body-fitted meshes take the rest. Chosen, not measured.
_RUN_SHARE = 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Need:
    """Of a density: bytes of an iteration; bytes and seconds of the finer one of acceptance.

    ``other_seconds`` are those of all iterations and of the first one of acceptance.
    """

    memory: int
    finer_memory: int
    finer_seconds: float
    other_seconds: float

    def iterated(self, memory: float, time: float) -> bool:
        """Whether the budgets hold the iterations and an acceptance that is no finer."""
        return self.memory <= memory and self.other_seconds <= _RUN_SHARE * time

    def judged(self, memory: float, time: float) -> bool:
        """Whether the budgets hold the finer resolution of acceptance, and the whole run."""
        together = self.finer_seconds + self.other_seconds
        in_time = self.finer_seconds <= TIME_SHARE * time and together <= _RUN_SHARE * time
        return in_time and max(self.memory, self.finer_memory) <= memory

    def words(self) -> str:
        """The larger of both in GB, and the time."""
        most = max(self.memory, self.finer_memory)
        return f"{most / 1e9:.3g} GB, {self.finer_seconds / 60:.2g} min an analysis"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Needs:
    """Grids and needs of all densities."""

    spacings: FloatArray
    needs: Sequence[Need]
    memory: float
    time: float

    @property
    def bytes(self) -> IntArray:
        """Of an iteration."""
        return np.array([need.memory for need in self.needs])

    @property
    def fits(self) -> BoolArray:
        """Densities that the budgets hold: judged; or iterated, where none can be; or in memory."""
        for fit in (Need.judged, Need.iterated):
            affordable = np.array([fit(need, self.memory, self.time) for need in self.needs])
            if affordable.any():
                return affordable
        return np.asarray(self.bytes <= self.memory)


def need_of(
    analysis: ExplicitAnalysis, planned: PlannedSolid, spacing: float, first: float
) -> Need:
    """Needs of a spacing; ``first`` is the first spacing of acceptance over it."""
    own = analysis.estimate(planned, spacing)
    coarse, finer = whole_estimates(planned, first * spacing, own.unknowns)
    return Need(
        memory=own.memory_bytes,
        finer_memory=finer.memory_bytes,
        finer_seconds=seconds(finer),
        other_seconds=USUAL_ITERATIONS * seconds(own) + seconds(coarse),
    )

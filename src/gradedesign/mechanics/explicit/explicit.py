"""Analysis of the printed solid, measured: by phase, by neighbourhood, outside the exclusion."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.geometry.lattice.domain import printed_phase_at
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis, Resolution, SolvedSolid
from gradedesign.mechanics.explicit.exclusion import ExclusionZone, exclusion_zone
from gradedesign.mechanics.explicit.measures import PHASES, StressMeasure, stress_measures
from gradedesign.mechanics.explicit.neighbourhoods import neighbourhood_cells
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.support_zones import evaluated_at, undisturbed_at
from gradedesign.mechanics.explicit.yielding import Yielding, yielding
from gradedesign.mechanics.finite_cell.traction_residual import GoalResidual


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExplicitResult:
    """A solved solid with its measures; limits read it."""

    solved: SolvedSolid  #: Of n sample points.
    #: By load case, ``(n, q)``, MPa. q values at each sample point.
    von_mises: dict[str, FloatArray]
    measures: dict[str, tuple[StressMeasure, ...]]  #: By load case.
    phase: IntArray  #: ``(n,)``. Index into `measures.PHASES`.
    exclusion: ExclusionZone  #: Share of the solid that the exclusion radius leaves out.
    yields: Yielding | None  #: Stress above the yield strength that no support disturbs.
    masses_g: dict[str, float]  #: By phase, g.
    volume: float  #: mm^3.
    seconds: float  #: Of solving and measuring; without dividing the solid.

    @property
    def work(self) -> Mapping[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm."""
        return self.solved.work

    @property
    def mode_values(self) -> Mapping[Hashable, float]:
        """Natural frequencies, Hz, and load factors by the keys of the limits that ask for them."""
        return self.solved.mode_values

    @property
    def traction_residual(self) -> Mapping[str, float]:
        """Residual of the tractions by load case, see `SolvedSolid.traction_residual`."""
        return self.solved.traction_residual

    @property
    def judged_share(self) -> float:
        """Share of the lattice's volume whose stress is judged."""
        return 1.0 - self.exclusion.share.get(PHASES[0], 0.0)

    @property
    def goal_residuals(self) -> Mapping[Hashable, GoalResidual]:
        """Residuals of the goals of the printed solid, see `SolvedSolid.goal_residuals`."""
        return self.solved.goal_residuals

    @property
    def mesh_size(self) -> float:
        """Edge of the elements, mm."""
        return self.solved.division.mesh_size

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of a region's solid, ``(3, k)``, mm."""
        return self.solved.region_displacement(region, load_case)

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area where the solid reaches a region, ``(3,)``, mm."""
        return self.solved.mean_displacement(region, load_case)

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area where the solid reaches a region, mm."""
        return self.solved.mean_length(region, load_case)

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement anywhere, mm."""
        return self.solved.largest_displacement(load_case)


def analyse_printed_solid(
    analysis: ExplicitAnalysis,
    solid: PrintedSolid,
    resolution: Resolution,
    say: Callable[[str], None],
) -> ExplicitResult:
    """Solve every load case of a printed solid and measure its stress.

    Raises `LatticeError`, `MeshError`, `ResourceError` or `SolverError` as the analysis does.
    """
    began = time.perf_counter()
    return measured(analysis.solve(solid, resolution, say), solid, began)


def measured(solved: SolvedSolid, solid: PrintedSolid, began: float) -> ExplicitResult:
    """Stress measures, exclusion zone and masses of a solid whose analysis began at a time, s."""
    report_step("stress measures")
    points, volumes = solved.points, solved.volumes
    phase = printed_phase_at(solid.design.domain, points)
    evaluated = evaluated_at(points, solid.support_zones)
    von_mises = {name: solved.von_mises(name) for name in solved.load_cases}
    measures = {
        name: stress_measures(
            points,
            volumes,
            stress,
            phase,
            evaluated,
            limit=solid.stress_limit or np.inf,
            percentile=solid.percentile,
            cells=neighbourhood_cells(solid.design),
        )
        for name, stress in von_mises.items()
    }
    masses = volumes * solid.material.density * 1e6
    return ExplicitResult(
        solved=solved,
        von_mises=von_mises,
        measures=measures,
        phase=phase,
        exclusion=exclusion_zone(
            volumes,
            von_mises,
            phase,
            evaluated,
            zones=solid.support_zones,
            percentile=solid.percentile,
        ),
        yields=_yields(points, volumes, von_mises, solid),
        masses_g={name: float(masses[phase == number].sum()) for number, name in enumerate(PHASES)},
        volume=float(volumes.sum()),
        seconds=time.perf_counter() - began - solved.division.seconds,
    )


def _yields(
    points: FloatArray,
    volumes: FloatArray,
    von_mises: Mapping[str, FloatArray],
    solid: PrintedSolid,
) -> Yielding | None:
    """Stress above the yield strength; where nothing has any, supports are not looked at."""
    strength = solid.material.yield_strength
    if not any((stress > strength).any() for stress in von_mises.values()):
        return None
    free = undisturbed_at(points, solid.support_zones)
    return yielding(points, volumes, von_mises, free, strength)


def governing_load_case(result: ExplicitResult) -> str:
    """Load case with the largest judged stress; the first one where no stress is judged."""
    values = {name: [m.value for m in ms] for name, ms in result.measures.items() if ms}
    return max(values, key=lambda name: max(values[name]), default=result.solved.load_cases[0])

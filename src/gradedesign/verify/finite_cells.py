"""Explicit analysis of a lattice design by finite cells, beside that on tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.finite_cell.analysis import (
    Accuracy,
    FiniteCellResult,
    Problem,
    analyse,
    stress_sample,
)
from gradedesign.finite_cell.grid import Plane
from gradedesign.finite_cell.stress import von_mises
from gradedesign.lattice.domain import phase_at
from gradedesign.lattice.lattice import lattice_field
from gradedesign.verify.exclusion import ExclusionZone, exclusion_zone
from gradedesign.verify.measures import StressMeasure, stress_measures
from gradedesign.verify.neighbourhoods import neighbourhood_cells
from gradedesign.verify.phases import considered_at
from gradedesign.verify.printed_solid import PrintedSolid
from gradedesign.workspace.progress import report_step


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FiniteCellAnalysis:
    """Displacements and stresses of the design's field: an analysis that limits can read.

    Attributes
    ----------
    result : FiniteCellResult
    points : (3, m) array, mm
        Where stress is known: centroids of the solid in sub-cells of elements.
    volumes : (m,) array, mm^3
    von_mises : dict of load case to (m,) array, MPa
    measures : dict of load case to tuple of StressMeasure
    phase : (m,) int array
    exclusion : ExclusionZone
    """

    result: FiniteCellResult
    points: FloatArray
    volumes: FloatArray
    von_mises: dict[str, FloatArray]
    measures: dict[str, tuple[StressMeasure, ...]]
    phase: IntArray
    exclusion: ExclusionZone

    @property
    def work(self) -> dict[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm."""
        return self.result.work

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements where the solid reaches a region, ``(3, k)``, mm."""
        return self.result.region_displacement(region, load_case)

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of the solid, mm."""
        return self.result.largest_displacement(load_case)


def design_problem(judged: PrintedSolid, planes: tuple[Plane, ...] = ()) -> Problem:
    """The solid of a design with the loads and supports of its case.

    Parameters
    ----------
    judged : PrintedSolid
    planes : tuple of Plane
        Plane faces inside the part to lay grid planes on, beside those of the regions.
    """
    domain = judged.design.domain
    return Problem(
        field=lattice_field(judged.design),
        lower=domain.lower,
        upper=domain.upper,
        cases=judged.case.load_case,
        regions=judged.regions,
        material=judged.material,
        planes=planes,
        bodies=domain.bodies,
    )


def analyse_by_finite_cells(
    judged: PrintedSolid,
    spacing: float,
    *,
    accuracy: Accuracy | None = None,
    start: FiniteCellAnalysis | None = None,
) -> FiniteCellAnalysis:
    """Solve every load case on finite cells of a design and measure its stress.

    Parameters
    ----------
    judged : PrintedSolid
    spacing : float, mm
        Largest edge of an element.
    accuracy : Accuracy, optional
    start : FiniteCellAnalysis, optional
        Of an earlier design: where the iteration starts.

    Returns
    -------
    FiniteCellAnalysis

    Raises
    ------
    LatticeError
        If a loaded or supported region carries no lattice, or the lattice falls apart.
    SolverError
        If supports leave rigid motions free, or the iteration does not converge.
    """
    result = analyse(
        design_problem(judged),
        spacing,
        accuracy=accuracy or Accuracy(),
        start=start.result if start is not None else None,
    )
    report_step("stress measures")
    stress: dict[str, FloatArray] = {}
    for solution in result.solutions:
        sample = stress_sample(result, solution.name)
        stress[solution.name] = von_mises(sample.stress)
    points, volumes = sample.points, sample.volume
    phase = phase_at(judged.design.domain, points)
    considered = considered_at(points, judged.clamped, judged.exclusion_radius)
    # The measures take four values for each volume; here one value stands for all of it.
    fourfold = {
        name: np.broadcast_to(values[:, None], (values.size, 4)) for name, values in stress.items()
    }
    return FiniteCellAnalysis(
        result=result,
        points=points,
        volumes=volumes,
        von_mises=stress,
        measures={
            name: stress_measures(
                points, volumes, values, phase, considered,
                limit=judged.stress_limit or np.inf,
                percentile=judged.percentile,
                cells=neighbourhood_cells(judged.design),
            )
            for name, values in fourfold.items()
        },
        phase=phase,
        exclusion=exclusion_zone(
            volumes, fourfold, phase, considered,
            radius=judged.exclusion_radius,
            percentile=judged.percentile,
        ),
    )  # fmt: skip

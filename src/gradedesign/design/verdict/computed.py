"""Designs that a run has when it ends, and the fields of all that it computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.resolve.problem import Problem
from gradedesign.design.resolve.setup import Setup
from gradedesign.design.resolve.solid_stress import solid_field
from gradedesign.design.verdict.shown import Shown
from gradedesign.geometry.formats.field_set import FieldSet
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.stress import von_mises


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Computed:
    """Designs of a run.

    Attributes
    ----------
    rho : (M,) array or None
        Design that no analysis has judged.
    shown : Shown or None
        The analysed design that pictures and files show.
    iterations : sequence of DesignIteration
    """

    rho: FloatArray | None = None
    shown: Shown | None = None
    iterations: Sequence[DesignIteration] = ()

    @property
    def density(self) -> FloatArray | None:
        """Of every tetrahedron of the part ``(M,)``; None before sizing."""
        return self.rho if self.shown is None else self.shown.rho


def computed_fields(setup: Setup, computed: Computed) -> Iterator[FieldSet]:
    """Fields of the solid part before sizing, else of designs and of the analysed lattice."""
    problem, density = setup.problem, computed.density
    if density is None:
        yield _solid(problem, setup.solutions)
        return
    yield _density(problem, "density", density)
    for done in computed.iterations:
        yield _density(problem, "iteration", done.rho, number=done.summary.number)
    if computed.shown is not None:
        yield _lattice(computed.shown)


def _solid(problem: Problem, solid: Sequence[Solution]) -> FieldSet:
    """Displacement and stress of the fully solid part."""
    data: dict[str, FloatArray] = {}
    for load, solution in zip(problem.loads, solid, strict=True):
        data[f"displacement {solution.name} [mm]"] = solution.displacement
        stress = von_mises(solid_field(problem, load, solution).nodal)
        data[f"von_mises {solution.name} [MPa]"] = stress
    space = problem.space
    return FieldSet(name="solid", points=space.nodes, elements=space.elements, point_data=data)


def _density(
    problem: Problem, name: str, rho: FloatArray, *, number: int | None = None
) -> FieldSet:
    mesh = problem.space.mesh
    data = {
        "relative_density [-]": rho,
        "solid_volume_fraction [-]": problem.solid_fraction,
    }
    return FieldSet(
        name=name, points=mesh.points, elements=mesh.tets, element_data=data, number=number
    )


def _lattice(shown: Shown) -> FieldSet:
    """Displacement, stress and phase of the printed lattice."""
    result = shown.analysed.result
    sampled = {
        f"von_mises {name} [MPa]": values.mean(axis=1) for name, values in result.von_mises.items()
    }
    sampled["phase [0 lattice 1 skin 2 passive]"] = result.phase.astype(np.float64)
    solved = result.solved.volume_fields(sampled)
    return FieldSet(
        name="lattice",
        points=solved.points,
        elements=solved.elements,
        point_data=solved.point_data,
        element_data=solved.element_data,
    )

"""Designs that a run has when it ends, and the fields of all that it computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.resolve.solid_stress import solid_field
from gradedesign.design.verdict.shown import Shown
from gradedesign.geometry.formats.exporter import FieldSet
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.stress import von_mises
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, built_density
from gradedesign.mechanics.sizing.members import MemberField


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Computed:
    """Designs of a run."""

    rho: FloatArray | None = None  #: ``(M,)``. Design that no analysis has judged.
    members: MemberField | None = None  #: Of its solid members.
    shown: Shown | None = None  #: The analysed design that pictures and files show.
    iterations: Sequence[DesignIteration] = ()

    @property
    def density(self) -> FloatArray | None:
        """Of every tetrahedron of the part ``(M,)``; None before sizing."""
        return self.rho if self.shown is None else self.shown.rho

    @property
    def field(self) -> MemberField | None:
        """Of solid members; None without any."""
        return self.members if self.shown is None else self.shown.members


def computed_fields(
    part: HomogenisedModel, solid: Sequence[Solution], computed: Computed
) -> Iterator[FieldSet]:
    """Fields of the solid part before sizing, else of designs and of the analysed lattice."""
    density = computed.density
    if density is None:
        yield _solid(part, solid)
        return
    yield _density(part, "density", density)
    for done in computed.iterations:
        yield _density(part, "iteration", done.rho, number=done.summary.number)
    if computed.shown is not None:
        yield _lattice(computed.shown)


def _solid(part: HomogenisedModel, solid: Sequence[Solution]) -> FieldSet:
    """Displacement and stress of the fully solid part."""
    data: dict[str, FloatArray] = {}
    for load, solution in zip(part.cases, solid, strict=True):
        data[f"displacement {solution.name} [mm]"] = solution.displacement
        stress = von_mises(solid_field(part.space, part.material, load, solution).nodal)
        data[f"von_mises {solution.name} [MPa]"] = stress
    space = part.space
    return FieldSet(name="solid", points=space.nodes, elements=space.elements, point_data=data)


def _density(
    part: HomogenisedModel, name: str, rho: FloatArray, *, number: int | None = None
) -> FieldSet:
    mesh = part.space.mesh
    data = {
        "relative_density [-]": built_density(part, rho),
        "solid_volume_fraction [-]": part.solid_fraction,
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
    sampled["phase [0 lattice 1 skin 2 passive 3 members]"] = result.phase.astype(np.float64)
    solved = result.solved.volume_fields(sampled)
    return FieldSet(
        name="lattice",
        points=solved.points,
        elements=solved.elements,
        point_data=solved.point_data,
        element_data=solved.element_data,
    )

"""What the limits speak about: displacements of regions and their adjoint sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.errors import CaseError
from gradedesign.fe.assembly import strain_energy_per_element
from gradedesign.fe.element_means import body_force_work
from gradedesign.fe.load_case import PartLoadCase
from gradedesign.fe.solution import LoadVector, Solution
from gradedesign.fe.stiffness import Stiffness
from gradedesign.fe.stress import element_stress
from gradedesign.fe.supports import Supports
from gradedesign.sizing.homogenised import solid_slope
from gradedesign.sizing.homogenised_model import HomogenisedModel
from gradedesign.sizing.lattice_stiffness import as_stiffness, lattice_stiffness_derivative


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisplacementLimit:
    """The largest nodal displacement of a region must stay below a limit.

    Attributes
    ----------
    name : str
        Printed name, such as ``"tip magnitude"``.
    load_case : str
    nodes : (k,) int array
        Nodes of the region.
    component : int or None
        0, 1, 2 limits the absolute value of one component, None the magnitude.
    limit : float, mm
        Not a number where it is ``times_solid`` and the solid part is not analysed yet.
    factor : float
        Correction of the predicted value from explicit analyses; 1 at first.
    region : str
        Name of the region.
    times_solid : float or None
        Where the limit is stated relative to the fully solid part: the multiple of its value in
        the same load case.
    """

    name: str
    load_case: str
    nodes: IntArray
    component: int | None
    limit: float
    factor: float = 1.0
    region: str = ""
    times_solid: float | None = None

    def __post_init__(self) -> None:
        nodes = locked(self.nodes, (None,), dtype=np.int64, name="nodes")
        object.__setattr__(self, "nodes", nodes)
        if len(nodes) == 0:
            raise CaseError(
                f"displacement limit '{self.name}' has no nodes: its region is not on the mesh; "
                f"refine [part] mesh_size or choose another region"
            )

    @property
    def stated(self) -> str:
        """How the case states the limit where that is no length, such as ``2 x solid``."""
        return "" if self.times_solid is None else f"{self.times_solid:g} x solid"


def largest_displacement(
    displacement: FloatArray, nodes: IntArray, component: int | None
) -> tuple[float, int]:
    """Largest magnitude (or absolute component) over nodes, mm, and the node that has it."""
    u = displacement[:, nodes]
    values = np.linalg.norm(u, axis=0) if component is None else np.abs(u[component])
    k = int(np.argmax(values))
    return float(values[k]), int(nodes[k])


def displacement_values(
    limits: Sequence[DisplacementLimit], solutions: Sequence[Solution]
) -> FloatArray:
    """Corrected predicted value of every limit, mm."""
    by_name = {s.name: s for s in solutions}
    return np.array(
        [
            limit.factor
            * largest_displacement(
                by_name[limit.load_case].displacement, limit.nodes, limit.component
            )[0]
            for limit in limits
        ]
    )


def adjoint_loads(
    model: HomogenisedModel,
    limits: Sequence[DisplacementLimit],
    solutions: Sequence[Solution],
) -> tuple[LoadVector, ...]:
    """Unit loads whose work is the limited displacement, linearised at its present node."""
    by_name = {s.name: s for s in solutions}
    cases = {c.name: c for c in model.cases}
    loads = []
    for limit in limits:
        u = by_name[limit.load_case].displacement
        value, node = largest_displacement(u, limit.nodes, limit.component)
        force = np.zeros_like(u)
        if limit.component is None:
            force[:, node] = u[:, node] / value if value > 0 else 0.0
        else:
            force[limit.component, node] = 1.0 if u[limit.component, node] >= 0 else -1.0
        supports = cases[limit.load_case].supports
        loads.append(
            LoadVector(
                name=f"adjoint of {limit.name}",
                supports=Supports(fixed=supports.fixed, value=np.zeros_like(supports.value)),
                force=limit.factor * force,
            )
        )
    return tuple(loads)


def stiffness_derivative(model: HomogenisedModel, rho: FloatArray) -> Stiffness:
    """Derivative of the stiffness of every tetrahedron by its density, MPa."""
    share = 1 - model.solid_share
    return as_stiffness(model, share * lattice_stiffness_derivative(model, rho))


def displacement_gradient(
    model: HomogenisedModel,
    rho: FloatArray,
    derivative: Stiffness,
    case: PartLoadCase,
    solution: Solution,
    adjoint: Solution,
) -> FloatArray:
    """Derivative of one limited displacement by the density of every tetrahedron, ``(M,)``, mm.

    ``dg/drho = lambda^T (df/drho - dK/drho u)``, with inertia and thermal loads in f; `derivative`
    is that of `stiffness_derivative`.
    """
    gradient = -strain_energy_per_element(
        model.space, derivative, solution.displacement, adjoint.displacement
    )
    if np.any(case.acceleration):
        share = 1 - model.solid_share
        work = body_force_work(model.space, case.acceleration, adjoint.displacement)
        gradient = gradient + work * model.material.density * share * solid_slope(model, rho)
    if case.temperature_change:
        # The work of C alpha dT on the adjoint strain is that of alpha dT on its stress.
        expansion = model.material.thermal_expansion * case.temperature_change
        stress = element_stress(model.space, derivative, adjoint.displacement)
        gradient = gradient + model.volumes * expansion * np.trace(stress).mean(axis=-1)
    return gradient

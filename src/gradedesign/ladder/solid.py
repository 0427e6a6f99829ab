"""The fully solid part, which must hold every limit before any lattice is worth making."""

from __future__ import annotations

import numpy as np

from gradedesign.fe.loads import body_force, thermal_force
from gradedesign.fe.solution import LoadVector, Solution
from gradedesign.fe.solve import solve_elastic
from gradedesign.fe.stiffness import IsotropicStiffness
from gradedesign.fe.stress import element_von_mises, weighted_percentile
from gradedesign.ladder.setup import Setup
from gradedesign.ladder.verdict import LimitRow
from gradedesign.sizing.responses import displacement_values


def solve_solid(setup: Setup) -> tuple[Solution, ...]:
    """Displacements of the fully solid part in every load case."""
    material, space = setup.material, setup.space
    stiffness = solid_stiffness(setup)
    vectors = []
    for case in setup.model.cases:
        force = np.array(case.force)
        if np.any(case.acceleration):
            density = np.full(space.element_count, material.density)
            force += body_force(space, density, case.acceleration)
        if case.temperature_change:
            force += thermal_force(
                space, stiffness, material.thermal_expansion, case.temperature_change
            )
        vectors.append(LoadVector(name=case.name, supports=case.supports, force=force))
    return solve_elastic(space, stiffness, vectors)


def solid_stiffness(setup: Setup) -> IsotropicStiffness:
    """The base material in every tetrahedron."""
    return IsotropicStiffness(
        E=np.full(setup.space.element_count, setup.material.youngs_modulus),
        nu=setup.material.poissons_ratio,
    )


def solid_rows(setup: Setup, solutions: tuple[Solution, ...]) -> tuple[LimitRow, ...]:
    """Every limit with its value on the fully solid part."""
    values = displacement_values(setup.displacement_limits, solutions)
    rows = [
        LimitRow(
            name=f"displacement of {limit.name}",
            load_case=limit.load_case,
            value=float(value),
            limit=limit.limit,
            unit="mm",
            judged_by="solid part",
        )
        for limit, value in zip(setup.displacement_limits, values, strict=True)
    ]
    if setup.stress_limit is not None and setup.considered.any():
        stiffness = solid_stiffness(setup)
        weights = np.repeat((setup.model.volumes * setup.considered / 4.0)[:, None], 4, axis=1)
        worst = max(
            (
                weighted_percentile(
                    element_von_mises(
                        setup.space,
                        stiffness,
                        solution.displacement,
                        thermal_strain=setup.material.thermal_expansion * case.temperature_change,
                    ),
                    weights,
                    setup.case.limits.percentile,
                ),
                case.name,
            )
            for case, solution in zip(setup.model.cases, solutions, strict=True)
        )
        rows.append(
            LimitRow(
                name="stress in solid part",
                load_case=worst[1],
                value=worst[0],
                limit=setup.stress_limit,
                unit="MPa",
                judged_by="solid part",
            )
        )
    return tuple(rows)

"""The fully solid part, which must hold every limit before any lattice is worth making."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradedesign.errors import CaseError
from gradedesign.fe.load_case import load_vector
from gradedesign.fe.solution import Solution
from gradedesign.fe.solve import solve_elastic
from gradedesign.fe.stiffness import IsotropicStiffness
from gradedesign.fe.stress import element_von_mises, weighted_percentile
from gradedesign.ladder.displacement_limits import limit_key
from gradedesign.ladder.setup import Setup
from gradedesign.ladder.verdict import LARGEST_NODAL, LimitRow, percentile_words
from gradedesign.sizing.responses import (
    DisplacementLimit,
    displacement_values,
    largest_displacement,
)

#: A region that moves by less than this share of the part's largest displacement is at rest.
AT_REST = 1e-6


def solve_solid(setup: Setup) -> tuple[Solution, ...]:
    """Displacements of the fully solid part in every load case."""
    material, space = setup.material, setup.space
    stiffness = solid_stiffness(setup)
    density = np.full(space.element_count, material.density)
    vectors = [
        load_vector(space, case, stiffness, density, material.thermal_expansion)
        for case in setup.model.cases
    ]
    return solve_elastic(space, stiffness, vectors, solver=setup.model.solver)


def solid_stiffness(setup: Setup) -> IsotropicStiffness:
    """The base material in every tetrahedron."""
    return IsotropicStiffness(
        E=np.full(setup.space.element_count, setup.material.youngs_modulus),
        nu=setup.material.poissons_ratio,
    )


def with_solid(setup: Setup, solutions: tuple[Solution, ...]) -> Setup:
    """The setup with what the solid part shows: its rows, and limits relative to it resolved.

    Raises
    ------
    CaseError
        If a limit is relative to a region that does not move in the solid part.
    """
    by_name = {s.name: s for s in solutions}
    limits = tuple(
        _resolved(setup, limit, by_name[limit.load_case]) for limit in setup.displacement_limits
    )
    setup = replace(setup, displacement_limits=limits)
    return replace(setup, solid=solid_rows(setup, solutions))


def _resolved(setup: Setup, limit: DisplacementLimit, solution: Solution) -> DisplacementLimit:
    """A limit in mm: so many times what the region moves by in this load case when solid."""
    if limit.times_solid is None:
        return limit
    u = solution.displacement
    value, _ = largest_displacement(u, limit.nodes, limit.component)
    if value <= AT_REST * float(np.linalg.norm(u, axis=0).max()):
        raise CaseError(
            f"{setup.case.where(limit_key(setup.case, limit))}: found {limit.stated}, but "
            f"{limit.name} of the solid part is {value:.3g} mm in load case "
            f"'{limit.load_case}'; expected a region that moves there: state a length, or "
            f"name the load_case it is meant for"
        )
    return replace(limit, limit=limit.times_solid * value)


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
            measure=LARGEST_NODAL,
            stated=limit.stated,
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
                measure=percentile_words(setup.case.limits.percentile),
            )
        )
    return tuple(rows)

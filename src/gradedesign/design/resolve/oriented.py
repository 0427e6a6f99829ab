"""Cells whose axes follow directions: principal stresses, a formula, a field from outside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.common.values.value_types import Triple
from gradedesign.design.resolve.cell_choice import cell_axes
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.resolve import density_bounds
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.cell_layout import CellLayout, layout_warnings
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.placed_layout import graded_layout
from gradedesign.geometry.maps.cell_map import turned_axes
from gradedesign.geometry.maps.frame_field import frame_field, principal_angle
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.maps.map_report import spread
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.material.bond_matrix import bond_matrix
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


def oriented_frames(spec: LatticeSpec, part: Part, tensor_of: Field, where: Where) -> Field:
    """Smooth frames along principal directions in the box of a part."""
    corners = part.surface.vertices
    axes = turned_axes(spec.rotation)
    smooth = 1.0 if spec.orientation is None else spec.orientation.smooth
    with locating(where, "lattice.orientation"):
        return frame_field(
            tensor_of,
            corners.min(axis=0),
            corners.max(axis=0),
            length=smooth * spec.edges[0],
            start=axes.T,
        )


def constant_size(size: float) -> Field:
    """The size everywhere, mm."""
    return lambda points: np.full(np.shape(points)[1:], size)


def alignment(rotation: Triple, layout: CellLayout, tensor_of: Field) -> dict[str, Any]:
    """Angles between the largest principal direction and the nearest cell axis, plain data.

    Weighted by the principal value; beside it the same of straight cells, turned by ``rotation``.
    """
    points = layout.points
    tensor = tensor_of(points)
    start = turned_axes(rotation)
    straight = np.repeat(start[:, :, None], points.shape[1], axis=2)
    report = {}
    for name, axes in (
        ("angle_degrees", local_cells(layout.cell_map, points).axes),
        ("straight_angle_degrees", straight),
    ):
        angle, weight = principal_angle(axes, tensor)
        report[name] = asdict(spread(angle, weight))
    return report


def oriented(model: DesignModel) -> DesignModel:
    """The model with cells along the directions that its case states; unchanged without any.

    Raises CaseError if there is no direction to follow. Raises LatticeError if the map folds.

    ``model``: its solid part analysed, where cells follow the stress in that.
    """
    plan, cells, case = model.plan, model.cells, model.plan.case
    orientation = case.lattice.orientation
    if orientation is None:
        return model
    tensor_of = plan.directions or _solid_stress(
        model.homogenised, model.solutions, orientation.load_case
    )
    frames = oriented_frames(case.lattice, plan.part, tensor_of, case.where)
    if case.lattice.graded_size:
        # The map itself follows from the densities that sizing finds.
        return replace(model, cells=replace(cells, frames=frames))
    wanted = constant_size(case.lattice.edges[0])
    layout = graded_layout(case.lattice, case.where, plan.part, cells.layout.points, wanted, frames)
    report = {
        **layout.report,
        "orientation": alignment(case.lattice.rotation, layout, tensor_of),
    }
    bounds, _ = density_bounds(
        case.lattice, case.print, cells.cell, cells.law, layout.least, case.where
    )
    rotation = bond_matrix(cell_axes(layout, model.homogenised.space))
    return replace(
        model,
        cells=replace(
            cells,
            frames=frames,
            bounds=bounds,
            layout=replace(layout, typical=cells.layout.typical, report=report),
        ),
        homogenised=replace(model.homogenised, rotation=rotation),
        warnings=(*model.warnings, *layout_warnings(layout, cells.law.name)),
    )


def _solid_stress(part: HomogenisedModel, solutions: Sequence[Solution], name: str | None) -> Field:
    """Stress of the fully solid part in the load case that cells follow, by nearest element."""
    solved = [
        (case, solution)
        for case, solution in zip(part.cases, solutions, strict=True)
        if case.name == name
    ]
    if not solved:
        raise CaseError(f"the load case '{name}' that cells are to follow was not solved")
    case, solution = solved[0]
    stress = element_stress(
        part.space,
        dense_stiffness(part.space, part.material),
        solution.displacement,
        thermal_strain=part.material.thermal_expansion * case.temperature_change,
    ).mean(axis=-1)
    tree = cKDTree(centroids(part.space.mesh).T)

    def nearest(points: FloatArray) -> FloatArray:
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        _, element = tree.query(flat.T)
        return np.asarray(stress[:, :, element].reshape(3, 3, *np.shape(points)[1:]))

    return nearest

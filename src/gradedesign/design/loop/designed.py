"""The model with a design: cells whose size follows its density, and its solid members."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.locate import locating
from gradedesign.design.resolve.cell_choice import CellChoice, cell_axes
from gradedesign.design.resolve.design_model import DesignModel, counted_solid
from gradedesign.design.resolve.zoning import node_windows
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.components.members import solid_members
from gradedesign.geometry.lattice.density_grid import DensityGrid, density_grid_from_elements
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.graded_map import wanted_size
from gradedesign.geometry.lattice.placed_layout import graded_layout
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.material.bond_matrix import bond_matrix
from gradedesign.mechanics.sizing.density_beside_solids import density_beside_solids
from gradedesign.mechanics.sizing.filter import cone_mean
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, filter_weights
from gradedesign.mechanics.sizing.members import MemberField
from gradedesign.mechanics.sizing.solid_moments import solid_fraction

#: The density grid resolves a cell by this many nodes. Chosen, not measured.
NODES_PER_CELL = 4
#: Steps of the grid of members' surfaces along their least thickness: their filtered field is
#: smooth over that length. Chosen, not measured.
_STEPS = 4


def with_design(
    model: DesignModel,
    rho: FloatArray,
    members: MemberField | None = None,
    grid: DensityGrid | None = None,
) -> DesignModel:
    """The model with the cells of a design, where their size is graded, and its solid members.

    The homogenised part takes the axes of these cells: phase fields turn cells in order to keep
    their shape. What they shear is left to the correction. Members are a component of the lattice
    from here on, whose share of every tetrahedron is that of their bodies.

    Raises LatticeError if the map folds.

    ``rho (M,)``: density of every tetrahedron. ``members``: of its solid members. ``grid``: theirs
    by `member_grid`, where it is at hand.
    """
    plan, cells, part = model.plan, model.cells, model.homogenised
    case = plan.case
    spec, where = case.lattice, case.where
    if spec.graded_size:
        with locating(where, "lattice.size"):
            wanted = wanted_size(spec, cells.cell, density_grid(model, rho), cells.bounds)
        points = cells.layout.points
        layout = graded_layout(spec, where, plan.part, points, wanted, cells.frames)
        # One scale for filters and reports, whatever the design.
        layout = replace(layout, typical=cells.layout.typical)
        rotation = bond_matrix(cell_axes(layout, part.space))
        cells, part = replace(cells, layout=layout), replace(part, rotation=rotation)
    thickness = spec.least_member
    if members is not None and thickness is not None:
        mesh = part.space.mesh
        grid = grid or member_grid(model, members, thickness)
        body = solid_members(grid, thickness, members.offset)
        if body is not None:
            plan = replace(plan, domain=plan.domain.with_components([body]))
            moments = counted_solid(plan, cells.bounds, mesh)
            share = solid_fraction(moments)
            part = replace(
                part,
                solid_fraction=share,
                solid_moments=moments,
                member_fraction=np.maximum(share - part.solid_fraction, 0.0),
            )
            if spec.cells:
                part = _beside_members(part, cells, plan.domain)
    if part is model.homogenised:
        return model
    return replace(model, plan=plan, cells=cells, homogenised=part)


def member_grid(model: DesignModel, members: MemberField, thickness: float) -> DensityGrid:
    """Filtered variables of members, a half at their surface; less where a zone keeps them out."""
    report_step("surface of the solid members")
    part, zoning = model.homogenised, model.cells.zoning
    weight = None if zoning is None else zoning.member_weight
    mesh, spacing = part.space.mesh, thickness / _STEPS
    lower, upper = (end(mesh.points, axis=1) for end in (np.min, np.max))
    x, y, z = (int(n) for n in np.ceil((upper - lower) / spacing) + 2 * _STEPS + 1)
    origin = lower - thickness
    nodes = grid_points(origin, (0, 0, 0), (x, y, z), spacing).reshape(3, -1)
    values = cone_mean(
        centroids(mesh), filter_weights(part), members.radius, members.variables, nodes
    )
    if weight is not None:
        values = np.minimum(values, weight(nodes))
    return DensityGrid(
        origin=origin, spacing=spacing, values=np.clip(values, 0.0, 1.0).reshape(x, y, z)
    )


def _beside_members(
    part: HomogenisedModel, cells: CellChoice, domain: DesignDomain
) -> HomogenisedModel:
    """The homogenised part with the density of cells that members take room from."""
    if part.effective is None:
        return part
    effective = density_beside_solids(
        cells.layout.cell_map, part.space.mesh, cells.cell, cells.bounds, domain
    )
    return replace(part, effective=effective)


def density_grid(model: DesignModel, rho: FloatArray) -> DensityGrid:
    """The density field from which the lattice is built.

    Where zones have different bounds, the relative position of every density between its bounds is
    smoothed, so that the field keeps the local bounds.
    """
    report_step("density field")
    case = model.plan.case
    cell = case.lattice.cell_size
    spacing = min(cell / NODES_PER_CELL, case.part.element_size)
    mesh, margin, zoning = model.homogenised.space.mesh, 0.5 * cell, model.cells.zoning
    if zoning is None or zoning.windows is None:
        return density_grid_from_elements(mesh, rho, spacing=spacing, margin=margin)
    low, high = zoning.windows
    # An element whose bounds are equal gets the middle: it has no relative position.
    height = np.full(rho.size, 0.5)
    np.divide(rho - low, high - low, out=height, where=high > low)
    heights = density_grid_from_elements(
        mesh, np.clip(height, 0.0, 1.0), spacing=spacing, margin=margin
    )
    nodes = grid_points(heights.origin, (0, 0, 0), heights.values.shape, spacing)
    below, above = node_windows(zoning, nodes)
    return replace(heights, values=below + (above - below) * heights.values)

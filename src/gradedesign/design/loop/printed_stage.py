"""The whole printed surface by finite cells: how acceptance analyses it at any resolution."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import Event, Listener
from gradedesign.design.acceptance.whole_resolution import (
    RATIO,
    TIME_SHARE,
    finer_estimate,
    first_spacing,
    seconds,
    within_budgets,
)
from gradedesign.design.acceptance.whole_solid import WholeStage
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.resolve.cell_choice import CellChoice, cells_in_zones
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.planned_solid import planned_part, planned_solid
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cell_surface import CellSurface, cell_surface
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.geometry.triangles.printed_field import field_within, surface_search
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.mechanics.explicit.analysis import PlannedSolid, Resolution
from gradedesign.mechanics.explicit.explicit import ExplicitResult, analyse_printed_solid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS, ORDERS
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.modes import mode_room
from gradedesign.mechanics.limits.limit import Limit, mode_goals

#: The field is exact within this many elements of the surface. Farther samples change no element:
#: where an edge of a sub-cell's tetrahedra may cross the surface, second differences reach 0.96.
BAND = 1.0


def printed_stage(
    model: DesignModel,
    surface: SurfaceMesh,
    solid: PrintedSolid,
    result: ExplicitResult,
    rho: FloatArray,
    on_event: Listener,
) -> WholeStage:
    """Finite cells on the surface as read back from its file.

    The first spacing resolves walls and struts as the explicit analysis does, which found
    ``result``. ``rho`` is the density of every element of the part, from which the cost of a
    spacing follows.
    """
    return surface_stage(
        model.limits,
        model.plan.case.run,
        surface,
        solid,
        replace(planned_design(model, rho), volume=result.volume),
        spacing=min(
            first_spacing(model.plan.tools.analysis, result.mesh_size, cell)
            for cell, _, _ in cells_in_zones(model.cells)
        ),
        unknowns=result.solved.division.unknowns,
        on_event=on_event,
    )


def surface_stage(
    limits: Sequence[Limit],
    run: RunSpec,
    surface: SurfaceMesh,
    solid: PrintedSolid,
    planned: PlannedSolid,
    *,
    spacing: float,
    unknowns: int,
    on_event: Listener,
) -> WholeStage:
    """Finite cells on a closed surface, from a first spacing, mm, on.

    ``planned``: that surface, for the cost of a spacing. ``unknowns``: of an analysis whose result
    stays in memory meanwhile.
    """
    search, volume = surface_search(surface), enclosed_volume(surface)
    goals: dict[Hashable, DisplacementGoal] = {
        limit.key: goal for limit in limits if (goal := limit.goal()) is not None
    }

    def need(spacing: float) -> tuple[bool, str]:
        size = finer_estimate(planned, spacing, unknowns)
        return within_budgets(size, run.memory, run.time), (
            f"{size.unknowns / 1e6:.2g} M unknowns, about {size.memory_bytes / 1e9:.2g} of "
            f"{run.memory / 1e9:.3g} GB of [run] memory, and {seconds(size):.0f} s of "
            f"{TIME_SHARE * run.time:.0f} s, a sixth of [run] time"
        )

    def analyse(spacing: float) -> ExplicitResult:
        field = field_within(search, BAND * spacing)
        printed = replace(solid, field=field, volume=volume, goals=goals)
        return analyse_printed_solid(
            FINITE_CELLS,
            printed,
            Resolution(spacing=spacing),
            lambda message: on_event(Event(stage="acceptance", message=message)),
        )

    return WholeStage(
        analyse=analyse,
        spacing=spacing,
        ratio=RATIO,
        orders=ORDERS,
        judged_by="finite cells on the whole printed surface",
        need=need,
    )


def planned_design(model: DesignModel, rho: float | FloatArray) -> PlannedSolid:
    """Box, volume and surface of the solid that a design will have.

    ``rho``, float or (M,) array: relative density of the lattice, for every element of the part.
    """
    plan, homogenised = model.plan, model.homogenised
    latticed = homogenised.lattice_volumes
    weights = latticed / max(float(latticed.sum()), 1e-300)
    density = np.broadcast_to(np.asarray(rho, dtype=np.float64), weights.shape)
    part = planned_part(
        plan.part.surface,
        plan.domain,
        latticed=float(latticed.sum()),
        solid=float(homogenised.volumes @ homogenised.solid_fraction),
        load_cases=len(plan.case.load_case),
        goals=sum(limit.goal() is not None for limit in model.limits),
        modes=mode_room(mode_goals(model.limits).values()),
    )
    surfaces = CellSurface(np.zeros(weights.shape), np.zeros(weights.shape))
    for cell, here in _elements_by_cell(model.cells, homogenised.space.mesh):
        of_cell = cell_surface(cell, density[here], model.cells.layout.typical)
        surfaces.projections[here], surfaces.curvature[here] = of_cell
    mean = CellSurface(weights @ surfaces.projections, weights @ surfaces.curvature)
    return planned_solid(part, float(weights @ density), mean)


def _elements_by_cell(cells: CellChoice, mesh: TetMesh) -> list[tuple[Cell, BoolArray | slice]]:
    """Cells with the elements that they fill; in a transition that of the heaviest zone."""
    if cells.zoning is None:
        return [(cells.cell, slice(None))]
    zones = cells.zoning.weights(centroids(mesh)).argmax(axis=0)
    numbers = np.array([zone.cell for zone in cells.zoning.zones])[zones]
    return [(cell, numbers == k) for k, cell in enumerate(cells.zoning.cells.members)]

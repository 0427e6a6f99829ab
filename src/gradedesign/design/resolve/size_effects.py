"""Size effects in sizing: the walls of few cells that are computed, and why others are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import Event, Listener, ignore, report_step
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.thin_walls import median_thickness
from gradedesign.design.resolve.zones import zone_lattice
from gradedesign.errors import ResourceError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.part.part import Part
from gradedesign.mechanics.limits.cell_buckling import KIND as BUCKLING
from gradedesign.mechanics.sizing.density_beside_solids import density_beside_solids
from gradedesign.mechanics.sizing.wall_cells import (
    RESOLUTIONS,
    wall_factors,
    wall_material,
    wall_resolution,
)
from gradedesign.mechanics.sizing.wall_kinds import wall_faces

#: Walls are modelled, or a warning is given, where half of the lattice has fewer cells than this
#: across. Thicker parts are predicted better as a periodic lattice.
_FEW_CELLS = 3.0
#: Cells that two free faces cost together. Struts in a face are halves, bent at a seventh of the
#: stiffness, and joints there have no neighbour; shear vanishes at the faces. Of frames of simple
#: cubic struts, waves of eight cells along walls of 1, 2, 3, 4 and 6 cells keep 0.38, 0.62, 0.76,
#: 0.84 and 0.91 of the periodic frame's critical stress; with 1.5 it is 0.40, 0.57, 0.67, 0.73
#: and 0.80. Longer waves bend the wall as a plate: that is buckling of the part.
_LOST = 1.5


def why_periodic(
    case: Case,
    law_kind: str,
    cell: Cell,
    low: float,
    part: Part,
    domain: DesignDomain,
    layout: CellLayout,
) -> str:
    """Reason why sizing takes the lattice for a periodic one everywhere; empty where it need not.

    ``law_kind``: of the `ScalingLaw`. ``low``: least relative density that sizing may choose.
    """
    lattice = case.lattice
    heated = [load.name for load in case.load_case if load.temperature_change]
    if not lattice.size_effects:
        return "the case switches size effects off"
    if domain.ties_faces:
        return "a skin ties the cells at the faces, and only free faces are computed"
    own = [zone_lattice(lattice, zone, k, case.where)[0] for k, zone in enumerate(case.zone)]
    if any((o.cell, o.parameters) != (lattice.cell, lattice.parameters) for o in own):
        return "cells differ from zone to zone, and only walls of one cell are computed"
    if not _straight(lattice):
        return "only cubic cells of one size in a straight grid are computed"
    if heated:
        return f"thermal forces in walls of few cells are not computed (load case '{heated[0]}')"
    if law_kind != "computed":
        return "its law was not computed on the periodic cell, to which walls are compared"
    if wall_resolution(cell, low) is None:
        return (
            f"walls of cell '{cell.name}' at density {low:.3g} are too thin for "
            f"{RESOLUTIONS[-1]} voxels along a cell"
        )
    across = median_thickness(case.lattice.rotation, part, layout) / layout.least
    if across >= _FEW_CELLS:
        return f"half of the lattice has {across:.2g} cells across or more"
    return ""


def _straight(lattice: LatticeSpec) -> bool:
    """Whether the cells are cubic, of one size and in a straight grid."""
    curved = lattice.cell_map is not None or lattice.warp or lattice.orientation
    return not curved and len(lattice.size) == 1


def periodic_warnings(
    lattice: LatticeSpec, part: Part, layout: CellLayout, reason: str
) -> tuple[str, ...]:
    """Warning on walls of few cells that sizing takes for a periodic lattice.

    Nothing where the case switches it off, where half of the lattice has `_FEW_CELLS` cells across,
    or less than one, which `thin_wall_warnings` tells.
    """
    median = median_thickness(lattice.rotation, part, layout)
    if median < layout.least or median >= _FEW_CELLS * layout.least:
        return ()
    if not reason or not lattice.size_effects:
        return ()
    return (
        f"half of the lattice lies where the part is no thicker than {median:.3g} mm, "
        f"{median / layout.least:.2g} times its cells, but sizing takes it for a periodic lattice, "
        f"since {reason}: the first prediction may be far off, and explicit analyses correct it",
    )


def with_size_effects(model: DesignModel, on_event: Listener = ignore) -> DesignModel:
    """The model with size effects, and warnings where they are left out.

    Cells that free faces cut buckle earlier, whether or not their walls are computed.

    Beside walls, cells are as full as passive regions leave them: a sleeve in the void of a cell
    leaves its struts whole, in less room.

    ``model``: with its cells laid out for good. ``on_event``: receives the warnings, and the walls
    that are not in the user's cache.
    """
    plan, cells, homogenised = model.plan, model.cells, model.homogenised
    case, part, domain, layout = plan.case, plan.part, plan.domain, cells.layout
    low = cells.bounds[0]
    reason = why_periodic(case, cells.law.kind, cells.cell, low, part, domain, layout)
    warnings = periodic_warnings(case.lattice, part, layout, reason)
    mesh, latticed = homogenised.space.mesh, homogenised.solid_fraction < 1
    judged = any(limit.key.kind == BUCKLING.name for limit in model.limits)
    cut = judged and case.lattice.size_effects and not domain.ties_faces
    faces = None
    if _straight(case.lattice) and (cut or not reason):
        report_step("walls of few cells")
        faces = wall_faces(layout.cell_map, part, domain, mesh, latticed)
    if faces is not None and not reason:
        walls, warnings = wall_factors(
            layout.cell_map,
            mesh,
            latticed,
            faces,
            wall_material(cells.cell, cells.bounds, plan.material.poissons_ratio),
            lambda wall: on_event(
                Event(stage="walls", message=f"computing {wall}; later runs find it in the cache")
            ),
        )
        if walls.classes:
            homogenised = replace(homogenised, walls=walls)
            try:
                if domain.solids:
                    effective = density_beside_solids(
                        layout.cell_map, mesh, cells.cell, cells.bounds, domain
                    )
                    homogenised = replace(homogenised, effective=effective)
            except ResourceError as error:
                warnings = (*warnings, str(error))
    if cut:
        if faces is not None:
            across = np.where(faces[1], faces[0][1] - faces[0][0], np.inf).min(axis=0)
        else:
            # Faces of walls are not found along curved or graded cells: all count as one wall.
            thickness = median_thickness(case.lattice.rotation, part, layout)
            across = np.full(latticed.size, thickness / max(case.lattice.size))
        homogenised = replace(homogenised, cut_share=_share_between_faces(across))
    for warning in warnings:
        on_event(Event(stage="warning", message=warning))
    return replace(model, homogenised=homogenised, warnings=(*model.warnings, *warnings))


def _share_between_faces(across: FloatArray) -> FloatArray:
    """Share of the critical stress that is left with so many cells between two free faces.

    ``N / (N + LOST)`` with N cells across the thinnest wall that a tetrahedron lies in, 1 where it
    lies in none.
    """
    return np.asarray(1 / (1 + _LOST / across))

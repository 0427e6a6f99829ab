"""The printed solid, measured for how it is made: overhangs, islands, voids, rims."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.direction import FRAMES
from gradedesign.design.printing.feather_edges import FeatherEdges, feather_edges
from gradedesign.design.printing.layer_islands import LayerIslands, layer_islands
from gradedesign.design.printing.overhang import Overhang, overhang
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.printing.voids import (
    BYTES_PER_VOXEL,
    STEPS_PER_THROAT,
    Voids,
    measure_voids,
)
from gradedesign.design.printing.wall_thickness import WallThickness
from gradedesign.geometry.triangles.grid_classifier import grid_around, solid_voxels
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Voxels of the part's box where nothing that is stated asks for more. Chosen, not measured.
VOXELS = 2_000_000
#: No index of a voxel is larger.
MOST_VOXELS = 2**31 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Printability:
    """Measures of the printed solid as a print: overhangs, islands, voids, thickness."""

    build_direction: str
    thickness: WallThickness
    overhang: Overhang
    islands: LayerIslands
    voids: Voids
    feathers: FeatherEdges | None  #: Where the case states the thinnest wall.


def grid_step(spec: PrintSpec, extent: FloatArray) -> tuple[float, int, float]:
    """Voxel that the checks of a part take, mm, empty voxels around it, and their memory, bytes.

    ``extent``, (3,) array, mm: edges of the part's box.
    """
    throats = [t for t in (spec.min_throat, spec.limits.pore_throat) if t is not None]
    step = float(np.prod(extent) / VOXELS) ** (1.0 / 3.0)
    step = min([step, *(t / STEPS_PER_THROAT for t in throats)])
    margin = int(np.ceil(0.5 * max(throats, default=0.0) / step)) + 3
    count = float(np.prod(np.ceil(extent / step) + 2 * margin))
    return step, margin, count * BYTES_PER_VOXEL


def measure_printability(
    surface: SurfaceMesh, part: SurfaceMesh, spec: PrintSpec, thickness: WallThickness
) -> Printability:
    """Measure a printed solid for how it is made.

    ``surface``: the printed solid, closed. ``part``: the fully solid part, in which voids are
    looked for. ``thickness``: of ``surface``.
    """
    frame = np.array(FRAMES[spec.build_direction], dtype=np.float64)
    report_step("overhangs")
    hanging = overhang(surface, frame[2], spec.overhang_angle)
    report_step("voxels of the printed solid")
    step, margin, _ = grid_step(spec, np.ptp(part.vertices, axis=0))
    grid = grid_around(part, frame, step, margin)
    solid = solid_voxels(surface, grid)
    report_step("islands of its layers")
    islands = layer_islands(solid, grid)
    report_step("ways out of its voids, feather edges")
    voids = measure_voids(surface, solid, solid_voxels(part, grid), grid, spec.min_throat)
    return Printability(
        build_direction=spec.build_direction,
        thickness=thickness,
        overhang=hanging,
        islands=islands,
        voids=voids,
        feathers=None if spec.min_wall is None else feather_edges(surface, spec.min_wall),
    )

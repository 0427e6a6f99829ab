"""A closed surface with the specification of the mesh of its inside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.worker import Option
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_volume,
    unbalanced_edge_count,
)

#: Quality at which fTetWild stops improving (AMIPS energy). fTetWild's own default (Hu et al.
#: 2020).
STOP_ENERGY = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshQuestion:
    """A surface, moved to the origin, with the specification of its mesh."""

    vertices: FloatArray
    faces: NDArray[np.int32]
    centre: FloatArray
    options: Mapping[str, Option]
    volume: float
    volume_tolerance: float
    subject: str


def mesh_question(
    surface: SurfaceMesh,
    edge_length: float,
    epsilon: float,
    volume_tolerance: float,
) -> MeshQuestion:
    """Refuse surfaces that would crash the mesher or give a meaningless mesh; move to the origin.

    Raises
    ------
    MeshError
    """
    for name, value in (("edge length", edge_length), ("epsilon", epsilon)):
        if not (value > 0.0 and np.isfinite(value)):
            raise MeshError(f"the {name} of a mesh must be positive, not {value} mm")
    if len(surface.faces) == 0:
        raise MeshError("the surface has no triangles, so there is nothing to mesh")
    open_edges = unbalanced_edge_count(surface)
    if open_edges:
        raise MeshError(
            f"the surface is not closed: {open_edges} edges lack a neighbour of opposite "
            "direction, so it encloses no volume; repair it first"
        )
    volume = enclosed_volume(surface)
    if not volume > 0.0:
        raise MeshError(
            f"the surface encloses {volume:.6g} mm^3, expected a positive volume; its triangles "
            "must be counter-clockwise seen from outside"
        )
    corners = surface.vertices[np.unique(surface.faces)]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    diagonal = float(np.linalg.norm(upper - lower))
    centre = 0.5 * (lower + upper)
    return MeshQuestion(
        vertices=surface.vertices - centre,
        faces=surface.faces.astype(np.int32),
        centre=centre,
        options={
            "edge_length": edge_length,
            "relative_epsilon": epsilon / diagonal,
            "stop_energy": STOP_ENERGY,
        },
        volume=volume,
        volume_tolerance=volume_tolerance,
        subject=f"a surface of {len(surface.faces)} triangles, {diagonal:.4g} mm across, with "
        f"edges of {edge_length:.4g} mm and epsilon {epsilon:.4g} mm",
    )

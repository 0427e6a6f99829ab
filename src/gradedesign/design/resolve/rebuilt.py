"""A closed surface from damaged triangles: the zero level of their signed distance on a grid."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.triangles.distance_grid import distance_grid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Empty grid steps around the part, so that its surface closes.
_MARGIN = 3
#: Bytes a node that the distance and its surface take.
_BYTES_PER_NODE = 12
#: Grid steps along the longest edge of the part, at least. Chosen, not measured.
_LEAST_STEPS = 10


def rebuilt(
    surface: SurfaceMesh, spacing: float, *, memory_limit_bytes: int, where: str
) -> SurfaceMesh:
    """Closed surface where the signed distance to triangles vanishes.

    Inside is where they wind around a point by more than one half. Faces move by a part of the
    spacing where they are curved, edges are chamfered by half of it, and what is thinner than two
    steps may be lost.

    Parameters
    ----------
    surface : SurfaceMesh
        With holes, doubled or turned triangles, or parts that pass through each other.
    spacing : float, mm
        Of the grid.
    where : str
        The key of the case, for messages.

    Raises
    ------
    CaseError
        If the grid is as coarse as the part.
    ResourceError
        If the grid takes more memory.
    """
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    if (upper - lower).max() < _LEAST_STEPS * spacing:
        raise CaseError(
            f"{where}: found a spacing of {spacing:g} mm for a part of "
            f"{' x '.join(f'{e:.4g}' for e in upper - lower)} mm; expected a {_LEAST_STEPS}th of "
            f"its longest edge at most"
        )
    # Half a spacing off the part's own planes, which often lie at round numbers.
    origin = lower - (_MARGIN + 0.5) * spacing
    steps = np.ceil((upper - origin) / spacing) + _MARGIN + 1
    need = _BYTES_PER_NODE * float(steps.prod())
    if need > memory_limit_bytes:
        raise ResourceError(
            f"{where}: a grid of {spacing:g} mm takes {need / 1e9:.3g} GB; found run.memory of "
            f"{memory_limit_bytes / 1e9:.3g} GB; raise it or take a larger spacing"
        )
    x, y, z = (int(n) for n in steps)
    report_step("signed distance of the triangles")
    values = distance_grid(surface, origin, spacing, (x, y, z))

    def field(points: FloatArray) -> FloatArray:
        index = (np.asarray(points).reshape(3, -1) - origin[:, None]) / spacing
        distances = map_coordinates(values, index, order=1, mode="nearest", output=np.float64)
        return np.asarray(distances).reshape(points.shape[1:])

    # The surface's nodes lie half a spacing below the box that it is cut at.
    return extract_surface(field, origin + 1.5 * spacing, origin + (steps - 2.0) * spacing, spacing)

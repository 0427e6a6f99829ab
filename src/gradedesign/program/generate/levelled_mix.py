"""A mix of cells with the level that gives every cell its density."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.design.case.generate_schema import GenerateCase
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.local_level import local_level

#: Places along a cell at which a mix looks up its share: one in every block of `local_level`.
PLACES_PER_CELL = 12


def levelled_mix(
    case: GenerateCase,
    mix: tuple[Field, int, Field],
    cell_map: Field,
    density: DensityGrid | float,
    domain: DesignDomain,
) -> tuple[Field, Field, dict[str, float]]:
    """Shape and map of a mix whose level varies by place, and its errors of density.

    ``mix`` is its shape function of cell coordinates and share, its period in cells, and the share
    at points ``(3, ...)`` mm. The map adds the share and the excess of the level as fourth and
    fifth coordinates.
    """
    shape, period, share = mix
    spacing = case.lattice.cell_size / PLACES_PER_CELL
    count = np.ceil((domain.upper - domain.lower) / spacing).astype(np.int64)
    x, y, z = (int(n) for n in count)
    middles = domain.lower + 0.5 * spacing
    points = grid_points(middles, (0, 0, 0), (x, y, z), spacing).reshape(3, -1)
    points = np.minimum(points, domain.upper[:, None])
    rho = evaluate(density, points) if isinstance(density, DensityGrid) else density
    places = cell_map(points), share(points), np.broadcast_to(rho, points.shape[1:])
    found = local_level(shape, period, places, memory_limit_bytes=case.run.memory)

    def levelled(u: FloatArray) -> FloatArray:
        return shape(u) if len(u) < 5 else shape(u[:4]) - u[4]

    def mapped(points: FloatArray) -> FloatArray:
        u = cell_map(points)
        return np.concatenate([u, share(points)[None], found.at(u)[None]])

    return (
        levelled,
        mapped,
        {
            "cell_density_error_before": found.before,
            "cell_density_error": found.error,
        },
    )

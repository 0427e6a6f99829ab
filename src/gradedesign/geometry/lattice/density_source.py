"""From a stated density, a function of place, to the grid a lattice is built from."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import distance_transform_edt

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.errors import DensityError, ResourceError
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.banded_distance import banded_distance
from gradedesign.geometry.lattice.density_grid import DensityGrid

#: Relative density of points (3, ...) in mm, ``(...)``. Evaluated only inside the part and near it.
DensitySource: TypeAlias = Field

#: Nodes of the largest density grid. 6.4 GB at `_BYTES_PER_NODE`.
MOST_NODES = 64_000_000
#: Memory for a node: its place twice, distance, density twice, the nearest node with a value.
_BYTES_PER_NODE = 100
#: Nodes this many spacings outside the part still share in the density inside. Chosen, not
#: measured.
_REACH = 2.0
#: Points that are evaluated at a time. Bounds the memory of one step; the result does not depend on
#: it. Chosen, not measured.
_BATCH = 1 << 20


def sample_density(
    source: DensitySource,
    distance: Field,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    spacing: float,
    window: tuple[float, float],
    quantity: str,
    memory_limit_bytes: int = 8_000_000_000,
) -> DensityGrid:
    """Sample a density source on a grid that covers a part, and check it.

    Inside the part every value must be finite and inside the window. Beyond the part, where only
    trimmed material lies, the density is the source's, clipped to its range inside the part; where
    the source is not finite, that of the nearest node with a value.

    Raises DensityError if a value inside is not finite or outside the window: its range and a
    place. Raises ResourceError if the grid would be too large.

    - ``source``: points ``(3, n)`` mm to relative density ``(n,)``
    - ``distance``: signed distance of the part
    - ``lower (3,)``, ``upper (3,)``, mm: the part's box; a layer of nodes lies on ``lower``
    - ``spacing``, mm
    - ``window``: densities that are allowed
    - ``quantity``: names the source in messages, such as ``"density formula"``
    - ``memory_limit_bytes``: what the grid may take
    """
    start = np.asarray(lower, dtype=np.float64) - 2 * spacing
    extent = np.asarray(upper, dtype=np.float64) - start
    shape = np.ceil(extent / spacing - 1e-9) + 3
    most = min(MOST_NODES, memory_limit_bytes / _BYTES_PER_NODE)
    if not shape.prod() <= most:  # also where it is not finite
        raise ResourceError(
            f"the density grid at {spacing:g} mm has {shape.prod():.3g} nodes, more than the "
            f"{most:.3g} that run.memory of {memory_limit_bytes / 1e9:.3g} GB allows, or than "
            f"{MOST_NODES:.3g}; use larger cells or a smaller part, or raise run.memory"
        )
    x, y, z = (int(n) for n in shape)
    points = grid_points(start, (0, 0, 0), (x, y, z), spacing).reshape(3, -1)
    reach = _REACH * spacing
    near_part = banded_distance(
        distance, lower, upper, spacing=4 * spacing, inner=spacing, outer=reach
    )
    depth = near_part(points)
    inside = depth <= 1e-6 * spacing
    if not inside.any():
        inside = depth <= reach
    near = (depth <= reach) | inside
    values = np.full(points.shape[1], np.nan)
    values[near] = _source_values(source, points[:, near], quantity)
    _require_window(values, inside, points, window, quantity)
    values = _continued(values.reshape(x, y, z), inside.reshape(x, y, z))
    return DensityGrid(origin=start, spacing=spacing, values=values)


def _source_values(source: DensitySource, points: FloatArray, quantity: str) -> FloatArray:
    """Values of a source, batch by batch."""
    result = np.zeros(points.shape[1])
    for low in range(0, points.shape[1], _BATCH):
        part = slice(low, low + _BATCH)
        value = np.asarray(source(points[:, part]), dtype=np.float64)
        if value.shape != result[part].shape:
            raise DensityError(
                f"the {quantity} returned shape {value.shape} for points "
                f"{points[:, part].shape}, expected {result[part].shape}"
            )
        result[part] = value
    return result


def _require_window(
    values: FloatArray,
    inside: BoolArray,
    points: FloatArray,
    window: tuple[float, float],
    quantity: str,
) -> None:
    """Refuse a density that is not finite or not allowed somewhere inside the part."""
    within, where = values[inside], points[:, inside]
    finite = np.isfinite(within)
    if not finite.all():
        x, y, z = where[:, int(np.argmin(finite))]
        raise DensityError(
            f"the {quantity} is not finite at {np.count_nonzero(~finite)} of {finite.size} "
            f"points inside the part, first at ({x:g}, {y:g}, {z:g}) mm"
        )
    low, high = window
    if within.min() >= low - 1e-9 and within.max() <= high + 1e-9:
        return
    ends = []
    for name, at in (("lowest", within.argmin()), ("highest", within.argmax())):
        x, y, z = where[:, int(at)]
        ends.append(f"{name} {within[at]:.4g} at ({x:.4g}, {y:.4g}, {z:.4g}) mm")
    raise DensityError(
        f"the {quantity} asks for {', '.join(ends)}; allowed are {low:.4g} to {high:.4g}; "
        f"change the map or take another cell"
    )


def _continued(values: FloatArray, inside: BoolArray) -> FloatArray:
    """Fill nodes without a finite value from the nearest one, within the range inside the part."""
    low, high = float(values[inside].min()), float(values[inside].max())
    finite = np.isfinite(values)
    if not finite.all():
        i, j, k = distance_transform_edt(~finite, return_distances=False, return_indices=True)
        values = values[i, j, k]
    return np.clip(values, low, high)

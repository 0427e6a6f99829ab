"""Cell size from relative density: walls of one thickness, or size and wall together.

With ``r = wall / size`` the density of a cell fixes r, and a grading says which of wall and size
follows: the size kept (the wall is ``r size``), the wall kept (``size = wall / r``, "by length"),
or both changing, small cells where it is dense ("by ratio").
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.maps._phase_kernels import centre_gradients, divergence, nearest_rotations

#: Rounding that is not held against a density or a ratio at the end of its range.
_SLACK = 1e-6


def wall_ratio(cell: Cell, rho: FloatArray | float) -> FloatArray:
    """Thinnest wall over cell size at a relative density ``(...)``, from its calibration.

    Raises DensityError if a density is outside the cell's window.
    """
    return wall_mm(cell, rho, 1.0)


def size_for_wall(
    ratio: FloatArray | float, wall: float, limits: tuple[float, float] | None = None
) -> FloatArray:
    """Cell size at which walls of one thickness give the ratio, ``wall / ratio``.

    Returns (...) array, mm. Raises CaseError if the wall is not positive. Raises DensityError if a
    ratio is not positive, or a size is outside the limits.

    ``ratio (...)``: wall over size. ``wall``, mm. ``limits``, mm: least and largest size that may
    come out.

    References
    ----------
    Ramirez Salazar 2022, 3.2.3, scenario "length".
    """
    if not (np.isfinite(wall) and wall > 0):
        raise CaseError(f"the wall is {wall:g} mm; use a positive thickness")
    r = np.asarray(ratio, dtype=np.float64)
    if not (r > 0).all():
        raise DensityError(
            f"wall over cell size goes down to {r.min():g}: no cell is that light with a wall of "
            f"{wall:g} mm; raise the lower density bound"
        )
    size = wall / r
    if limits is not None and not _within(size, limits):
        raise DensityError(
            f"walls of {wall:g} mm need cells of {size.min():.4g} to {size.max():.4g} mm at the "
            f"densities asked for, but {limits[0]:g} to {limits[1]:g} mm are allowed; narrow the "
            f"densities, or change the wall or the sizes"
        )
    return np.asarray(size)


def size_by_ratio(
    ratio: FloatArray | float, sizes: tuple[float, float], ratios: tuple[float, float]
) -> FloatArray:
    """Cell size that falls as the wall grows, ``1/L`` linear in the ratio.

    Returns (...) array, mm. Raises CaseError if a range is empty. Raises DensityError if a ratio is
    outside its range.

    ``ratio (...)``: wall over size; the wall is then ``ratio * size``. ``sizes``, mm: smallest
    cell, at the largest ratio, and largest cell, at the smallest. ``ratios``: smallest and largest
    ratio.

    References
    ----------
    Ramirez Salazar 2022, eq. 3.15.
    """
    (small, large), (least, most) = sizes, ratios
    if not 0 < small <= large < np.inf:
        raise CaseError(
            f"cell sizes from {small:g} to {large:g} mm; expected 0 < smallest <= largest"
        )
    if not 0 <= least < most < np.inf:
        raise CaseError(
            f"wall over cell size from {least:g} to {most:g}; expected two different numbers, the "
            f"smaller first: give a range of densities"
        )
    r = np.asarray(ratio, dtype=np.float64)
    _require_within(r, ratios, "wall over cell size")
    share = np.clip((most - r) / (most - least), 0.0, 1.0)
    return np.asarray(1 / (1 / small + (1 / large - 1 / small) * share))


def densities_for_sizes(
    cell: Cell,
    wall: float,
    sizes: tuple[float, float],
) -> tuple[float, float]:
    """Densities at which walls of one thickness give a cell size within limits.

    Returns (float, float). Raises DensityError if no density of the cell does.

    ``wall``, mm. ``sizes``, mm: least and largest.
    """
    density = np.linspace(*cell.window, 4001)
    ratio = wall_ratio(cell, density)
    fits = (ratio >= wall / sizes[1]) & (ratio <= wall / sizes[0])
    if not fits.any():
        possible = wall / ratio[ratio > 0]
        raise DensityError(
            f"walls of {wall:g} mm make cells of '{cell.name}' between {possible.min():.4g} and "
            f"{possible.max():.4g} mm large, but {sizes[0]:g} to {sizes[1]:g} mm are allowed; "
            f"change the wall or the sizes"
        )
    return float(density[fits][0]), float(density[fits][-1])


def size_field_for_wall(
    density: Field,
    cell: Cell,
    wall: float,
    limits: tuple[float, float] | None = None,
) -> Field:
    """Cell size field that keeps the wall, points ``(3, ...)`` mm to ``(...)`` mm.

    Parameters are those of `wall_ratio` and `size_for_wall`; ``density`` maps points to relative
    densities. The field raises what they raise.
    """

    def size_of(points: FloatArray) -> FloatArray:
        return size_for_wall(wall_ratio(cell, density(points)), wall, limits)

    return size_of


def size_field_by_ratio(
    density: Field,
    cell: Cell,
    sizes: tuple[float, float],
    densities: tuple[float, float],
) -> Field:
    """Cell size field by the ratio rule, points ``(3, ...)`` mm to ``(...)`` mm.

    Parameters are those of `wall_ratio` and `size_by_ratio`; ``densities`` are the lowest, with
    the largest cells, and the highest.
    """
    least, most = (float(wall_ratio(cell, rho)) for rho in densities)

    def size_of(points: FloatArray) -> FloatArray:
        return size_by_ratio(wall_ratio(cell, density(points)), sizes, (least, most))

    return size_of


def _within(values: FloatArray, limits: tuple[float, float]) -> bool:
    """Whether all values, up to rounding, lie between the limits."""
    slack = _SLACK * abs(limits[1])
    return bool(((values >= limits[0] - slack) & (values <= limits[1] + slack)).all())


def _require_within(values: FloatArray, limits: tuple[float, float], quantity: str) -> None:
    """Refuse values outside a range."""
    if not _within(values, limits):
        raise DensityError(
            f"{quantity} goes from {values.min():.4g} to {values.max():.4g}, expected "
            f"{limits[0]:.4g} to {limits[1]:.4g}; narrow the densities"
        )


#: Allowed deviations of a cell: of its size, relative, and of its axes from the nearest
#: right-angled frame, rad. Met as far as least squares go, 95 % of volume then lie within 5 % and
#: 3 degrees.
_SIZE_TOLERANCE, _ANGLE_TOLERANCE = 0.02, np.radians(0.9)
#: Passes, and by how much each oversteps the way to the tolerances. Chosen, not measured.
PASSES, _OVERSTEP = 60, 1.8
#: Sizes that most of a map misses by more than this no continuous map follows: there, tolerances
#: only trade shear for size. Chosen, not measured.
NEAR, NEAR_SHARE = 0.10, 0.95
#: Elements up to which the passes are worth their time, 13 s of one processor for 90,000.
MOST_ELEMENTS = 250_000
#: With this many axes within 5 % of their size there is nothing to weigh. Chosen, not measured.
_KEPT_SHARE = 0.97


def within_tolerance(
    phases: FloatArray,
    rotation: FloatArray,
    size: FloatArray,
    steps: FloatArray,
    solve: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Phases whose cells keep to the tolerances better, or the same ones.

    Projects gradients on what the tolerances allow, then on gradients of functions (Poisson
    problems), in turn. Done only where `NEAR_SHARE` of the cell axes are within `NEAR` of their
    size to begin with, on grids of up to `MOST_ELEMENTS`, and not yet `_KEPT_SHARE`
    within 5 %; kept only if nothing folds and more of them are within 5 %.

    Returns (3, nx, ny, nz) array.

    - ``phases (3, nx, ny, nz)``
    - ``rotation (ex, ey, ez, 3, 3)``: nearest to the scaled gradients
    - ``size (ex, ey, ez)``, mm
    - ``steps (3,)``, mm
    - ``solve``: load of the Poisson problem to node values

    References
    ----------
    Alternating projections, over-relaxed: Bauschke and Borwein, SIAM Review 38 (1996) 367.
    """
    if size.size > MOST_ELEMENTS:
        return phases
    matrix = centre_gradients(phases, steps) * size[..., None, None]
    if _share(matrix, NEAR) < NEAR_SHARE or _share(matrix, 0.05) >= _KEPT_SHARE:
        return phases
    frame, refined = rotation, phases
    for _ in range(PASSES):
        frame = nearest_rotations(matrix.reshape(-1, 3, 3), frame.reshape(-1, 3, 3))
        frame = frame.reshape(matrix.shape)
        target = matrix + _OVERSTEP * (_allowed(matrix, frame) - matrix)
        load = divergence(target / size[..., None, None], steps)
        refined = np.stack([solve(b) for b in load])
        before = matrix
        matrix = centre_gradients(refined, steps) * size[..., None, None]
        if np.abs(matrix - before).max() < 1e-6:
            break
    first = centre_gradients(phases, steps) * size[..., None, None]
    if np.linalg.det(matrix).min() <= 0 or _share(matrix, 0.05) < _share(first, 0.05):
        return phases
    return refined


def _allowed(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Nearest matrices, row by row, within the tolerances of a frame."""
    length = np.linalg.norm(matrix, axis=-1, keepdims=True)
    unit = matrix / length
    cosine = np.clip((unit * frame).sum(axis=-1, keepdims=True), -1.0, 1.0)
    across = unit - cosine * frame
    sine = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.minimum(np.arctan2(sine, cosine), _ANGLE_TOLERANCE)
    turned = np.cos(angle) * frame + np.sin(angle) * across / np.maximum(sine, 1e-15)
    return np.asarray(
        turned * np.clip(length, 1 / (1 + _SIZE_TOLERANCE), 1 / (1 - _SIZE_TOLERANCE))
    )


def _share(matrix: FloatArray, error: float) -> float:
    """Share of cell axes whose size is within an error of that wanted."""
    return float(np.mean(np.abs(1 / np.linalg.norm(matrix, axis=-1) - 1) <= error))

"""Components of a lattice, and its implicit field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.cells import Cells
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.solid_layers import solid_layers, united


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class LatticeDesign(ShownRecord):
    """Everything that defines one lattice.

    Attributes
    ----------
    domain : DesignDomain
        The part with the components of the lattice.
    cell_map : callable
        Points ``(3, ...)`` mm to cell coordinates u ``(3, ...)``.
    cell_size : float, mm
        Typical size of a cell; only scales the cell's values towards mm.
    density : DensityGrid or float
        Relative density, graded or uniform.
    """

    domain: DesignDomain
    cells: Cells
    cell_map: Callable[[FloatArray], FloatArray]
    cell_size: float
    density: DensityGrid | float

    def __post_init__(self) -> None:
        if not self.cell_size > 0:
            raise LatticeError(f"cell size is {self.cell_size:g} mm, expected a positive size")


def density_at(design: LatticeDesign, points: FloatArray) -> FloatArray:
    """Relative density at points ``(3, ...)`` mm, ``(...)``.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> from gradedesign.geometry.cell.cells import single
    >>> box = DesignDomain(
    ...     distance=lambda p: np.abs(p).max(axis=0) - 9, lower=[-9] * 3, upper=[9] * 3
    ... )
    >>> design = LatticeDesign(
    ...     domain=box, cells=single(cell), cell_map=lambda p: p / 6, cell_size=6.0, density=0.3
    ... )
    >>> density_at(design, np.zeros((3, 2))).tolist()
    [0.3, 0.3]
    """
    if isinstance(design.density, DensityGrid):
        return evaluate(design.density, points)
    return np.full(points.shape[1:], float(design.density))


def cell_gradient(design: LatticeDesign) -> float:
    """Median of ``|dg/du|`` near the surface of the mid-density cell, per cell length.

    One number for the whole lattice: it turns g into mm well enough for interpolation between a
    wall and a trim or skin, and moves no zero set. Central differences on 24^3 points of
    a unit cell; the eighth of them with g nearest to the level counts.

    Raises
    ------
    LatticeError
        If the cell's function is constant or not finite there.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> from gradedesign.geometry.cell.cells import single
    >>> box = DesignDomain(
    ...     distance=lambda p: np.abs(p).max(axis=0) - 9, lower=[-9] * 3, upper=[9] * 3
    ... )
    >>> design = LatticeDesign(
    ...     domain=box, cells=single(cell), cell_map=lambda p: p / 6, cell_size=6.0, density=0.3
    ... )
    >>> round(cell_gradient(design), 1)
    7.7
    """
    axis = (np.arange(24) + 0.5) / 24
    u = np.array(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
    density = design.density
    middle = np.median(density.values) if isinstance(density, DensityGrid) else density
    away = np.abs(design.cells.shape(u) - design.cells.level_of(np.asarray(middle)))
    u = u[:, np.argsort(away, kind="stable")[: u.shape[1] // 8]]
    square = np.zeros(u.shape[1])
    step = 1e-4
    for shift in step * np.eye(3):
        ahead = design.cells.shape(u + shift[:, None])
        back = design.cells.shape(u - shift[:, None])
        square += ((ahead - back) / (2 * step)) ** 2
    gradient = float(np.median(np.sqrt(square)))
    if not (np.isfinite(gradient) and gradient > 0):
        raise LatticeError(
            f"the cell's shape function has gradient {gradient:g} at its surface, expected a "
            f"positive number; check the plugin with its conformance test"
        )
    return gradient


def cell_field(design: LatticeDesign, *, single: bool = False) -> Field:
    """Field of the infinite lattice, ``(g(u) - t(rho)) cell_size / |dg/du|``, about mm.

    ``single``: evaluate the cell's function in float32: about 10x faster for trigonometric cells,
    and right to about 2e-7 of the distance from the map's origin.
    """
    scale = design.cell_size / cell_gradient(design)
    uniform = not isinstance(design.density, DensityGrid)
    cells = design.cells
    level = cells.level_of(np.asarray(design.density, dtype=np.float64)) if uniform else None

    def cell(points: FloatArray) -> FloatArray:
        u = design.cell_map(points)
        t = level if level is not None else cells.level_of(density_at(design, points))
        if cells.excess is not None:
            t = t + cells.excess(u)
        if cells.weights is not None:
            u = np.concatenate([u, cells.weights(points)])
        return scale * (cells.shape(u.astype(np.float32) if single else u) - t)

    return cell


def uncut_field(design: LatticeDesign, *, band: float, single: bool = False) -> Field:
    """`lattice_field` for a contour that the part cuts afterwards.

    Where no solid, component on the cells or rim needs the part's distance, it is that of the cells
    less the cuts, which go on beyond the part.
    """
    domain = design.domain
    if not domain.lattice_only or domain.on_cells or domain.least_rim:
        return lattice_field(design, band=band, single=single)
    exact = cell_field(design)
    cell = cell_field(design, single=True) if single else exact
    union = united(domain, (), cell, exact, design.cell_size)
    return lambda points: union(points, np.zeros(0))


def lattice_field(
    design: LatticeDesign, *, band: float | None = None, single: bool = False
) -> Field:
    """Field of the trimmed lattice with the components of its domain, negative inside, about mm.

    ``max(part, min(cell, solids))``, the minimum with the fillets of a join, less the cuts. The
    part's distance is evaluated once per point.

    Parameters
    ----------
    band : float, optional, mm
        Reach within which distances must be exact, two sampling spacings or more. Further away
        they are replaced by bounds from a coarse grid (which needs ``part`` and the
        solids to be true distances), and outside the part the cell is left out. ``None``:
        exact everywhere.
    single : bool
        As in :func:`cell_field`.

    Returns
    -------
    callable
        Points ``(3, ...)`` mm to values ``(...)``; its zero set does not depend on ``band``.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> from gradedesign.geometry.cell.calibration import calibrate
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> from gradedesign.geometry.cell.cells import single
    >>> box = DesignDomain(
    ...     distance=lambda p: np.abs(p).max(axis=0) - 9, lower=[-9] * 3, upper=[9] * 3
    ... )
    >>> design = LatticeDesign(
    ...     domain=box, cells=single(cell), cell_map=lambda p: p / 6, cell_size=6.0, density=0.3
    ... )
    >>> body = lattice_field(design)
    >>> bool(body(np.array([20.0, 0.0, 0.0])) > 0)  # outside the part
    True
    """
    part, layers = solid_layers(design.domain, band)
    exact = cell_field(design)
    cell = cell_field(design, single=True) if single else exact
    union = united(design.domain, layers, cell, exact, design.cell_size)
    reach = np.inf if band is None else band

    def lattice(points: FloatArray) -> FloatArray:
        points = np.asarray(points, dtype=np.float64)
        values = np.array(part(points), dtype=np.float64)
        near = values <= reach
        if near.all():
            return np.maximum(values, union(points, values))
        if near.any():
            inside, distance = points[:, near], values[near]
            values[near] = np.maximum(distance, union(inside, distance))
        return values

    return lattice

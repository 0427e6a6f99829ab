"""Density from scattered points, mapped on a regular grid by inverse square distance."""

from __future__ import annotations

import csv
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import CaseError, DensityError, ResourceError
from gradedesign.lattice.density_source import MOST_NODES, DensitySource
from gradedesign.lattice.voxel_density import voxel_density

log = logging.getLogger(__name__)

#: Pairs of node and point that are held at once.
_MOST_PAIRS = 4_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointMap:
    """Points mapped on a grid.

    Attributes
    ----------
    lower : (3,) array, mm
        First node.
    spacing : (3,) array, mm
    values : (nx, ny, nz) array
        Relative density at the nodes.
    tolerance, sensitivity : float, mm
        Radii of the rule, see `remap_points`.
    empty : int
        Nodes without a point within the sensitivity, which took the least density.
    """

    lower: FloatArray
    spacing: FloatArray
    values: FloatArray
    tolerance: float
    sensitivity: float
    empty: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "spacing", locked(self.spacing, (3,), name="spacing"))
        object.__setattr__(self, "values", locked(self.values, (None, None, None), name="values"))


def read_points(path: Path) -> tuple[FloatArray, FloatArray]:
    """Read points ``(3, n)`` in mm and their densities ``(n,)``.

    Text has four columns x, y, z and density, divided by commas, semicolons or blanks; its first
    line may be a heading, lines that begin with ``#`` are skipped. A ``.npy`` array is ``(n, 4)``.

    Raises
    ------
    CaseError
        If the file cannot be read or has other columns.
    """
    table = _array(path) if path.suffix.lower() == ".npy" else _text(path)
    if table.ndim != 2 or table.shape[1] != 4 or not len(table):
        raise CaseError(
            f"{path.name} holds an array of shape {table.shape}; expected one row x, y, z, "
            f"density for each point"
        )
    if not np.isfinite(table).all():
        row = int(np.argmin(np.isfinite(table).all(axis=1)))
        raise CaseError(f"{path.name}: point {row + 1} is not finite: {table[row].tolist()}")
    return np.ascontiguousarray(table[:, :3].T), np.ascontiguousarray(table[:, 3])


def remap_points(
    points: FloatArray,
    values: FloatArray,
    spacing: float,
    *,
    method: Literal["weights", "maximum"] = "weights",
    oversize: bool = False,
    outside: float | None = None,
) -> PointMap:
    """Map scattered densities on a regular grid over their box.

    Along each axis the grid has ``int(extent / spacing) + 1`` nodes. With the spacing of the grid
    and that of the points (extent over the number of different coordinates less one), each the
    largest of the three axes, the *sensitivity* is the larger of the two and the *tolerance* half
    the smaller. A node takes the largest density within the tolerance; without one the mean of
    those within the sensitivity, weighted by the inverse square of their distance (or, if asked,
    their maximum); without any the least density.

    Parameters
    ----------
    points : (3, n) array, mm
    values : (n,) array
    spacing : float, mm
        Wanted; the grid fits its box.
    method : {"weights", "maximum"}
    oversize : bool
        Add a layer of nodes of density ``outside`` on every side.
    outside : float, optional
        The least density without it.

    Returns
    -------
    PointMap

    Raises
    ------
    DensityError
        If there are fewer than two points, they span no box, or the spacing is not positive.
    ResourceError
        If the grid would be too large.

    Notes
    -----
    The mean lowers peaks narrower than the grid; an analysis of the result, or ``maximum``, is
    the safeguard.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, section 3.2.2, eq. 3.8 to 3.13, and A.1.1.
    """
    extent = np.ptp(points, axis=1) if points.shape[1] else np.zeros(3)
    if points.shape[1] < 2 or not (extent > 0).all() or not spacing > 0:
        raise DensityError(
            f"{points.shape[1]} points over {extent.tolist()} mm at {spacing:g} mm span no grid; "
            f"expected points that differ in x, y and z, and a positive spacing"
        )
    lower = points.min(axis=1)
    count = (extent / spacing + 1e-9).astype(np.int64) + 1
    count = np.maximum(count, 2)
    if count.prod() > MOST_NODES:
        raise ResourceError(
            f"a grid of {count.tolist()} nodes at {spacing:g} mm is larger than {MOST_NODES:.3g} "
            f"nodes; use a larger spacing"
        )
    own = extent / (count - 1)
    theirs = extent / (np.array([len(np.unique(row)) for row in points]) - 1)
    sensitivity = float(max(own.max(), theirs.max()))
    tolerance = float(min(own.max(), theirs.max())) / 2
    axes = [low + step * np.arange(n) for low, step, n in zip(lower, own, count, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    mapped, empty = _mapped(nodes, points, values, tolerance, sensitivity, method == "maximum")
    grid = mapped.reshape(*count)
    if oversize:
        border = float(values.min()) if outside is None else outside
        grid = np.pad(grid, 1, constant_values=border)
        lower = lower - own
    log.info("%d points on %s nodes, %d of them empty", len(values), count.tolist(), empty)
    return PointMap(
        lower=lower,
        spacing=own,
        values=grid,
        tolerance=tolerance,
        sensitivity=sensitivity,
        empty=empty,
    )


def point_density(mapped: PointMap) -> DensitySource:
    """Trilinear density between the nodes of a map, constant beyond them."""
    return voxel_density(mapped.values, mapped.lower - 0.5 * mapped.spacing, mapped.spacing)


def _mapped(
    nodes: FloatArray,
    points: FloatArray,
    values: FloatArray,
    tolerance: float,
    sensitivity: float,
    maximum: bool,
) -> tuple[FloatArray, int]:
    """Densities at nodes ``(3, m)`` and the number of nodes without a point."""
    tree = cKDTree(points.T)
    reach = sensitivity * (1 + 1e-9)
    sizes = tree.query_ball_point(nodes.T, reach, return_length=True)
    least = float(values.min())
    result = np.full(nodes.shape[1], least)
    ends = np.cumsum(sizes)
    low = 0
    while low < nodes.shape[1]:
        before = int(ends[low - 1]) if low else 0
        high = max(int(np.searchsorted(ends, before + _MOST_PAIRS)), low + 1)
        pairs = cKDTree(nodes[:, low:high].T).sparse_distance_matrix(
            tree, reach, output_type="ndarray"
        )
        node, point, apart = pairs["i"], pairs["j"], pairs["v"]
        found = np.full(high - low, -np.inf)
        if maximum:
            np.maximum.at(found, node, values[point])
        else:
            far = apart > tolerance
            weight = np.divide(1.0, apart**2, out=np.zeros_like(apart), where=far)
            total = np.bincount(node[far], weight[far], high - low)
            mean = np.bincount(node[far], (weight * values[point])[far], high - low)
            found = np.divide(mean, total, out=found, where=total > 0)
        close = apart <= tolerance * (1 + 1e-9)
        peak = np.full(high - low, -np.inf)
        np.maximum.at(peak, node[close], values[point[close]])
        found = np.where(np.isfinite(peak), peak, found)
        result[low:high] = np.maximum(found, least)
        low = high
    return result, int(np.count_nonzero(sizes == 0))


def _array(path: Path) -> FloatArray:
    try:
        return np.asarray(np.load(path, allow_pickle=False), dtype=np.float64)
    except (OSError, ValueError, TypeError, EOFError) as error:
        raise CaseError(f"{path.name} cannot be read as a .npy array: {error}") from error


def _text(path: Path) -> FloatArray:
    """Rows of numbers; a heading is a first line that is none."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{path.name} cannot be read as text: {error}") from error
    rows: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        words = next(csv.reader([line.replace(";", ",")]), []) if "," in line or ";" in line else []
        words = [w.strip() for w in words] or line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            if not rows and number == 1:
                continue
            raise CaseError(
                f"{path.name}:{number}: found {line[:60]!r}, expected numbers"
            ) from None
        if len(row) != 4:
            raise CaseError(
                f"{path.name}:{number}: found {len(row)} columns, expected x, y, z, density"
            )
        rows.append(row)
    return np.array(rows, dtype=np.float64).reshape(-1, 4)

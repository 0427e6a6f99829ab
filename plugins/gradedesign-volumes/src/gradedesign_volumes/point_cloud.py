"""Density from scattered points, mapped on a regular grid by inverse square distance."""

from __future__ import annotations

import logging
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from gradedesign import CaseError, DensityError, ResourceError
from gradedesign.fields import Field, FloatArray
from gradedesign_volumes.npy_file import read_npy
from gradedesign_volumes.voxel_density import voxel_density

log = logging.getLogger(__name__)

#: Nodes of the largest grid, as of the grid of a lattice's density.
_MOST_NODES = 64_000_000
#: Pairs of node and point in memory at once. Chosen, not measured.
_MOST_PAIRS = 4_000_000
#: Most pairs that are evaluated, some minutes of work. Chosen, not measured.
_MOST_WORK = 20_000_000_000
#: Characters of the longest line, and memory for every character: its share of four numbers.
#: Chosen, not measured.
_LONGEST_LINE, _BYTES_PER_CHARACTER = 1000, 16
#: Memory for a node of the grid, and for a point.
_BYTES_PER_NODE, _BYTES_PER_POINT = 96, 120
#: Largest coordinate, mm. No printable part reaches this far, as in `raw_triangles`.
_FARTHEST = 1e7


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


def read_points(path: Path, *, memory_limit_bytes: int) -> tuple[FloatArray, FloatArray]:
    """Read points ``(3, n)`` in mm and their densities ``(n,)``.

    Text has four columns x, y, z and density, divided by commas, semicolons or blanks; its first
    line may be a heading, lines that begin with ``#`` are skipped. A ``.npy`` array is ``(n, 4)``.

    Parameters
    ----------
    memory_limit_bytes : int
        What reading the file may take.

    Raises
    ------
    CaseError
        If the file cannot be read, has other columns, or points that are no places.
    ResourceError
        If it takes more memory.
    """
    if path.suffix.lower() == ".npy":
        values = read_npy(path, memory_limit_bytes=memory_limit_bytes, bytes_per_value=24)
        with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is refused below
            table = values.astype(np.float64)
    else:
        table = _text(path, memory_limit_bytes)
    if table.ndim != 2 or table.shape[1] != 4 or not len(table):
        raise CaseError(
            f"{path.name} holds an array of shape {table.shape}; expected one row x, y, z, "
            f"density for each point"
        )
    if not np.isfinite(table).all():
        row = int(np.argmin(np.isfinite(table).all(axis=1)))
        raise CaseError(f"{path.name}: point {row + 1} is not finite: {table[row].tolist()}")
    if not (np.abs(table[:, :3]) <= _FARTHEST).all():
        row = int(np.argmax((np.abs(table[:, :3]) > _FARTHEST).any(axis=1)))
        raise CaseError(
            f"{path.name}: point {row + 1} lies at {table[row, :3].tolist()} mm; expected "
            f"coordinates of at most {_FARTHEST:g} mm"
        )
    return np.ascontiguousarray(table[:, :3].T), np.ascontiguousarray(table[:, 3])


def remap_points(
    points: FloatArray,
    values: FloatArray,
    spacing: float,
    *,
    method: Literal["weights", "maximum"] = "weights",
    oversize: bool = False,
    outside: float | None = None,
    memory_limit_bytes: int = 8_000_000_000,
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
    memory_limit_bytes : int
        What the grid may take.

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
    wanted = np.maximum(np.floor(extent / spacing + 1e-9) + 1, 2)
    most = min(_MOST_NODES, memory_limit_bytes / _BYTES_PER_NODE)
    if not wanted.prod() <= most:
        raise ResourceError(
            f"a grid of {' x '.join(f'{n:.4g}' for n in wanted)} nodes at {spacing:g} mm is larger "
            f"than the {most:.3g} that run.memory of {memory_limit_bytes / 1e9:.3g} GB allows, or "
            f"than {_MOST_NODES:.3g}; use a larger spacing"
        )
    count = wanted.astype(np.int64)
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
    made = PointMap(
        lower=lower,
        spacing=own,
        values=grid,
        tolerance=tolerance,
        sensitivity=sensitivity,
        empty=empty,
    )
    log.info(
        "%d points on %s nodes, %d of them with none within %.4g mm",
        *(len(values), count.tolist(), made.empty, made.sensitivity),
    )
    return made


def point_density(mapped: PointMap) -> Field:
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
    if ends[-1] > _MOST_WORK:
        raise ResourceError(
            f"{points.shape[1]} points within {sensitivity:.3g} mm of {nodes.shape[1]} nodes make "
            f"{ends[-1]:.3g} pairs, more than {_MOST_WORK:.3g}; the points lie in too few layers "
            f"along an axis, or use a larger spacing"
        )
    low = 0
    while low < nodes.shape[1]:
        before = int(ends[low - 1]) if low else 0
        high = max(int(np.searchsorted(ends, before + _MOST_PAIRS)), low + 1)
        pairs = cKDTree(nodes[:, low:high].T).sparse_distance_matrix(
            tree, reach, output_type="ndarray"
        )
        node, point, apart = pairs["i"], pairs["j"], pairs["v"]
        mapped = np.full(high - low, -np.inf)
        if maximum:
            np.maximum.at(mapped, node, values[point])
        else:
            far = apart > tolerance
            weight = np.divide(1.0, apart**2, out=np.zeros_like(apart), where=far)
            total = np.bincount(node[far], weight[far], high - low)
            mean = np.bincount(node[far], (weight * values[point])[far], high - low)
            mapped = np.divide(mean, total, out=mapped, where=total > 0)
        close = apart <= tolerance * (1 + 1e-9)
        peak = np.full(high - low, -np.inf)
        np.maximum.at(peak, node[close], values[point[close]])
        mapped = np.where(np.isfinite(peak), peak, mapped)
        result[low:high] = np.maximum(mapped, least)
        low = high
    return result, int(np.count_nonzero(sizes == 0))


def _text(path: Path, memory_limit_bytes: int) -> FloatArray:
    """Rows of numbers; a heading is a first line that is none."""
    size = path.stat().st_size if path.is_file() else 0
    if size * _BYTES_PER_CHARACTER > memory_limit_bytes:
        raise _too_large(path.name, f"{size / 1e6:.4g} MB", size * _BYTES_PER_CHARACTER,
                         memory_limit_bytes)  # fmt: skip
    numbers = array("d")
    try:
        with path.open(encoding="utf-8-sig") as file:
            for number, line in enumerate(iter(lambda: file.readline(_LONGEST_LINE + 1), ""), 1):
                numbers.extend(_row(line, f"{path.name}:{number}", first=number == 1))
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{path.name} cannot be read as text: {error}") from error
    return np.array(numbers, dtype=np.float64).reshape(-1, 4)


def _row(line: str, where: str, *, first: bool) -> list[float]:
    """The four numbers of a line; none of a comment, an empty line or a heading."""
    if len(line) > _LONGEST_LINE:
        raise CaseError(
            f"{where}: found a line of more than {_LONGEST_LINE} characters, expected four numbers"
        )
    words = [word.strip() for word in line.replace(";", ",").split(",")]
    if len(words) == 1:
        words = line.split()
    words = [word.strip('"') for word in words]
    if not any(words) or words[0].startswith("#"):
        return []
    try:
        row = [float(word) for word in words]
    except ValueError:
        if first:
            return []
        raise CaseError(f"{where}: found {line[:60].rstrip()!r}, expected numbers") from None
    if len(row) != 4:
        raise CaseError(f"{where}: found {len(row)} columns, expected x, y, z, density")
    return row


def _too_large(name: str, content: str, need: float, memory_limit_bytes: int) -> ResourceError:
    return ResourceError(
        f"{name} has {content}, which take about {need / 1e9:.3g} GB; found run.memory of "
        f"{memory_limit_bytes / 1e9:.3g} GB; raise it or use fewer points"
    )

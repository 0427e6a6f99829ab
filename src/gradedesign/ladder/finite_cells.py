"""Few cells across a part: how many there are about every tetrahedron, and what that costs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.case.schema import Case
from gradedesign.cell.family import CellFamily
from gradedesign.errors import CaseError
from gradedesign.lattice.lattice import KeptRegion
from gradedesign.material.finite_size_table import FiniteSizeTable, ratio_at
from gradedesign.mesh.surface_mesh import corner_points
from gradedesign.mesh.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.part.chords import chords
from gradedesign.part.part import Part
from gradedesign.plugin.registry import Registry
from gradedesign.sizing.local_factor import LocalFactor

#: What is counted at a tetrahedron is the median over those within this many cells: corners and
#: roundings thinner than a cell do not make the part thinner there.
_NEIGHBOURHOOD = 0.5
#: Half a difference between places of the faces in the cell that a run warns of.
_SPREAD = 0.05
#: A part of exactly one cell may come out a rounding error thinner.
_ROUNDING = 1e-6


def finite_size_of(
    case: Case,
    registry: Registry,
    family: CellFamily,
    parameters: Mapping[str, float],
    bounds: tuple[float, float],
) -> FiniteSizeTable:
    """Finite-size table that describes the cells of a case.

    Raises
    ------
    CaseError
        If none is installed for the family, or the case leaves what it covers.
    """
    tables = registry.finite_size_tables
    if family.name not in tables:
        raise CaseError(
            f"no finite size table of cell '{family.name}' is installed; there are tables of "
            f"{', '.join(sorted(tables)) or 'no cell'}; leave finite_size out, or take one of "
            f"these ('gradedesign tabulate {family.name} --finite-size -o FOLDER' computes one "
            f"for a plugin to ship)"
        )
    table: FiniteSizeTable = tables[family.name]
    edges = case.lattice.edges
    if dict(parameters) != dict(table.parameters) or min(edges) < max(edges):
        raise CaseError(
            f"the finite size table of cell '{family.name}' describes cells of equal edges with "
            f"the parameters {dict(table.parameters)}, found edges of {case.lattice.size_words} "
            f"with {dict(parameters)}; leave finite_size out"
        )
    low, high = float(table.density[0]), float(table.density[-1])
    if bounds[0] < low - 1e-9 or bounds[1] > high + 1e-9:
        raise CaseError(
            f"the finite size table of cell '{family.name}' covers relative densities {low:g} to "
            f"{high:g}, but sizing may choose {bounds[0]:.4g} to {bounds[1]:.4g}; set [lattice] "
            f"density within [{low:g}, {high:g}], or leave finite_size out"
        )
    return table


def spread_warnings(table: FiniteSizeTable) -> tuple[str, ...]:
    """What a mean over two beginnings of the cell leaves open, where that is much."""
    spread = max(r.spread for row in table.rows for r in (*row.block, *row.wall))
    if spread <= _SPREAD:
        return ()
    return (
        f"how stiff few cells of '{table.family}' are depends on where faces cut them: the factors "
        f"of [lattice] finite_size are means of two places that differ by up to {spread:.2f} on "
        f"either side",
    )


def local_factor(
    case: Case,
    part: Part,
    mesh: TetMesh,
    solid_share: FloatArray,
    kept: tuple[KeptRegion, ...],
    distance: Field,
    table: FiniteSizeTable,
) -> LocalFactor:
    """Factor on the lattice stiffness about every tetrahedron, at the densities of a table.

    With the two directions across which there are fewest cells, n1 <= n2, it is
    ``wall(n1) block(n2) / wall(n2)``: that of a wall where n2 is large, of a block where both are
    alike.

    Raises
    ------
    CaseError
        Where the part is thinner than one cell.
    """
    per_cell = cells_across(case, part, mesh, solid_share < 1, kept, distance)
    factor = np.ones((len(table.rows), solid_share.size))
    for row, values in zip(table.rows, factor, strict=True):
        second = ratio_at(row.block, per_cell[1]) / ratio_at(row.wall, per_cell[1])
        values[:] = ratio_at(row.wall, per_cell[0]) * second
    return LocalFactor(density=table.density, factor=factor)


def cells_across(
    case: Case,
    part: Part,
    mesh: TetMesh,
    lattice: BoolArray,
    kept: tuple[KeptRegion, ...],
    distance: Field,
) -> FloatArray:
    """One over the number of cells across the part, ``(2, M)``: of the thinnest two directions.

    Along each axis of the cells the part reaches from face to face through the centroid of a
    tetrahedron. Free faces soften cells, each by half of what a thin wall loses; an end in a kept
    region is no free face. So ``1 / n = free ends / 2 * cell / length``. Taken is the median by
    volume over half a cell.

    Parameters
    ----------
    case : Case
    part : Part
    mesh : TetMesh
    lattice : (M,) bool array
        Tetrahedra that hold lattice; 0 elsewhere.
    kept : tuple of KeptRegion
    distance : callable
        Signed distance of the part.

    Returns
    -------
    (2, M) array
        0 to 1, the larger first.

    Raises
    ------
    CaseError
        Where it is more than 1.
    """
    edge = case.lattice.edges[0]
    axes = Rotation.from_euler("XYZ", case.lattice.rotation, degrees=True).as_matrix()
    points = centroids(mesh)
    # A flat tetrahedron at a hollow face may have its centroid outside: it takes its neighbours'.
    known = np.flatnonzero(lattice & (distance(points) < 0))
    inner = points[:, known]
    lengths = chords(corner_points(part.surface), inner, axes)
    free = np.zeros((3, known.size))
    for side, length in zip((-1.0, 1.0), lengths, strict=True):
        for k in range(3):
            reached = np.where(np.isfinite(length[k]), length[k], 0.0)
            ends = inner + side * reached * axes[:, k, None]
            held = np.zeros(known.size, dtype=np.bool_)
            for region in kept:
                held |= region.distance(ends) <= region.margin
            free[k] += ~held
    thin = np.sort(0.5 * free * edge / (lengths[0] + lengths[1]), axis=0)[:0:-1]
    return _settled(thin, known, lattice, points, signed_volumes(mesh), edge)


def _settled(
    thin: FloatArray,
    known: np.ndarray,
    lattice: BoolArray,
    points: FloatArray,
    volumes: FloatArray,
    edge: float,
) -> FloatArray:
    """Medians over half a cell about every tetrahedron of lattice, refused above 1."""
    result = np.zeros((2, points.shape[1]))
    asked = np.flatnonzero(lattice)
    tree = cKDTree(points[:, known].T)
    near = tree.query_ball_point(points[:, asked].T, _NEIGHBOURHOOD * edge)
    nearest = tree.query(points[:, asked].T)[1]
    for tet, found, closest in zip(asked, near, nearest, strict=True):
        here = found or [closest]
        for k in range(2):
            result[k, tet] = _median(thin[k, here], volumes[known[here]])
    worst = int(np.argmax(result[0]))
    if result[0, worst] > 1 + _ROUNDING:
        at = ", ".join(f"{v:.3g}" for v in points[:, worst])
        raise CaseError(
            f"the part is {1 / result[0, worst]:.2f} cells of {edge:g} mm thick near ({at}) mm, "
            f"but finite size tables begin at one cell; take smaller cells or leave finite_size out"
        )
    return np.minimum(result, 1.0)


def _median(values: FloatArray, weights: FloatArray) -> float:
    """Least value at which half of the weight is reached."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])

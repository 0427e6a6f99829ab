"""Conformance kit for plugin authors: call it from the tests of a plugin.

Above 300 lines: it is one of the three modules that plugins may import.
"""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray
from gradedesign.errors import PluginError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import (
    evaluate_shape,
    grid_nodes,
    require_period,
    spread_points,
)
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.fields.segment_distance import periodic_distance_to_segments
from gradedesign.geometry.lattice.component import SolidComponent
from gradedesign.mechanics.homogenise.bounds import check_bounds
from gradedesign.mechanics.material.scaling_law import ScalingLaw

__all__ = ["check_cell_family", "check_component", "check_scaling_law"]

log = logging.getLogger(__name__)

#: Proper and mirror operations whose invariance each declared symmetry needs of the power
#: spectrum; rows of signed permutation matrices.
_SWAP_XY = ((0, 1, 0), (1, 0, 0), (0, 0, 1))
#: x to y to z to x: the rotation by a third about the diagonal.
_CYCLE = ((0, 1, 0), (0, 0, 1), (1, 0, 0))
#: Across x = 0 and y = 0; the spectrum is symmetric about its centre, so that these imply z = 0.
_MIRRORS = (((-1, 0, 0), (0, 1, 0), (0, 0, 1)), ((1, 0, 0), (0, -1, 0), (0, 0, 1)))
_OPERATIONS = {
    "none": (),
    "orthotropic": _MIRRORS,
    "tetragonal": (*_MIRRORS, _SWAP_XY),
    "cubic": (*_MIRRORS, _CYCLE),
}


#: Shares of a cell that small levels fill, by which surfaces are told from lines: well below the
#: density at which sheets meet, and some hundreds of the points that are taken.
_SHARES = (0.01, 0.03)
#: Gradient near the zero set over that elsewhere: 0.59 and more for the sheets that we know, 0.39
#: for struts whose level is a density, which rises smoothly from their axes.
_STEEP = 0.5
#: Millions of values that the kit evaluates: for densities and levels, and for walls of sheets and
#: of networks. Walls of a true distance need none. Chosen, not measured.
_FOR_DENSITIES, _FOR_SHEETS, _FOR_NETWORKS = 3.0, 6.0, 3.0


#: Points of a box at which a component is checked: a plate of a thousandth of the box holds some.
_IN_BOX = 20_000
#: Slope of a distance by differences may exceed one by their rounding. Chosen, not measured.
_STEEPER = 1e-3


def check_cell_family(family: CellFamily, *, on_step: Callable[[str], None] | None = None) -> None:
    """Check that a cell family keeps every promise of `CellFamily`.

    The name; output that follows the shape of the input, for one point, a list and a grid; finite
    values; the declared period along each axis; an unmodified input; the declared symmetry; a
    usable window of densities; a level that rises with density and gives that density; walls that
    thicken; for ``distance=True`` a gradient of length 1; for ``sides=2`` values of 0 and more that
    reach 0, for ``sides=1`` a shape that is no sheet.

    Parameters
    ----------
    family : CellFamily
        Checked with its default parameters.
    on_step : callable, optional
        Receives one line before every step, such as ``print``; the line of the densities says
        how long a slow shape will take. The log (``gradedesign.testing``, INFO) holds them all,
        with the seconds they took.

    Raises
    ------
    PluginError
        Naming the family, what was found and what was expected.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import CellFamily
    >>> def sheet(u):
    ...     return np.abs(np.cos(2 * np.pi * u).sum(axis=0))
    >>> check_cell_family(CellFamily(name="p-sheet", shape=sheet, sides=2))
    >>> check_cell_family(CellFamily(name="P sheet", shape=sheet, sides=2))
    Traceback (most recent call last):
    gradedesign.errors.PluginError: cell 'P sheet': the name must be lower case with dashes
    """
    if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", family.name):
        raise PluginError(f"cell '{family.name}': the name must be lower case with dashes")
    rng = np.random.default_rng(20220701)
    points = family.period * rng.uniform(-2.0, 2.0, size=(3, 500))

    @contextmanager
    def step(title: str) -> Iterator[None]:
        if on_step is not None:
            on_step(f"{family.name}: {title}")
        began = time.perf_counter()
        yield
        log.info("%s: %s, %.1f s", family.name, title, time.perf_counter() - began)

    with step("output and period"):
        values = _check_output(family, points)
        require_period(family, family.parameters)
    if family.sides == 2:
        with step("two sides"):
            _check_sides(family, values)
    else:
        _check_one_side(family)
    if family.distance:
        with step("distance"):
            _check_distance(family, points)
    if family.struts is not None:
        with step("axes of struts"):
            _check_struts(family, points, values)
    with step("symmetry"):
        _check_symmetry(family)
    with step(f"densities, {_expected(family)}"):
        cell = calibrate(family)
    with step("levels"):
        _check_level(cell)
    with step("walls"):
        _check_wall(cell)


def _expected(family: CellFamily) -> str:
    """Seconds that the rest of the check will take, from the time for some thousand points."""
    points = family.period * spread_points(4000)
    began = time.perf_counter()
    evaluate_shape(family, family.parameters, points)
    micro = (time.perf_counter() - began) / 4000 * 1e6
    walls = _FOR_SHEETS if family.sides == 2 else _FOR_NETWORKS
    millions = _FOR_DENSITIES + (0.0 if family.distance else walls)
    return f"{micro:.2g} us a point, about {max(millions * micro, 1):.0f} s for the rest"


def check_scaling_law(law: ScalingLaw) -> None:
    """Check that a scaling law keeps every promise of `ScalingLaw`.

    The name; shapes; a symmetric, positive definite stiffness that rises with density and stays
    within the bounds below; derivatives that match differences.

    Parameters
    ----------
    law : ScalingLaw
        Its stiffness is checked, at 41 densities of its window. Laws from experiments are held to
        the same bounds: one that breaks them was divided by the wrong modulus or density.

    Raises
    ------
    PluginError
        Naming the law, what was found and what was expected.

    Notes
    -----
    Two bounds are exact for every solid with voids, whatever its symmetry. Voigt's in the sense of
    energies: ``rho C_solid - C`` is positive semidefinite, so that E, G and K stay below the solid
    volume fraction of the solid's. Hashin and Shtrikman's upper bound on the bulk and the shear
    modulus of an isotropic mixture holds for the Reuss averages of ``C``, below which no
    polycrystal of the cell lies: for an isotropic law that is K and G themselves, for a cubic one K
    itself and the mean of its two shear compliances. It is no bound on the larger of the two shear
    moduli of a cubic law, nor on E along one direction.

    Examples
    --------
    >>> from gradedesign import LawOrigin, power_law
    >>> origin = LawOrigin(kind="experiment", source="our tests of 2026", test="compression")
    >>> law = power_law("mine", ("my-cell",), youngs=(0.5, 2.0), window=(0.1, 0.5), origin=origin)
    >>> check_scaling_law(law)
    """
    if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", law.name):
        raise PluginError(f"law '{law.name}': the name must be lower case with dashes")
    a, b = law.window
    if not 0 < a < b <= 1:
        raise PluginError(f"law '{law.name}': window {law.window} must be within 0 to 1")
    rho = np.linspace(a, b, 9)
    c = law.stiffness(rho)
    if c.shape != (6, 6, 9) or law.stiffness(np.asarray(rho[4])).shape != (6, 6):
        raise PluginError(f"law '{law.name}': stiffness has shape {c.shape}, expected (6, 6, ...)")
    matrices = np.moveaxis(c, -1, 0)
    eigenvalues = np.linalg.eigvalsh(matrices)
    if not np.allclose(matrices, matrices.transpose(0, 2, 1)) or eigenvalues.min() <= 0:
        raise PluginError(
            f"law '{law.name}': the stiffness must be symmetric and positive definite, but its "
            f"smallest eigenvalue is {eigenvalues.min():.3g}"
        )
    if (np.diff(np.diagonal(matrices, axis1=1, axis2=2), axis=0) <= 0).any():
        raise PluginError(f"law '{law.name}': the stiffness must rise with density")
    _check_law_bounds(law)
    step = 1e-6 * (b - a)
    inner = rho[1:-1]
    slope = (law.stiffness(inner + step) - law.stiffness(inner - step)) / (2 * step)
    derivative = law.stiffness_derivative(inner)
    if not np.allclose(derivative, slope, rtol=1e-4, atol=1e-6):
        raise PluginError(
            f"law '{law.name}': the stiffness derivative is off by "
            f"{np.abs(derivative - slope).max():.3g} from differences"
        )


def check_component(component: SolidComponent, lower: ArrayLike, upper: ArrayLike) -> None:
    """Check that a solid component keeps what the lattice's field relies on, in the box of a part.

    Output that follows the shape of the input; finite values; an unmodified input; a slope of one
    at most, which bounds of its distance from a coarse grid need; a place of the box that it holds;
    a positive least thickness.

    Parameters
    ----------
    component : SolidComponent
    lower, upper : (3,) array_like, mm
        The part is taken for the box between these corners.

    Raises
    ------
    PluginError
        Naming the component, what was found and what was expected.
    """
    low, high = (np.asarray(end, dtype=np.float64)[:, None] for end in (lower, upper))
    points = low + (high - low) * spread_points(_IN_BOX)
    before, name = points.copy(), f"component '{component.name}'"

    def distance(at: FloatArray) -> FloatArray:
        shape = (3, *[1] * (at.ndim - 1))
        to_faces = np.maximum(low.reshape(shape) - at, at - high.reshape(shape)).max(axis=0)
        return np.asarray(component.distance(at, to_faces))

    values = distance(points)
    grid = distance(points[:, :60].reshape(3, 3, 4, 5))
    if values.shape != (_IN_BOX,) or not np.array_equal(grid.ravel(), values[:60]):
        raise PluginError(
            f"{name}: values depend on the shape of the array of points; use axis 0 for the "
            f"coordinates only, and return (...) for points (3, ...)"
        )
    if not np.array_equal(points, before):
        raise PluginError(f"{name}: the distance changed its input")
    if not np.isfinite(values).all():
        raise PluginError(f"{name}: the distance is not finite everywhere in the part")
    step = 1e-6 * float(np.linalg.norm(high - low))
    steepest = float(np.linalg.norm(gradient(distance, points, step), axis=0).max())
    if steepest > 1.0 + _STEEPER:
        raise PluginError(
            f"{name}: the distance changes by {steepest:.4g} mm per mm; expected 1 at most, else "
            f"places are taken for far away that are not: divide it by its slope"
        )
    if not (values < 0).any():
        raise PluginError(f"{name}: holds no place of the part; expected one below 0")
    if not component.least > 0:
        raise PluginError(f"{name}: has a least thickness of {component.least:g} mm, expected more")


def _check_law_bounds(law: ScalingLaw) -> None:
    """Compare a law with the bounds of Voigt and of Hashin and Shtrikman over its window."""
    for rho in np.linspace(*law.window, 41):
        for bound in check_bounds(law.stiffness(np.asarray(rho)), float(rho), law.poissons_ratio):
            # Hill's averages are estimates: no theorem keeps them below the bound.
            if not bound.holds and "Hill" not in bound.name:
                limit = "0 or more" if np.isinf(bound.upper) else f"{bound.upper:.4g} at most"
                raise PluginError(
                    f"law '{law.name}': at density {rho:.4g} the stiffness breaks a bound "
                    f"({bound.name}): {bound.value:.4g} of the base material's Young's modulus, "
                    f"expected {limit}; no solid of that density is so stiff, so check "
                    f"coefficients, exponents and what they are relative to"
                )


def _check_output(family: CellFamily, points: FloatArray) -> FloatArray:
    """Shape, finiteness and an unmodified input."""
    before = points.copy()
    values = evaluate_shape(family, family.parameters, points)
    evaluate_shape(family, family.parameters, points[:, 0])
    grid = evaluate_shape(family, family.parameters, points[:, :60].reshape(3, 3, 4, 5))
    if not np.array_equal(points, before):
        raise PluginError(f"cell '{family.name}': the shape function changed its input")
    if not np.allclose(grid.ravel(), values[:60], rtol=1e-12, atol=1e-12):
        raise PluginError(
            f"cell '{family.name}': values depend on the shape of the array of points; "
            f"use axis 0 for the coordinates only"
        )
    return values


def _check_sides(family: CellFamily, values: FloatArray) -> None:
    """Two-sided shapes are 0 on the middle of the wall and positive elsewhere."""
    nodes = family.period * grid_nodes(_count(family, 48), (0.31, 0.57, 0.83))
    grid = evaluate_shape(family, family.parameters, nodes)
    if values.min() < 0 or grid.min() < 0 or grid.min() > 0.1 * grid.max():
        raise PluginError(
            f"cell '{family.name}' declares sides=2, so its shape must be 0 on the middle of the "
            f"wall and positive elsewhere, but it lies between {grid.min():.3g} and "
            f"{grid.max():.3g}; use abs(f), or sides=1"
        )


def _check_one_side(family: CellFamily) -> None:
    """A shape that is 0 on a surface and rises on both its sides is a sheet, which has two.

    Of a sheet |f| the solid at small levels t fills a share that grows with t, of struts with t^2
    (Cavalieri: surfaces and lines have a reach of t in one and in two directions), and its gradient
    does not vanish at the zero set, as that of a squared distance does. Networks go below 0.
    """
    points = family.period * spread_points(60_000)
    values = np.sort(evaluate_shape(family, family.parameters, points))
    if values[0] < 0:
        return
    few, many = (values[int(share * values.size)] for share in _SHARES)
    spread = float(values[-1] - values[0])
    if few <= 0 or few > 0.1 * spread:
        return
    exponent = np.log(_SHARES[1] / _SHARES[0]) / np.log(many / few)
    # The middle of the least values is not near 0 where the shape touches 0 smoothly.
    linear = abs(values[int(0.5 * _SHARES[0] * values.size)] / few - 0.5) < 0.15
    at = points[:, evaluate_shape(family, family.parameters, points) <= many][:, :400]

    def shape(u: FloatArray) -> FloatArray:
        return evaluate_shape(family, family.parameters, u)

    steep = np.median(np.linalg.norm(gradient(shape, at, 1e-5), axis=0))
    elsewhere = np.median(np.linalg.norm(gradient(shape, points[:, :2000], 1e-5), axis=0))
    if exponent < 1.3 and linear and steep > _STEEP * elsewhere:
        raise PluginError(
            f"cell '{family.name}' declares sides=1, but its shape is 0 on a surface and rises on "
            f"both sides of it, as |f| of a sheet: walls would be taken for half as thick; declare "
            f"sides=2, or return f itself for a network"
        )


def _check_distance(family: CellFamily, points: FloatArray) -> None:
    """A distance has a gradient of length 1 except near ridges and the zero set."""

    def shape(u: FloatArray) -> FloatArray:
        return evaluate_shape(family, family.parameters, u)

    length = np.linalg.norm(gradient(shape, points, 1e-5), axis=0)
    middle = float(np.median(length))
    close = float(np.mean(np.abs(length - 1.0) < 0.05))
    if abs(middle - 1.0) > 0.01 or close < 0.75:
        raise PluginError(
            f"cell '{family.name}' declares distance=True, but its gradient has length "
            f"{middle:.3f} in the middle and only {close:.0%} of it lies within 5 % of 1; "
            f"walls in mm would be wrong: return a distance in cell units, or distance=False"
        )


def _check_struts(family: CellFamily, points: FloatArray, values: FloatArray) -> None:
    """The shape is the distance to the axes and balls that files of beams are written from."""
    axes = None if family.struts is None else family.struts(**family.parameters)
    if axes is None:
        return
    wanted = periodic_distance_to_segments(axes.segments)(points)
    if len(axes.balls):
        balls = periodic_distance_to_segments(np.stack([axes.balls, axes.balls], axis=1))
        wanted = np.minimum(wanted, balls(points) / axes.ball_ratio)
    off = float(np.abs(wanted - values).max())
    if off > 1e-6:
        raise PluginError(
            f"cell '{family.name}' declares struts whose distance differs from its shape by up to "
            f"{off:.3g} cells; beams would be another lattice: return the axes of the shape"
        )


def _count(family: CellFamily, nodes: int) -> int:
    """Nodes along one period, from those along a cell; memory bounds them."""
    return min(nodes * family.period, max(nodes, 96))


def _check_symmetry(family: CellFamily) -> None:
    """Compare the power spectrum of the density rank with its image under each operation.

    The power spectrum does not see translations (screw axes, glide planes) or inversion, and
    neither does the effective stiffness.
    """
    if not _OPERATIONS[family.symmetry]:
        return
    count = _count(family, 24)
    values = evaluate_shape(family, family.parameters, family.period * grid_nodes(count))
    # Averaged ranks of rounded values: monotone in the level, and equal values stay equal.
    rounded = np.round(values / max(float(np.ptp(values)), 1e-300), 5)
    _, inverse, counts = np.unique(rounded, return_inverse=True, return_counts=True)
    rank = ((np.cumsum(counts) - counts / 2) / values.size)[inverse].reshape(values.shape)
    power = np.abs(np.fft.fftn(rank - rank.mean())) ** 2
    waves = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij")).reshape(3, -1)
    for operation in _OPERATIONS[family.symmetry]:
        image = np.mod(np.array(operation) @ waves, count)
        moved = power[image[0], image[1], image[2]].reshape(power.shape)
        error = float(np.abs(moved - power).sum() / power.sum())
        if error > 0.02:
            raise PluginError(
                f"cell '{family.name}' declares symmetry '{family.symmetry}', but {error:.1%} of "
                f"its spectrum changes under {operation}; declare a lower symmetry"
            )


def _check_level(cell: Cell) -> None:
    """The level rises strictly and gives the density asked for."""
    family = cell.family
    density = np.linspace(*cell.window, 41)
    level = cell.level_of(density)
    if (np.diff(level) <= 0).any():
        raise PluginError(f"cell '{family.name}': the level does not rise with density")
    # Not the first points, from which the calibration counts.
    points = family.period * np.mod(spread_points(500_000) + 1 / np.pi, 1.0)
    values = evaluate_shape(family, cell.parameters, points)
    for rho, t in zip(density[::8], level[::8], strict=True):
        share = float(np.mean(values <= t))
        if abs(share - rho) > 0.003:
            raise PluginError(
                f"cell '{family.name}': density {rho:.4f} was asked for, {values.size} points of "
                f"the cell give {share:.4f}; the shape is too rough to be calibrated"
            )


def _check_wall(cell: Cell) -> None:
    """Walls are positive inside the window and thicken with density."""
    family = cell.family
    a, b = cell.window
    wall = wall_mm(calibrate(family, cell.parameters), np.linspace(a, b, 12)[1:], 1.0)
    if wall[0] <= 0 or any(after < before for before, after in pairwise(wall)):
        raise PluginError(
            f"cell '{family.name}': the thinnest wall does not grow with density: {wall}"
        )

"""The cells of a lattice: one, or several that pass into each other by weights from place to place.

Where one cell is alone, the solid is its own. Where two have a weight, their weighted mean is
ranked by density, so that the solid of a stated density has that density whatever the weights are:
see `blend`. A parameter that changes from place to place is a row of cells of one family, each of
them mixed with the next: shape functions take a parameter as one number, because a plugin may build
struts from it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import lcm
from types import MappingProxyType

import numpy as np

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.blend import Blend, Scale, Shift, blend_of, moved, rank
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily, StrutAxes
from gradedesign.geometry.cell.shape import blamed_shape

#: Shift of a cell that lies where the map of the lattice puts it.
_UNMOVED: Shift = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cells:
    """One shape function of all cells of a lattice, and the weight of each from place to place."""

    members: tuple[Cell, ...]
    window: tuple[float, float]  #: Densities for which they can be built.
    #: Subject of the sentence that refuses other densities; not used for a single cell.
    exist: str = ""
    #: cells. By which every member is moved; none of them where it is empty.
    shifts: tuple[Shift, ...] = ()
    #: Of the pairs of members that meet, the lower number first.
    blends: Mapping[tuple[int, int], Blend] = field(default_factory=dict)
    #: Weights where none are given; the first member alone where it is empty.
    usual: tuple[float, ...] = ()
    #: Points ``(3, ...)`` mm to weights ``(n, ...)``, each from 0 to 1, together 1.
    weights: Field | None = None
    #: Cell coordinates ``(3, ...)`` to what the level is more than `level_of` says, where weights
    #: change within a cell.
    excess: Field | None = None

    def __post_init__(self) -> None:
        count = len(self.members)
        object.__setattr__(self, "shifts", self.shifts or (_UNMOVED,) * count)
        object.__setattr__(self, "usual", self.usual or (1.0, *(0.0,) * (count - 1)))
        object.__setattr__(self, "blends", MappingProxyType(dict(self.blends)))

    @property
    def axes(self) -> StrutAxes | None:
        """Axes of the round struts of a single cell; None if there are none."""
        return self.members[0].axes if len(self.members) == 1 else None

    @property
    def period(self) -> int:
        """Cells after which all members repeat."""
        return lcm(*(cell.family.period for cell in self.members))

    def weights_at(self, points: FloatArray) -> FloatArray:
        """Weights of the members at points ``(3, ...)`` mm, ``(n, ...)``."""
        return self._usual(points.shape[1:]) if self.weights is None else self.weights(points)

    def _usual(self, shape: tuple[int, ...]) -> FloatArray:
        return np.stack([np.full(shape, weight) for weight in self.usual])

    def shape(self, u: FloatArray) -> FloatArray:
        """Value whose solid is ``<= level_of(rho)``: a single cell's own, else a density, 0 to 1.

        Returns (...) array.

        ``u (3 + n, ...) or (3, ...)``: cell coordinates, and weights of the n members that sum up
        to 1. Where three have a weight, the two largest count.

        Notes
        -----
        Between members without a blend the larger weight counts.
        """
        if len(self.members) == 1:
            (cell,) = self.members
            return blamed_shape(cell.family)(u[:3], **cell.parameters)
        flat = np.asarray(u).reshape(len(u), -1)
        weights = flat[3:].astype(np.float64) if len(u) > 3 else self._usual(flat.shape[1:])
        first, second, share = largest_two(weights)
        alone = np.where(share > 0.5, second, first)
        result = np.zeros(flat.shape[1])
        for (i, j), blend in self.blends.items():
            at = np.flatnonzero((first == i) & (second == j) & (share > 0) & (share < 1))
            alone[at] = -1
            if at.size:
                result[at] = blend.rank(moved(flat[:3, at], self.shifts[i]), share[at])
        for n in np.unique(alone[alone >= 0]):
            at = np.flatnonzero(alone == n)
            result[at] = rank(self.members[n], moved(flat[:3, at], self.shifts[n]))
        return result.reshape(u.shape[1:])

    def level_of(self, rho: FloatArray | float) -> FloatArray:
        """Level of the solid of relative densities ``(...)``: of several cells the density itself.

        Raises DensityError if a density is outside the window.
        """
        if len(self.members) == 1:
            return self.members[0].level_of(rho)
        values = np.asarray(rho, dtype=np.float64)
        low, high = self.window
        if values.size and not (values.min() >= low - 1e-9 and values.max() <= high + 1e-9):
            raise DensityError(
                f"{self.exist} relative densities {low:.4f} to {high:.4f}, but "
                f"{values.min():.4f} to {values.max():.4f} was asked for"
            )
        return values


def single(cell: Cell) -> Cells:
    """One cell everywhere."""
    return Cells(members=(cell,), window=cell.window)


def cell_pair(
    first: Cell,
    second: Cell,
    *,
    scale: Scale = "rank",
    shift: Shift = _UNMOVED,
    reference: float | None = None,
) -> Cells:
    """Two cells that pass into each other.

    Raises DensityError if there is no density that both have.

    - ``scale``: "rank" or "distance"; common scale on which they mix
    - ``shift``, cells: by which the second is moved. Struts that pass each other do not join; moved
      by half a cell they may, see :func:`gradedesign.geometry.cell.neck.joining_shift`.
    - ``reference``: density of the surfaces from which *distance* counts; the middle of the common
      window without it
    """
    low, high = _common_window((first, second))
    if not low < high:
        raise DensityError(
            f"cells '{first.name}' ({first.window[0]:.4f} to {first.window[1]:.4f}) and "
            f"'{second.name}' ({second.window[0]:.4f} to {second.window[1]:.4f}) have no "
            f"relative density in common; choose other families"
        )
    middle = 0.5 * (low + high) if reference is None else reference
    return Cells(
        members=(first, second),
        window=(low, high),
        exist=f"cells '{first.name}' and '{second.name}' both exist for",
        shifts=(_UNMOVED, shift),
        blends={(0, 1): blend_of(first, second, scale, shift, middle)},
        usual=(0.5, 0.5),
    )


def cell_increments(
    family: CellFamily,
    parameters: Mapping[str, float] | None,
    parameter: str,
    ends: tuple[float, float],
    count: int,
) -> Cells:
    """A family at evenly spread values of one parameter, each passing into the next.

    Raises CaseError if the family has no such parameter, or there is nothing between the ends.
    Raises DensityError if the increments have no density in common.

    ``parameters``: the others. ``ends``: first and last value. ``count``: increments, 2 at least.
    """
    if parameter not in family.parameters:
        names = ", ".join(sorted(family.parameters)) or "none"
        raise CaseError(
            f"cell '{family.name}' has no parameter '{parameter}'; its parameters: {names}"
        )
    if count < 2 or ends[0] == ends[1] or not np.isfinite(ends).all():
        raise CaseError(
            f"{count} increments of '{parameter}' from {ends[0]:g} to {ends[1]:g}; expected two "
            f"or more between different values"
        )
    values = [float(value) for value in np.linspace(*ends, count)]
    cells = tuple(calibrate(family, {**(parameters or {}), parameter: v}) for v in values)
    window = _common_window(cells)
    if not window[0] < window[1]:
        raise DensityError(
            f"cell '{family.name}' has no relative density that it can have at all "
            f"'{parameter}' from {ends[0]:g} to {ends[1]:g}; use a narrower range"
        )
    return Cells(
        members=cells,
        window=window,
        exist=f"cell '{family.name}' exists for all {parameter} from {ends[0]:g} to {ends[1]:g} at",
        blends={
            (n, n + 1): cell_pair(a, b).blends[0, 1] for n, (a, b) in enumerate(pairwise(cells))
        },
        usual=tuple(row_weights(np.array(0.5), count).tolist()),
    )


def row_weights(share: FloatArray, count: int) -> FloatArray:
    """Weights of cells in a row, ``(count, ...)``, from the place along it, 0 to 1, ``(...)``."""
    place = np.clip(share, 0.0, 1.0) * (count - 1)
    number = np.arange(count).reshape(-1, *(1,) * np.ndim(share))
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(place - number)))


def largest_two(weights: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Numbers of the two largest weights at every point, and the share of the second.

    ``weights (n, m)``. Returns ``first``, ``second``, each (m,): the lower number first; the same
    twice where one cell is alone; ``share (m,)``: of the second, 0 to 1.
    """
    order = np.argsort(-weights, axis=0, kind="stable")
    every = np.arange(weights.shape[1])
    heaviest, next_heaviest = order[0], order[min(1, len(weights) - 1)]
    next_heaviest = np.where(weights[next_heaviest, every] > 0, next_heaviest, heaviest)
    first, second = np.minimum(heaviest, next_heaviest), np.maximum(heaviest, next_heaviest)
    low, high = weights[first, every], weights[second, every]
    share = np.where(first == second, 0.0, high / (low + high))
    return first, second, share


def _common_window(cells: Sequence[Cell]) -> tuple[float, float]:
    """Densities that all cells have; empty where low is not below high."""
    return max(cell.window[0] for cell in cells), min(cell.window[1] for cell in cells)

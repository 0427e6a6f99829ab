"""Several cells in one lattice, with transitions where two of them meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import DensityError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.transition import CellTransition, rank


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellMix:
    """A shape function with the weight of every cell behind the cell coordinates.

    Attributes
    ----------
    cells : tuple of Cell
        The first one stands where it would stand alone.
    shifts : tuple of (float, float, float), cells
        By which every cell is moved.
    transitions : mapping of (int, int) to CellTransition
        Of pairs of cells that meet, the lower number first; shifts are relative to that cell.
    """

    cells: tuple[Cell, ...]
    shifts: tuple[tuple[float, float, float], ...]
    transitions: Mapping[tuple[int, int], CellTransition]

    def __post_init__(self) -> None:
        object.__setattr__(self, "transitions", MappingProxyType(dict(self.transitions)))

    def shape(self, u: FloatArray) -> FloatArray:
        """Density at which points become solid, 0 to 1; the solid of density rho is ``<= rho``.

        Parameters
        ----------
        u : (3 + n, ...) or (3, ...) array
            Cell coordinates, and weights of the n cells that sum up to 1; without them the first
            cell alone. Where three have a weight, which zones rule out inside the part, the two
            largest count.

        Returns
        -------
        (...) array

        Notes
        -----
        Pairs without a transition meet outside the part only; there the larger weight counts.
        """
        flat = np.asarray(u).reshape(len(u), -1)
        if len(u) == 3:
            flat = np.concatenate([flat, np.zeros((len(self.cells), flat.shape[1]))])
            flat[3] = 1.0
        first, second, share = largest_two(flat[3:].astype(np.float64))
        result = np.zeros(flat.shape[1])
        for i, j in {*zip(first.tolist(), second.tolist(), strict=True)}:
            at = (first == i) & (second == j)
            moved = flat[:3, at] - np.asarray(self.shifts[i], dtype=flat.dtype)[:, None]
            mixed = self.transitions.get((i, j))
            if mixed is not None:
                weight = share[at][None].astype(flat.dtype)
                result[at] = mixed.shape(np.concatenate([moved, weight]))
                continue
            alone = np.where(share[at] > 0.5, j, i)
            for n in np.unique(alone):
                here = np.flatnonzero(at)[alone == n]
                shift = np.asarray(self.shifts[n], dtype=flat.dtype)[:, None]
                result[here] = rank(self.cells[n], flat[:3, here] - shift)
        return result.reshape(u.shape[1:])

    def level_of(self, rho: FloatArray | float) -> FloatArray:
        """The level of a density is the density itself.

        Raises
        ------
        DensityError
            If no cell exists at a density.
        """
        values = np.asarray(rho, dtype=np.float64)
        low = min(cell.window[0] for cell in self.cells)
        high = max(cell.window[1] for cell in self.cells)
        if values.size and not (values.min() >= low - 1e-9 and values.max() <= high + 1e-9):
            raise DensityError(
                f"the cells {', '.join(cell.name for cell in self.cells)} exist for relative "
                f"densities {low:.4f} to {high:.4f}, but {values.min():.4f} to "
                f"{values.max():.4f} was asked for"
            )
        return values


def largest_two(weights: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Numbers of the two largest weights at every point, and the share of the second.

    Parameters
    ----------
    weights : (n, m) array

    Returns
    -------
    first, second : (m,) arrays
        The lower number first; the same twice where one cell is alone.
    share : (m,) array
        Of the second, 0 to 1.
    """
    order = np.argsort(-weights, axis=0, kind="stable")
    every = np.arange(weights.shape[1])
    heaviest, next_heaviest = order[0], order[min(1, len(weights) - 1)]
    next_heaviest = np.where(weights[next_heaviest, every] > 0, next_heaviest, heaviest)
    first, second = np.minimum(heaviest, next_heaviest), np.maximum(heaviest, next_heaviest)
    low, high = weights[first, every], weights[second, every]
    share = np.where(first == second, 0.0, high / (low + high))
    return first, second, share

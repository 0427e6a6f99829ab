"""One family whose parameter changes from place to place, with exact density everywhere.

Shape functions take a parameter as one number, because a plugin may build struts from it. So the
family is calibrated at some values, neighbours among them are mixed as two families are, and every
mix is calibrated again: see :mod:`gradedesign.geometry.cell.transition`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.transition import CellTransition, cell_transition


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellIncrements:
    """A shape function with a place between increments as fourth cell coordinate.

    Attributes
    ----------
    parameter : str
    values : (k,) array
        Of the parameter, evenly spread, at the increments.
    cells : tuple of k Cell
    steps : tuple of k - 1 CellTransition
        From each increment to the next.
    window : (float, float)
        Densities that all increments have.
    """

    parameter: str
    values: FloatArray
    cells: tuple[Cell, ...]
    steps: tuple[CellTransition, ...]
    window: tuple[float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", locked(self.values, (None,), name="values"))

    def shape(self, u: FloatArray) -> FloatArray:
        """Density at which points become solid, 0 to 1; the solid of density rho is ``<= rho``.

        Parameters
        ----------
        u : (4, ...) or (3, ...) array
            Cell coordinates, and the place from the first increment, 0, to the last, 1; without it
            one half.

        Returns
        -------
        (...) array
        """
        flat = np.asarray(u).reshape(len(u), -1)
        share = np.full(flat.shape[1], 0.5) if len(u) == 3 else np.clip(flat[3], 0.0, 1.0)
        place = share.astype(np.float64) * len(self.steps)
        below = np.minimum(place.astype(np.int64), len(self.steps) - 1)
        result = np.zeros(flat.shape[1])
        for n in np.unique(below):
            at = below == n
            mixed = np.concatenate([flat[:3, at], (place[at] - n)[None].astype(flat.dtype)])
            result[at] = self.steps[n].shape(mixed)
        return result.reshape(u.shape[1:])

    def level_of(self, rho: FloatArray | float) -> FloatArray:
        """The level of a density is the density itself.

        Raises
        ------
        DensityError
            If a density is outside the window that all increments share.
        """
        values = np.asarray(rho, dtype=np.float64)
        low, high = self.window
        if values.size and not (values.min() >= low - 1e-9 and values.max() <= high + 1e-9):
            raise DensityError(
                f"cell '{self.cells[0].family.name}' exists for all {self.parameter} from "
                f"{self.values[0]:g} to {self.values[-1]:g} at relative densities {low:.4f} to "
                f"{high:.4f}, but {values.min():.4f} to {values.max():.4f} was asked for"
            )
        return values


def cell_increments(
    family: CellFamily,
    parameters: Mapping[str, float] | None,
    parameter: str,
    ends: tuple[float, float],
    count: int,
) -> CellIncrements:
    """Calibrate a family at evenly spread values of one parameter.

    Parameters
    ----------
    family : CellFamily
    parameters : mapping of str to float or None
        The others.
    parameter : str
    ends : (float, float)
        First and last value.
    count : int
        Increments, 2 at least.

    Returns
    -------
    CellIncrements

    Raises
    ------
    CaseError
        If the family has no such parameter, or there is nothing between the ends.
    DensityError
        If the increments have no density in common.
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
    values = np.linspace(*ends, count)
    cells = tuple(calibrate(family, {**(parameters or {}), parameter: float(v)}) for v in values)
    window = (max(c.window[0] for c in cells), min(c.window[1] for c in cells))
    if not window[0] < window[1]:
        raise DensityError(
            f"cell '{family.name}' has no relative density that it can have at all "
            f"'{parameter}' from {ends[0]:g} to {ends[1]:g}; use a narrower range"
        )
    steps = tuple(cell_transition(a, b) for a, b in pairwise(cells))
    return CellIncrements(
        parameter=parameter, values=values, cells=cells, steps=steps, window=window
    )

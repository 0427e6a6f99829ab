"""A cell family: one scalar shape function of cell coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from numbers import Real
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.errors import PluginError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StrutAxes:
    """Round struts of one cell; their radius is the level of the cell.

    Attributes
    ----------
    segments : (k, 2, 3) array, cell units
        Both ends of every strut; copies a whole number of cells apart belong to them.
    balls : (b, 3) array, cell units
        Nodes with balls, one of each set of copies.
    ball_ratio : float
        Radius of a ball by that of a strut.
    """

    segments: FloatArray
    balls: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    ball_ratio: float = 1.0

    def __post_init__(self) -> None:
        lock(self, segments=(None, 2, 3), balls=(None, 3))


Symmetry = Literal["cubic", "tetragonal", "orthotropic", "none"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class CellFamily(ShownRecord):
    """A family of lattice cells, ordered by one level.

    The solid is ``shape(u, **parameters) <= t``; relative density is the distribution of the
    shape function and the level of a density its quantile, so a plugin supplies only ``shape``.

    Attributes
    ----------
    name : str
        Lower case with dashes: ``<surface>-sheet`` (level), ``<surface>-wall`` (constant
        thickness), ``<surface>-network``; struts by their usual names.
    shape : callable
        ``shape(u, **parameters)``; u is ``(3, ...)`` in cell units, the result ``(...)``. It
        repeats after ``period`` cells along each axis.
    source : str
        Where the formula comes from.
    parameters : mapping of str to float
        Defaults of the shape's keyword arguments.
    distance : bool
        True if ``shape`` is a true distance in cell units, so that a wall is ``2 t`` thick
        (struts: ``t`` is a radius).
    symmetry : {"cubic", "tetragonal", "orthotropic", "none"}
        Declared point symmetry of the effective stiffness.
    sides : {1, 2}
        2 where the solid is a sheet ``|f| <= t`` bounded on both sides, else 1.
    period : int
        Whole number of cells after which ``shape`` repeats along each axis: 1, or for random cells
        the window over which they are calibrated. A cell then is a mean cell of that window.
    open_void : bool
        False where the void is meant to be closed pores, or channels that do not lead through the
        cell in three directions: then only the solid must be connected, and powder or resin stays
        in the pores.
    wall : float, optional, cells
        Thinnest wall at any density, where it does not follow from the shape.
    signed : callable, optional
        ``signed(u, **parameters)`` of a sheet: `shape` is its absolute value, its sign tells the
        two sides of the middle surface. Between two such sheets a transition stays a sheet.
    struts : callable, optional
        ``struts(**parameters) -> StrutAxes`` where the cell is made of round struts with the level
        as their radius; None where it is not, or not with these parameters.

    Raises
    ------
    PluginError
        If the period is not a whole number above 0, the sides are not 1 or 2, the symmetry is
        unknown, the shape cannot be called, or a parameter is no finite number.
    """

    name: str
    shape: Callable[..., FloatArray]
    source: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    distance: bool = False
    symmetry: Symmetry = "cubic"
    sides: Literal[1, 2] = 1
    period: int = 1
    open_void: bool = True
    struts: Callable[..., StrutAxes | None] | None = None
    signed: Callable[..., FloatArray] | None = None
    wall: float | None = None

    def __post_init__(self) -> None:
        if not (isinstance(self.period, int) and self.period >= 1):
            raise PluginError(
                f"cell '{self.name}' declares period {self.period!r}, expected a whole number of "
                f"cells, 1 or more"
            )
        if self.sides not in (1, 2):
            raise PluginError(
                f"cell '{self.name}' declares sides={self.sides!r}, expected 2 for a sheet that is "
                f"solid where |f| <= t, else 1"
            )
        if self.symmetry not in get_args(Symmetry):
            raise PluginError(
                f"cell '{self.name}' declares symmetry {self.symmetry!r}, expected one of "
                f"{', '.join(get_args(Symmetry))}; 'none' is safe"
            )
        if not callable(self.shape):
            raise PluginError(
                f"cell '{self.name}' has the shape {self.shape!r}, expected a function of points "
                f"(3, ...) in cells"
            )
        for name, value in self.parameters.items():
            if isinstance(value, bool) or not isinstance(value, Real) or not isfinite(value):
                raise PluginError(
                    f"cell '{self.name}': parameter {name} is {value!r}, expected a finite number"
                )
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))


def _bars(u: FloatArray) -> FloatArray:
    """Distance to the nearest of three bars along the axes through a corner, in cells."""
    square = (u - np.round(u)) ** 2
    return np.asarray(np.sqrt(square.sum(axis=0) - square.max(axis=0)))


#: Bars that stand for solid members in what is planned before any design, in cells as large as
#: these are thick: none of them is built.
VOID = CellFamily(name="void", shape=_bars, source="not built", distance=True, wall=1.0)

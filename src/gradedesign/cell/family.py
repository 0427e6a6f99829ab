"""A cell family: one scalar shape function of cell coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from gradedesign.arrays import FloatArray

Symmetry = Literal["cubic", "tetragonal", "orthotropic", "none"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellFamily:
    """A family of lattice cells, ordered by one level.

    The solid is ``shape(u, **parameters) <= t``; relative density is the distribution of the
    shape function and the level of a density its quantile, so a plugin supplies only ``shape``.

    Attributes
    ----------
    name : str
        Lower case with dashes: ``<surface>-sheet`` (level), ``<surface>-wall`` (constant
        thickness), ``<surface>-network``; struts by their usual names.
    shape : callable
        ``shape(u, **parameters)``; u is ``(3, ...)`` in cell units, the result ``(...)``; period 1.
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
    """

    name: str
    shape: Callable[..., FloatArray]
    source: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    distance: bool = False
    symmetry: Symmetry = "cubic"
    sides: Literal[1, 2] = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

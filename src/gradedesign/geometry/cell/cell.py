"""A cell that can be built: family, parameters, and the calibration of its level."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.common.system.cache import content_key
from gradedesign.common.system.program_key import program_key
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.errors import DensityError, blaming
from gradedesign.geometry.cell.family import CellFamily, StrutAxes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Cell(ShownRecord):
    """A family with its parameters, and the monotone relation of its level and density.

    Made by `calibration.calibrate`, once for a process.
    """

    family: CellFamily
    parameters: Mapping[str, float]  #: Complete.
    density: FloatArray  #: ``(k,)``. The table, increasing, over densities 0 to 1.
    level: FloatArray  #: ``(k,)``. The table, increasing, over densities 0 to 1.
    #: Densities between which solid and void percolate, see `percolation`.
    window: tuple[float, float]
    #: Point in cell units, of the first period, where the last connection of the solid forms.
    neck: tuple[float, float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))
        lock(self, density=(None,), level=(None,))

    @property
    def name(self) -> str:
        """Name of the family."""
        return self.family.name

    @property
    def axes(self) -> StrutAxes | None:
        """Axes of the round struts; None if the cell does not consist of round struts.

        Raises `PluginError` if the family fails to give them.
        """
        if self.family.struts is None:
            return None
        with blaming(f"cell '{self.name}'"):
            return self.family.struts(**self.parameters)

    def level_of(self, rho: FloatArray | float) -> FloatArray:
        """Level ``t`` at which the cell ``g <= t`` has relative density ``rho``, ``(...)``.

        Raises `DensityError` if a density is outside the window.
        """
        values = np.asarray(rho, dtype=np.float64)
        a, b = self.window
        outside = ~((values >= a - 1e-9) & (values <= b + 1e-9))
        if outside.any():
            bad = values[outside]
            raise DensityError(
                f"cell '{self.name}' exists for relative densities {a:.4f} to {b:.4f}, "
                f"but {bad.min():.4f} to {bad.max():.4f} was asked for: below, the solid falls "
                f"apart; above, the void closes; narrow [lattice] density or take another cell"
            )
        return np.asarray(np.interp(values, self.density, self.level))

    def density_of(self, level: FloatArray | float) -> FloatArray:
        """Relative density of ``g <= level``, ``(...)``; 0 below all values, 1 above."""
        values = np.asarray(level, dtype=np.float64)
        return np.asarray(np.interp(values, self.level, self.density, left=0.0, right=1.0))


#: Points of a period at which a cell's field is told from every other. Chosen, not measured.
_PROBES = 2000


def cell_key(cell: Cell) -> str:
    """Content key of a cell with its parameters and levels, for answers kept in the user's cache.

    Returns str: another one wherever the field, its levels or the program changed.
    """
    family, parameters = cell.family, dict(cell.parameters)
    points = np.random.default_rng(1).uniform(0.0, float(family.period), (3, _PROBES))
    densities = np.linspace(*cell.window, 17)
    return content_key(
        program_key(),
        family.name,
        family.period,
        np.asarray(family.shape(points, **parameters)),
        np.array(cell.neck),
        densities,
        np.asarray(cell.level_of(densities)),
    )

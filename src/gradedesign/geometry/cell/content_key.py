"""Content key of a cell: its field at points of a period, since names may be equal."""

from __future__ import annotations

import numpy as np

from gradedesign.common.system.cache import content_key
from gradedesign.common.system.program_key import program_key
from gradedesign.geometry.cell.cell import Cell

#: Points of a period at which a cell's field is told from every other. Chosen, not measured.
_PROBES = 2000


def cell_key(cell: Cell) -> str:
    """Content key of a cell with its parameters and levels, for answers kept in the user's cache.

    Returns
    -------
    str
        Another one wherever the field, its levels or the program changed.
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

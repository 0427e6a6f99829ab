"""The record of how stiff few cells are against the endless lattice, and its plain file form."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NoReturn

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import PluginError

#: Changes whenever a table written by an older version could not be read as it was meant.
FORMAT = 1

_MARK = "gradedesign finite size table"
_HEAD = (_MARK, "family", "parameters", "poissons_ratio", "method", "version", "date", "rows")
_ROW = ("density", "resolution", "block", "wall", "wall_shear")


@dataclass(frozen=True, slots=True, kw_only=True)
class FiniteRatio:
    """Stiffness of some cells over that of the endless lattice.

    Attributes
    ----------
    cells : int
        Along each edge of a block, or across a wall.
    value : float
        Mean over cells that begin at their corner and half a cell in.
    error : float
        Change from the coarser grid to the finer, and what the solves leave.
    spread : float
        Half the difference between the two beginnings.
    """

    cells: int
    value: float
    error: float
    spread: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FiniteSizeRow:
    """Ratios at one density, each series by rising number of cells, from one cell on.

    Attributes
    ----------
    density : float
    resolution : int
        Voxels along a cell of the finer grid; the coarser has two thirds of them.
    block : tuple of FiniteRatio
        Young's modulus of cubes of cells between smooth plates, sides free.
    wall, wall_shear : tuple of FiniteRatio
        Young's and shear modulus in the plane of a wall, faces free.
    """

    density: float
    resolution: int
    block: tuple[FiniteRatio, ...]
    wall: tuple[FiniteRatio, ...]
    wall_shear: tuple[FiniteRatio, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FiniteSizeTable:
    """Finite-size ratios of one cell family with the parameters given.

    Attributes
    ----------
    family : str
        Also the name of the table: each family has one.
    parameters : mapping of str to float
        Complete.
    poissons_ratio : float
        Of the base material.
    rows : tuple of FiniteSizeRow
        By rising density.
    method, version, date : str
        Provenance: how, with which version of gradedesign and when it was computed.
    """

    family: str
    parameters: Mapping[str, float]
    poissons_ratio: float
    rows: tuple[FiniteSizeRow, ...]
    method: str
    version: str
    date: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))
        found = [row.density for row in self.rows]
        if len(found) < 2 or found[0] <= 0 or any(b <= a for a, b in pairwise(found)):
            raise ValueError(
                f"finite size table '{self.family}' needs two or more increasing positive "
                f"densities, found {found}"
            )
        for row in self.rows:
            for key in ("block", "wall", "wall_shear"):
                _check_series(getattr(row, key), f"'{self.family}' at {row.density:g}, {key}")

    @property
    def name(self) -> str:
        """The family's."""
        return self.family

    @property
    def density(self) -> FloatArray:
        """Densities ``(k,)``."""
        return np.array([row.density for row in self.rows])


def ratio_at(series: tuple[FiniteRatio, ...], per_cell: FloatArray) -> FloatArray:
    """Ratio for any number of cells, linear in its inverse and 1 for endlessly many.

    Parameters
    ----------
    series : tuple of FiniteRatio
    per_cell : (...) array
        One over the number of cells, 0 to 1.

    Returns
    -------
    (...) array

    Raises
    ------
    ValueError
        Below one cell, where nothing was computed.
    """
    x = np.asarray(per_cell, dtype=np.float64)
    if not ((x >= 0) & (x <= 1)).all():
        raise ValueError(
            f"ratios are known from one cell on, found {1 / np.max(x, initial=1e-9):g} cells"
        )
    known = [(0.0, 1.0), *((1 / r.cells, r.value) for r in reversed(series))]
    at, value = np.array(known).T
    return np.asarray(np.interp(x, at, value))


def write_finite_size_table(table: FiniteSizeTable) -> str:
    """Text of a table: JSON, one line for each density."""
    head = {
        _MARK: FORMAT,
        "family": table.family,
        "parameters": dict(table.parameters),
        "poissons_ratio": table.poissons_ratio,
        "method": table.method,
        "version": table.version,
        "date": table.date,
    }
    rows = [
        {
            "density": row.density,
            "resolution": row.resolution,
            **{
                key: [
                    [r.cells, round(r.value, 4), round(r.error, 4), round(r.spread, 4)]
                    for r in getattr(row, key)
                ]
                for key in ("block", "wall", "wall_shear")
            },
        }
        for row in table.rows
    ]
    lines = [f"  {json.dumps(k)}: {json.dumps(v)}," for k, v in head.items()]
    body = ",\n".join("    " + json.dumps(row) for row in rows)
    return "{\n" + "\n".join(lines) + '\n  "rows": [\n' + body + "\n  ]\n}\n"


def read_finite_size_table(text: str) -> FiniteSizeTable:
    """Parse what `write_finite_size_table` wrote.

    Parameters
    ----------
    text : str

    Returns
    -------
    FiniteSizeTable

    Raises
    ------
    PluginError
        If the text is no such table, is damaged, or of another format version.
    """
    try:
        data: dict[str, Any] = json.loads(text, parse_constant=_no_constant)
        found = data[_MARK]
    except (ValueError, KeyError, TypeError) as error:
        raise PluginError(
            f"this is no finite size table of gradedesign ({type(error).__name__}: {error}); "
            f"expected JSON with the key '{_MARK}'"
        ) from error
    if found != FORMAT or isinstance(found, bool):
        raise PluginError(
            f"finite size table '{data.get('family')}' has format {found!r}, this version of "
            f"gradedesign reads {FORMAT}; compute it again, or install the matching plugin"
        )
    try:
        return _table(data)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise PluginError(
            f"finite size table '{data.get('family')}' is damaged ({type(error).__name__}: "
            f"{error}); compute it again, or install the plugin again"
        ) from error


def _table(data: Mapping[str, Any]) -> FiniteSizeTable:
    """Build the record from parsed text."""
    _require_keys(data, _HEAD)
    return FiniteSizeTable(
        family=_text(data["family"]),
        parameters={_text(k): _number(v) for k, v in data["parameters"].items()},
        poissons_ratio=_number(data["poissons_ratio"]),
        rows=tuple(_row(row) for row in data["rows"]),
        method=_text(data["method"]),
        version=_text(data["version"]),
        date=_text(data["date"]),
    )


def _row(data: Mapping[str, Any]) -> FiniteSizeRow:
    _require_keys(data, _ROW)
    series = {
        key: tuple(
            FiniteRatio(
                cells=_count(cells),
                value=_number(value),
                error=_number(error),
                spread=_number(spread),
            )
            for cells, value, error, spread in data[key]
        )
        for key in ("block", "wall", "wall_shear")
    }
    return FiniteSizeRow(
        density=_number(data["density"]), resolution=_count(data["resolution"]), **series
    )


def _check_series(series: tuple[FiniteRatio, ...], where: str) -> None:
    """Refuse ratios without a beginning or order, or that cannot be stiffness."""
    cells = [r.cells for r in series]
    if not cells or cells[0] != 1 or any(b <= a for a, b in pairwise(cells)):
        raise ValueError(f"{where}: found {cells} cells; expected a rising series from 1 on")
    for r in series:
        if not (r.value > 0 and r.error >= 0 and r.spread >= 0):
            raise ValueError(f"{where}: {r} is no ratio; expected a positive value with its errors")


def _require_keys(data: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    if set(data) != set(keys):
        raise ValueError(f"found the keys {sorted(data)}, expected {sorted(keys)}")


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"found {name}, expected finite numbers")


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise TypeError(f"found {value!r}, expected a number")
    return float(value)


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise TypeError(f"found {value!r}, expected a whole number from 1 on")
    return value


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"found {value!r}, expected text")
    return value

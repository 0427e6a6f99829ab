"""The record of the macroscopic stresses at which a cell buckles, and its plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked

#: Names of the twelve loads, in the order of ``critical``: Voigt component, sense.
LOADS = tuple(
    f"{sense} {component}"
    for component in ("xx", "yy", "zz", "yz", "xz", "xy")
    for sense in ("negative", "positive")
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BucklingTable:
    """Macroscopic stresses at which one cell buckles, at some densities."""

    density: FloatArray  #: ``(k,)``. Increasing.
    #: ``(k, 6, 2)``. Size of each Voigt component of stress, in the cell's axes, that buckles the
    #: cell if it acts alone: negative (compression) and positive (tension), over the base
    #: material's Young's modulus; extrapolated to no voxels.
    critical: FloatArray
    #: ``(k, 6, 2)``. After how many cells the mode repeats, 1 or 2. 0 where the cell was not seen
    #: to buckle: it does not below the value.
    cells: IntArray
    error: FloatArray  #: ``(k,)``. Largest share that the extrapolation changed.
    resolution: IntArray  #: ``(k,)``. Voxels along the cell; the second grid has half of them.
    wall_voxels: FloatArray  #: ``(k,)``. Voxels across the thinnest wall of the finer grid.
    poissons_ratio: float  #: Of the base material.
    method: str
    version: str
    date: str

    def __post_init__(self) -> None:
        k = np.asarray(self.density).size
        for key, shape, dtype in (
            ("density", (k,), np.float64),
            ("critical", (k, 6, 2), np.float64),
            ("cells", (k, 6, 2), np.int64),
            ("error", (k,), np.float64),
            ("resolution", (k,), np.int64),
            ("wall_voxels", (k,), np.float64),
        ):
            value = locked(getattr(self, key), shape, dtype=dtype, name=key)
            object.__setattr__(self, key, value)
        if k < 2 or (np.diff(self.density) <= 0).any() or not self.density[0] > 0:
            raise ValueError(
                f"a table of buckling needs two or more increasing positive densities, found "
                f"{self.density.tolist()}"
            )
        if not (np.isfinite(self.critical).all() and (self.critical > 0).all()):
            raise ValueError("the critical stresses of a table of buckling must be positive")


def buckling_entry(table: BucklingTable) -> dict[str, Any]:
    """Plain data of a table of buckling."""
    return {
        "loads": list(LOADS),
        "unit": "base material's Young's modulus",
        "poissons_ratio": table.poissons_ratio,
        "method": table.method,
        "version": table.version,
        "date": table.date,
        "rows": [
            {
                "density": float(f"{table.density[i]:.7g}"),
                "resolution": int(table.resolution[i]),
                "wall_voxels": float(f"{table.wall_voxels[i]:.3g}"),
                "critical": [float(f"{v:.4g}") for v in table.critical[i].ravel()],
                "cells": [int(c) for c in table.cells[i].ravel()],
                "error": float(f"{table.error[i]:.2g}"),
            }
            for i in range(table.density.size)
        ],
    }


def buckling_from_entry(entry: Mapping[str, Any]) -> BucklingTable:
    """Record of what `buckling_entry` wrote.

    Raises `ValueError`, `KeyError` or `TypeError` if the entry is damaged.
    """
    rows = entry["rows"]
    if tuple(entry["loads"]) != LOADS:
        raise ValueError(f"loads {entry['loads']!r} are not known; expected {list(LOADS)!r}")
    count = len(rows)
    return BucklingTable(
        density=np.array([row["density"] for row in rows], dtype=np.float64),
        critical=np.array([row["critical"] for row in rows], dtype=np.float64).reshape(count, 6, 2),
        cells=np.array([row["cells"] for row in rows], dtype=np.int64).reshape(count, 6, 2),
        error=np.array([row["error"] for row in rows], dtype=np.float64),
        resolution=np.array([row["resolution"] for row in rows], dtype=np.int64),
        wall_voxels=np.array([row["wall_voxels"] for row in rows], dtype=np.float64),
        poissons_ratio=float(entry["poissons_ratio"]),
        method=str(entry["method"]),
        version=str(entry["version"]),
        date=str(entry["date"]),
    )

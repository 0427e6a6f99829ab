"""The record of a reader of fields: densities, or directions, that a case names by a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradedesign.arrays import Field, FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DensityRequest:
    """A density map that a case names, and the part that it is for.

    Attributes
    ----------
    spec : table ``[lattice.density_map]``
        As the case states it.
    lower, upper : (3,) array, mm
        The part's box.
    cell_size : float, mm
    spacing : float, mm
        Of the grid on which the lattice holds its density.
    grey : (float, float) or None
        Densities of black and white.
    memory_limit_bytes : int
        What reading the map and using it may take.
    """

    spec: Any
    lower: FloatArray
    upper: FloatArray
    cell_size: float
    spacing: float
    grey: tuple[float, float] | None
    memory_limit_bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldReader:
    """Reads fields from one kind of file.

    Attributes
    ----------
    name : str
        Key of ``[lattice.density_map]`` that names the file, such as ``points``.
    density : callable
        ``density(request)`` of a `DensityRequest`: a function of points ``(3, n)`` mm that gives
        relative densities ``(n,)``, evaluated in the part and near it.
    tensors : callable or None
        ``tensors(path, field, memory_limit_bytes)``: a function of points ``(3, ...)`` mm that
        gives tensors ``(3, 3, ...)`` whose principal directions cells follow, where
        ``[lattice.orientation]`` may name the file too.
    """

    name: str
    density: Callable[[DensityRequest], Field]
    tensors: Callable[[Path, str | None, int], Field] | None = None

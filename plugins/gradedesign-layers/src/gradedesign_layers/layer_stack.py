"""Layers of a print as runs of solid pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.fields import BoolArray, FloatArray, IntArray
from gradedesign_layers import _run_kernels as kernels


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """Solid pixels of one layer.

    Attributes
    ----------
    first : (nx + 1,) int array
        Number of the first run of every row of pixels along y.
    ends : (k, 2) int32 array
        First pixel of every run, and the one behind its last.
    beside : (m,) float32 array
        Field at the pixels with a neighbour that is not as they are, row by row.
    """

    first: IntArray
    ends: NDArray[np.int32]
    beside: NDArray[np.float32]

    @property
    def count(self) -> int:
        """Number of solid pixels."""
        return int((self.ends[:, 1] - self.ends[:, 0]).sum())

    def solid(self, ny: int) -> BoolArray:
        """Solid pixels, ``(nx, ny)``."""
        pixels = np.zeros((len(self.first) - 1, ny), dtype=bool)
        kernels.fill_runs(self.first, self.ends, pixels)
        return pixels


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layers:
    """Layers of a lattice in the axes of the machine.

    Attributes
    ----------
    frame : (3, 3) array
        Rows are the machine's axes; its origin is the part's.
    lower : (3,) array, mm
        Centre of the first pixel, and underside of the first layer.
    shape : (int, int)
        Pixels along x and y; the outer ones are empty.
    pixel, height : float, mm
        Edge of a pixel, and thickness of a layer.
    dropped : int
        Disconnected components that were left out.
    dropped_share : float
        Their share of the solid pixels before.
    contour_volume : float or None, mm^3
        Inside the contours, where they are printed and pixels hold another volume.
    """

    frame: FloatArray
    lower: FloatArray
    shape: tuple[int, int]
    pixel: float
    height: float
    layers: tuple[Layer, ...]
    dropped: int = 0
    dropped_share: float = 0.0
    contour_volume: float | None = None

    def top(self, number: int) -> float:
        """Upper side of a layer, mm; of -1, the underside of the first."""
        return float(self.lower[2] + (number + 1) * self.height)

    def solid(self, number: int) -> BoolArray:
        """Solid pixels of a layer, ``(nx, ny)``."""
        return self.layers[number].solid(self.shape[1])

    @property
    def words(self) -> str:
        """Number and size of the layers."""
        return f"{len(self.layers)} layers of {self.shape[0]} x {self.shape[1]} pixels"

    @property
    def sizes(self) -> dict[str, float]:
        """Height and pixel, as results name them."""
        return {"layer_height_mm": self.height, "pixel_size_mm": self.pixel}

    @property
    def volume(self) -> float:
        """Of the solid pixels, mm^3."""
        return sum(layer.count for layer in self.layers) * self.pixel**2 * self.height

    @property
    def printed_volume(self) -> float:
        """Inside the contours or of the solid pixels, whichever is printed, mm^3."""
        return self.volume if self.contour_volume is None else self.contour_volume

    def axis_volumes(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Solid volume by slices of a pixel or layer across x, y and z of the part.

        That of the pixels, scaled to the printed volume.

        Returns
        -------
        tuple of ((k,) array, (k,) array)
            Middles of the slices along each axis, mm, and the solid volume in them, mm^3.
        """
        along = [np.zeros(n, dtype=np.int64) for n in self.shape]
        for layer in self.layers:
            kernels.count_along(layer.first, layer.ends, *along)
        scale = 1.0 if self.contour_volume is None else self.contour_volume / self.volume
        counts = [*along, np.array([layer.count for layer in self.layers])]
        steps = np.array([self.pixel, self.pixel, self.height])
        middle = self.lower + np.array([0.0, 0.0, 0.5 * self.height])
        volumes = []
        for axis in range(3):
            own = int(np.argmax(np.abs(self.frame[:, axis])))
            places = middle[own] + steps[own] * np.arange(len(counts[own]))
            each = self.pixel**2 * self.height * scale
            volumes.append((self.frame[own, axis] * places, each * counts[own]))
        return tuple(volumes)

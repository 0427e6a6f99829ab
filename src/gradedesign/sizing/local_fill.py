"""Density that the lattice holds near a point beside passive regions, for each nominal one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalFill:
    """Density held near every tetrahedron as a function of the density asked for.

    A passive region that fills the void of cells leaves their struts whole, in less room. Between
    the asked densities the held ones are linear.

    Attributes
    ----------
    asked : (k,) array
        Increasing.
    held : (k, M) array
        Positive, increasing along the first axis.
    """

    asked: FloatArray
    held: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "asked", locked(self.asked, (None,), name="asked"))
        shape = (self.asked.size, None)
        object.__setattr__(self, "held", locked(self.held, shape, name="held"))
        if (
            self.asked.size < 2
            or (np.diff(self.asked) <= 0).any()
            or not (self.held[0] > 0).all()
            or (np.diff(self.held, axis=0) <= 0).any()
        ):
            raise ValueError(
                "densities asked for and held must be positive and increasing, two or more"
            )

    def at(self, rho: FloatArray) -> FloatArray:
        """Density held where ``rho`` is asked for, ``(M,)``; proportional beyond the ends."""
        share = self.held / self.asked[:, None]
        inside = np.clip(rho, self.asked[0], self.asked[-1])
        piece, to_upper, every = self._piece(inside)
        held = (1 - to_upper) * self.held[piece, every] + to_upper * self.held[piece + 1, every]
        below, above = rho < self.asked[0], rho > self.asked[-1]
        return np.where(below, rho * share[0], np.where(above, rho * share[-1], held))

    def slope(self, rho: FloatArray) -> FloatArray:
        """d(held)/d(asked), ``(M,)``."""
        share = self.held / self.asked[:, None]
        piece, _, every = self._piece(np.clip(rho, self.asked[0], self.asked[-1]))
        rise = self.held[piece + 1, every] - self.held[piece, every]
        inner = rise / (self.asked[piece + 1] - self.asked[piece])
        below, above = rho < self.asked[0], rho > self.asked[-1]
        return np.where(below, share[0], np.where(above, share[-1], inner))

    def asked_for(self, held: FloatArray) -> FloatArray:
        """Density to ask for so that ``held`` is there, ``(M,)``."""
        every = np.arange(self.held.shape[1])
        above = (self.held <= held).sum(axis=0)
        piece = np.clip(above - 1, 0, self.asked.size - 2)
        low, high = self.held[piece, every], self.held[piece + 1, every]
        a, b = self.asked[piece], self.asked[piece + 1]
        inner = a + (held - low) / (high - low) * (b - a)
        share = self.held / self.asked[:, None]
        last = self.asked.size - 1
        return np.where(
            held < self.held[0],
            held / share[0],
            np.where(held > self.held[last], held / share[last], inner),
        )

    def _piece(self, rho: FloatArray) -> tuple[IntArray, FloatArray, IntArray]:
        """Interval of every density, how far it lies towards its upper end, and the index."""
        piece = np.clip(np.searchsorted(self.asked, rho, side="right") - 1, 0, self.asked.size - 2)
        width = self.asked[piece + 1] - self.asked[piece]
        return piece, (rho - self.asked[piece]) / width, np.arange(rho.size)

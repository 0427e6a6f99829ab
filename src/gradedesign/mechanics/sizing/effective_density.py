"""Effective relative density of the lattice beside passive regions, for each nominal one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EffectiveDensity:
    """Effective relative density near every tetrahedron as a function of the nominal one.

    A passive region that fills the void of cells leaves their struts whole, in less room. Between
    the nominal densities the effective ones are linear.
    """

    nominal: FloatArray  #: ``(k,)``. Increasing.
    effective: FloatArray  #: ``(k, M)``. Positive, increasing along the first axis.

    def __post_init__(self) -> None:
        object.__setattr__(self, "nominal", locked(self.nominal, (None,), name="nominal"))
        shape = (self.nominal.size, None)
        object.__setattr__(self, "effective", locked(self.effective, shape, name="effective"))
        if (
            self.nominal.size < 2
            or (np.diff(self.nominal) <= 0).any()
            or not (self.effective[0] > 0).all()
            or (np.diff(self.effective, axis=0) <= 0).any()
        ):
            raise ValueError(
                "nominal and effective densities must be positive and increasing, two or more"
            )

    def at(self, rho: FloatArray) -> FloatArray:
        """Effective density where ``rho`` is nominal, ``(M,)``; proportional beyond the ends."""
        share = self.effective / self.nominal[:, None]
        inside = np.clip(rho, self.nominal[0], self.nominal[-1])
        piece, to_upper, every = self._piece(inside)
        effective = (1 - to_upper) * self.effective[piece, every] + to_upper * self.effective[
            piece + 1, every
        ]
        below, above = rho < self.nominal[0], rho > self.nominal[-1]
        return np.where(below, rho * share[0], np.where(above, rho * share[-1], effective))

    def slope(self, rho: FloatArray) -> FloatArray:
        """Derivative of effective by nominal density, ``(M,)``."""
        share = self.effective / self.nominal[:, None]
        piece, _, every = self._piece(np.clip(rho, self.nominal[0], self.nominal[-1]))
        rise = self.effective[piece + 1, every] - self.effective[piece, every]
        inner = rise / (self.nominal[piece + 1] - self.nominal[piece])
        below, above = rho < self.nominal[0], rho > self.nominal[-1]
        return np.where(below, share[0], np.where(above, share[-1], inner))

    def nominal_for(self, effective: FloatArray) -> FloatArray:
        """Nominal density at which ``effective`` is reached, ``(M,)``."""
        every = np.arange(self.effective.shape[1])
        above = (self.effective <= effective).sum(axis=0)
        piece = np.clip(above - 1, 0, self.nominal.size - 2)
        low, high = self.effective[piece, every], self.effective[piece + 1, every]
        a, b = self.nominal[piece], self.nominal[piece + 1]
        inner = a + (effective - low) / (high - low) * (b - a)
        share = self.effective / self.nominal[:, None]
        last = self.nominal.size - 1
        return np.where(
            effective < self.effective[0],
            effective / share[0],
            np.where(effective > self.effective[last], effective / share[last], inner),
        )

    def _piece(self, rho: FloatArray) -> tuple[IntArray, FloatArray, IntArray]:
        """Interval of every density, how far it lies towards its upper end, and the index."""
        piece = np.clip(
            np.searchsorted(self.nominal, rho, side="right") - 1, 0, self.nominal.size - 2
        )
        width = self.nominal[piece + 1] - self.nominal[piece]
        return piece, (rho - self.nominal[piece]) / width, np.arange(rho.size)

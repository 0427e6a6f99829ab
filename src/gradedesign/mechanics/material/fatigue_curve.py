"""S-N curves of the solid material: the stress that it bears for a number of cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class FatigueCurve:
    """Stress amplitude over cycles to failure, of specimens of one surface condition.

    Straight lines between its points on logarithmic axes: of two points Basquin's power law (Proc.
    ASTM 10, 1910).

    Attributes
    ----------
    surface : str
        Condition of the specimens' surface, such as ``"as-built"``.
    ratio : float
        R of the tests: least over largest stress of a cycle, -1 where it is fully reversed.
    cycles : tuple of float
        Rising. Nothing is said below the first and beyond the last.
    amplitude : tuple of float, MPa
        Half of largest less least stress, not rising.
    walker : float
        Walker's exponent gamma, 0 to 1: by 1 the largest stress does not matter, only the amplitude
        does. At 0.5 it is the rule of Smith, Watson and Topper (J. Mater. 5, 1970), and what is
        advised where none is fitted (Dowling 2009, doi 10.1111/j.1460-2695.2009.01404.x).
    source : str
        Where the figures come from: specimens, printer, treatment, and who measured.
    """

    surface: str
    ratio: float
    cycles: tuple[float, ...]
    amplitude: tuple[float, ...]
    walker: float = 0.5
    source: str = "stated in the case"

    def __post_init__(self) -> None:
        cycles, amplitude = np.array(self.cycles), np.array(self.amplitude)
        if not (len(cycles) == len(amplitude) >= 2):
            message = (
                f"found {len(cycles)} cycles and {len(amplitude)} amplitudes; expected as many of "
                f"both, two at least"
            )
            raise ValueError(message)
        if not (cycles[0] > 0 and (np.diff(cycles) > 0).all()):
            message = f"found cycles {list(self.cycles)}; expected rising ones"
            raise ValueError(message)
        if not (amplitude[-1] > 0 and (np.diff(amplitude) <= 0).all()):
            message = (
                f"found amplitudes {list(self.amplitude)} MPa; expected none above the one before: "
                f"more cycles are not borne at more stress"
            )
            raise ValueError(message)
        if not (-1.0 <= self.ratio < 1.0 and 0.0 <= self.walker <= 1.0):
            message = (
                f"found a stress ratio of {self.ratio:g} and a Walker exponent of {self.walker:g}; "
                f"expected -1 to below 1, and 0 to 1"
            )
            raise ValueError(message)

    @property
    def words(self) -> str:
        """Its surface and range, as lists show them: ``as-built (14300 to 2e+06 cycles)``."""
        return f"{self.surface} ({self.cycles[0]:.4g} to {self.cycles[-1]:.4g} cycles)"

    def holds(self, cycles: float) -> bool:
        """Whether a number of cycles lies in its range."""
        return self.cycles[0] <= cycles <= self.cycles[-1]

    def largest_stress(self, cycles: float, ratio: float) -> float:
        """Largest stress of the cycle that is borne so many times, MPa.

        From the ratio of the tests to another one by Walker's rule: what counts is ``S_max ((1 - R)
        / 2)^gamma`` (Walker, ASTM STP 462, 1970; Dowling, Calhoun and Arcari, Fatigue Fract. Eng.
        Mater. Struct. 32, 2009, 163-179).

        Raises `ValueError` outside the range of the curve.

        Examples
        --------
        >>> curve = FatigueCurve(surface="s", ratio=-1, cycles=(1e4, 1e6), amplitude=(400, 100))
        >>> round(curve.largest_stress(1e5, -1), 9), round(curve.largest_stress(1e5, 0.5), 9)
        (200.0, 400.0)
        """
        if not self.holds(cycles):
            message = f"{cycles:g} cycles lie outside those of the S-N curve, {self.words}"
            raise ValueError(message)
        amplitude = math.exp(
            np.interp(math.log(cycles), np.log(self.cycles), np.log(self.amplitude))
        )
        largest = 2.0 * amplitude / (1.0 - self.ratio)
        return float(largest * ((1.0 - self.ratio) / (1.0 - ratio)) ** self.walker)

    def data(self) -> dict[str, Any]:
        """Plain data for results and lists."""
        return {
            "surface": self.surface,
            "ratio": self.ratio,
            "cycles": list(self.cycles),
            "amplitude_MPa": list(self.amplitude),
            "walker": self.walker,
            "source": self.source,
        }

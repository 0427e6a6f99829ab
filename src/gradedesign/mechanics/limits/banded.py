"""A value with its band: the range expected for ever smaller elements, from two resolutions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from gradedesign.errors import CaseError

#: Spacing of the elements, mm, and the value found with them.
_ValueAtSize: TypeAlias = tuple[float, float]

#: Least ratio of two spacings whose values can be compared. Chosen, not measured.
LEAST_RATIO = 1.05
#: Order with which the error is taken to fall where none is known: the volume that chamfers and
#: missed struts lose goes with the square of the element.
_UNKNOWN_ORDER = 2.0
#: Half the band of a value without a known order is this share at least: two errors of opposite
#: sign, walls that are held too stiff and struts that lose volume, may cancel in the difference of
#: two meshes. Measured on stuffed tetrahedra: docs/validation.md, "Two resolutions of
#: tetrahedra".
LEAST_UNKNOWN = 0.04
#: Share by which a value is too small over the residual of the tractions: usual, most where value
#: and residual fall together well, and most. Measured with one cell across between plates, where
#: errors are largest, for 15 blocks of 12 cells in compression, shear and bending: 0.39 at most at
#: the resolutions that judge, above 0.3 for one of them; docs/finite-cells.md.
RESIDUAL_FACTORS = (0.18, 0.25, 0.4)
#: An observed order counts where the remaining error is at least this share of the residual.
#: Chosen, not measured.
_LEAST_REST = 0.05
#: The factor is fitted where the finer residual is at most this share of the coarser one. Chosen,
#: not measured.
_TELLING = 0.75
#: Two values that agree better than this, over the value, do not make a band of nothing. Chosen,
#: not measured.
_LEAST_FALL = 0.005
#: Safety factor on an observed order (Roache, J. Fluids Eng. 116, 1994: grid convergence index).
SAFETY = 1.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Residual:
    """Change of a value by smaller elements, but for a factor, over the value.

    See `finite_cell.traction_residual`: of the work of the loads, which only rises, and of one
    place's displacement, in which errors of both signs meet.
    """

    #: What they add to its size and what they take off it, both positive.
    rise: float
    fall: float = 0.0

    @property
    def net(self) -> float:
        """Share that is expected to be missing, but for the factor."""
        return self.rise - self.fall


@dataclass(frozen=True, slots=True, kw_only=True)
class Banded:
    """A value and the band in which its limit for small elements is expected."""

    #: In the unit of the value.
    value: float
    low: float
    high: float
    sizes_mm: tuple[float, ...] = ()  #: mm. Elements of the analyses behind it, coarse first.
    #: {"assumed", "observed", "residual", "recovered", "unknown"}: order with which the error
    #: falls: a range that was assumed, the one that three resolutions show, or none, where the
    #: residual of the tractions gives the band, or the stress of the elements beside a recovered
    #: one, or where it is symmetric about the value of the finest one.
    order: str = "unknown"

    @property
    def half_width(self) -> float:
        """Half the width of the band over the value."""
        half = 0.5 * (self.high - self.low)
        return half / abs(self.value) if self.value else (math.inf if half else 0.0)

    def scaled(self, low: float, value: float, high: float) -> Banded:
        """The value times a positive factor that has a band of its own."""
        return Banded(
            value=self.value * value,
            low=self.low * low,
            high=self.high * high,
            sizes_mm=self.sizes_mm,
            order=self.order,
        )

    def including(self, value: float) -> Banded:
        """The value with a band that holds another one, of an independent analysis."""
        return Banded(
            value=self.value,
            low=min(self.low, value),
            high=max(self.high, value),
            sizes_mm=self.sizes_mm,
            order=self.order,
        )


def banded(
    values: Sequence[_ValueAtSize],
    orders: Sequence[float] | None,
    residuals: Sequence[Residual] | None = None,
) -> Banded:
    """Value for small elements from those at two or three resolutions.

    Raises `CaseError` if two spacings do not differ by 5 %.

    - ``values``: spacing in mm and value, coarse first; the last two count, and the one before them
      where the three spacings are in one ratio and converge evenly
    - ``orders``: orders with which the error may fall: the least and the most give the ends of the
      band, the middle one the value (Richardson). None where errors of opposite sign meet and none
      can be assumed.
    - ``residuals``: of the tractions at every spacing. They give the band where three resolutions
      do not show an order: then neither a range of orders is needed, nor values that rise.

    Examples
    --------
    >>> band = banded([(2.0, 9.0), (1.0, 9.5)], (1.0, 1.0, 1.0))
    >>> band.value, band.low, band.high
    (10.0, 9.5, 10.0)
    """
    (coarse, before), (fine, value) = values[-2], values[-1]
    ratio = coarse / fine if fine > 0.0 else 0.0
    if not ratio >= LEAST_RATIO:
        raise CaseError(
            f"no band follows from elements of {coarse:g} and {fine:g} mm; expected the first to "
            f"be larger by 5 % or more"
        )
    change, sizes = value - before, tuple(size for size, _ in values)
    if orders is None:
        half = max(abs(change) / (ratio**_UNKNOWN_ORDER - 1.0), LEAST_UNKNOWN * abs(value))
        return Banded(value=value, low=value - half, high=value + half, sizes_mm=sizes)
    seen = observed_order(values)
    rest = 0.0 if seen is None else change / (ratio**seen - 1.0)
    if seen is not None and min(orders) <= seen <= max(orders):
        # What the residual does not expect to rise or fall has another cause: the solid changed.
        missing, net = (
            rest / value if value else 0.0,
            0.0 if residuals is None else residuals[-1].net,
        )
        if residuals is None or missing * math.copysign(1.0, net) >= _LEAST_REST * abs(net):
            ends = (value, value + SAFETY * rest)
            best, order = value + rest, "observed"
            return Banded(value=best, low=min(ends), high=max(ends), sizes_mm=sizes, order=order)
    if residuals is not None:
        return _from_residuals(values, (residuals[-2], residuals[-1]))
    limits = [value + change / (ratio**order - 1.0) for order in sorted(orders)]
    ends = (value, *limits)
    return Banded(
        value=limits[len(limits) // 2],
        low=min(ends),
        high=max(ends),
        sizes_mm=sizes,
        order="assumed",
    )


def _from_residuals(values: Sequence[_ValueAtSize], residuals: tuple[Residual, Residual]) -> Banded:
    """Band from the residual of the tractions and the change between the last two values.

    Where the value changes as the residual says, and that falls well, the factor is fitted to both.
    Where the value falls, the coarse solid was too thin, by an error that falls with order 2.
    """
    (coarse, before), (fine, value) = values[-2], values[-1]
    usual, least, most = RESIDUAL_FACTORS
    first, last = residuals
    size = abs(value)
    change = size - abs(before)
    factor = most
    fallen = first.net * abs(before) - last.net * size
    if change * fallen > 0.0 and abs(last.net) <= _TELLING * abs(first.net):
        factor = min(max(change / fallen, least), most)
    lost = max(-change, 0.0) / ((coarse / fine) ** _UNKNOWN_ORDER - 1.0)
    low = size - max(lost, factor * last.fall * size, _LEAST_FALL * size)
    high = size * (1.0 + max(factor * last.rise, _LEAST_FALL))
    best = size * (1.0 + usual * last.net)
    ends = (math.copysign(low, value), math.copysign(high, value))
    return Banded(
        value=math.copysign(best, value),
        low=min(ends),
        high=max(ends),
        sizes_mm=tuple(spacing for spacing, _ in values),
        order="residual",
    )


def observed_order(values: Sequence[_ValueAtSize]) -> float | None:
    """Order that three spacings in one ratio show; None where they do not converge evenly."""
    if len(values) < 3:
        return None
    (h1, v1), (h2, v2), (h3, v3) = values[-3:]
    ratio, first, second = h2 / h3, v2 - v1, v3 - v2
    if abs(h1 / h2 - ratio) > 0.02 * ratio or not (second and first / second > 1.0):
        return None
    return math.log(first / second) / math.log(ratio)

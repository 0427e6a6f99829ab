"""A value from two resolutions: extrapolated, with a band."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gradedesign.errors import CaseError

#: Order of the error in the spacing: the least, the usual and the most that was observed. Less
#: than 1 where plates meet sheets in re-entrant edges and one cell is across.
ORDERS = (0.75, 1.5, 3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A value and the band in which the limit of small spacings is expected.

    Attributes
    ----------
    value, low, high : float
    """

    value: float
    low: float
    high: float

    @property
    def band(self) -> float:
        """Half the width of the band over the value."""
        return (self.high - self.low) / (2.0 * abs(self.value)) if self.value else math.inf

    @property
    def unfavourable(self) -> float:
        """End of the band that is larger in size: a limit holds when this one holds."""
        return max(self.low, self.high, key=abs)


def extrapolated(
    coarse: tuple[float, float], fine: tuple[float, float], *, orders: tuple[float, ...] = ORDERS
) -> Estimate:
    """Value at spacing zero from those at two spacings (Richardson).

    Parameters
    ----------
    coarse, fine : (float, float)
        Spacing in mm and value.
    orders : tuple of float
        Assumed orders: the smallest and the largest give the ends of the band, the middle one
        the value. The fine value itself is always in the band.

    Returns
    -------
    Estimate

    Raises
    ------
    CaseError
        If the spacings are not positive and apart.

    Examples
    --------
    >>> extrapolated((2.0, 9.0), (1.0, 9.5), orders=(1.0,)).value
    10.0
    """
    ratio = coarse[0] / fine[0] if fine[0] > 0.0 else 0.0
    if not ratio > 1.05:
        raise CaseError(
            f"cannot extrapolate from spacings of {coarse[0]:g} and {fine[0]:g} mm; expected the "
            "first to be larger by 5 % or more"
        )
    change = fine[1] - coarse[1]
    values = [fine[1] + change / (ratio**order - 1.0) for order in sorted(orders)]
    ends = (*values, fine[1])
    return Estimate(value=values[len(values) // 2], low=min(ends), high=max(ends))


def observed_order(
    coarse: tuple[float, float], middle: tuple[float, float], fine: tuple[float, float]
) -> float | None:
    """Order from values at three spacings in one ratio; None where they do not converge evenly."""
    first, second = middle[1] - coarse[1], fine[1] - middle[1]
    ratio = middle[0] / fine[0]
    if not (second and first / second > 1.0) or abs(coarse[0] / middle[0] - ratio) > 1e-3 * ratio:
        return None
    return math.log(first / second) / math.log(ratio)

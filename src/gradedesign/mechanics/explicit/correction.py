"""Space mapping: factors that map the homogenised prediction onto the explicit result.

After each explicit analysis the ratio explicit over homogenised corrects the model of the next
sizing: a factor on the lattice stiffness from the most used limit by gradient, and a factor on
every predicted value for the remaining discrepancy.

References
----------
J. W. Bandler et al., IEEE Trans. Microwave Theory Tech. 52, 2004 (space mapping).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.limits.key import KeyedValues, LimitKey

#: Relative scatter of the stiffness factor between designs of one density, and of its exponent
#: about the one that vanishes for dense material. With a spread of 1.0 four designs of `clevis`
#: were read as an exponent of 0.99, and the next two were 62 and 244 % softer than predicted; nine
#: other runs had -0.1 to 0.6.
_SCATTER, SPREAD = 0.1, 0.3
#: Discrepancies of the governing limit, largest first, above which a design keeps these shares.
#: Chosen, not measured.
_TRUST = ((0.10, 0.85), (0.05, 0.70))


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """Factors that the homogenised model carries; all 1 before the first explicit analysis."""

    stiffness: float = 1.0  #: On the lattice's C(rho), at the reference density.
    #: The factor grows as ``(rho / reference) ** exponent``: small pieces of lattice lose more
    #: stiffness to their cut faces at low density than at high density.
    exponent: float = 0.0
    reference: float = 1.0  #: Density at which ``stiffness`` was learned.
    #: Mean density and total factor of every explicit analysis so far.
    samples: tuple[tuple[float, float], ...] = ()
    factors: KeyedValues = ()  #: On predicted values; 1 where a limit has none.

    def factor(self, key: LimitKey) -> float:
        """Factor on the predicted value of a limit."""
        return dict(self.factors).get(key, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Discrepancy:
    """Predicted against explicit values of one design, prediction made before its analysis."""

    values: KeyedValues = ()  #: explicit / predicted - 1 of every limit that both evaluate.
    #: The limit by gradient that the explicit analysis uses most.
    governing: LimitKey | None = None

    def of(self, key: LimitKey | None) -> float:
        """Discrepancy of one limit; 0 where there is none."""
        return 0.0 if key is None else dict(self.values).get(key, 0.0)


def discrepancy_between(
    predicted: Mapping[LimitKey, float],
    explicit: Mapping[LimitKey, float],
    *,
    governing: LimitKey | None = None,
) -> Discrepancy:
    """Relative discrepancies, explicit over predicted minus one, where both are known."""
    return Discrepancy(
        values=tuple(
            (key, explicit[key] / value - 1.0)
            for key, value in predicted.items()
            if value and key in explicit
        ),
        governing=governing,
    )


def stiffness_update(explicit: float, predicted: float, lattice_share: float) -> float:
    """Factor on the lattice stiffness that turns one predicted value into the explicit.

    ``explicit``, ``predicted``: of a limit by gradient, such as a displacement. ``lattice_share``:
    share of the predicted value that comes from strain of the lattice phase (its part of the mutual
    energy), so ``u(k) = u (1 - s + s / k)``. Returns float: k; 1.0 where the lattice's share cannot
    explain the difference, which the factor on the displacement itself then carries.
    """
    if lattice_share <= 0.05:
        return 1.0
    needed = 1.0 + (explicit / predicted - 1.0) / lattice_share
    return 1.0 / needed if needed > 0.2 else 1.0


def energy_weighted_density(mutual: FloatArray, rho: FloatArray) -> float:
    """Mean density of the lattice that carries a limit.

    ``mutual (M,)``, N mm: mutual energy of every element in the limit's value. It is negative where
    the strain of the load opposes that of the limit's own load: the element carries as much as its
    size says. With signs the mean leaves the densities that carry, and even their range.
    ``rho (M,)``: relative densities.
    """
    weights = np.abs(mutual)
    return float(weights @ rho / weights.sum())


def stiffness_exponent(samples: Sequence[tuple[float, float]]) -> float:
    """Exponent of the stiffness factor in density.

    The power law through the last analysis that fits the others best, held to the one that
    vanishes for dense material (what free faces cost vanishes as the voids close). Factors of
    designs of one density scatter by `_SCATTER`, so that analyses at nearly the same density hardly
    determine the exponent; exponents scatter by `SPREAD` about that of dense material. Kept
    within -0.5 to 4, the range that free faces of one to many cells explain.
    """
    if not samples:
        return 0.0
    last_rho, last_factor = samples[-1]
    prior = np.log(last_factor) / np.log(last_rho)
    before = np.array(samples[:-1]).reshape(-1, 2)
    run = np.log(before[:, 0] / last_rho)
    rise = np.log(before[:, 1] / last_factor)
    precision = float(run @ run) / _SCATTER**2
    exponent = (float(run @ rise) / _SCATTER**2 + prior / SPREAD**2) / (precision + 1 / SPREAD**2)
    return float(np.clip(exponent, -0.5, 4.0))


def kept_share(discrepancies: Sequence[Discrepancy]) -> float:
    """Share of its density that every variable keeps at least in the next sizing.

    A correction is valid near the design it was found for: a trust region. The first sizings may go
    anywhere. From the third on, the more the last prediction was off, the less may be taken away;
    after a prediction that was right, twice as much as before. One such prediction of a design
    nearby is not valid for designs far away.
    """
    taken = 1.0
    for discrepancy in discrepancies[1:]:
        off = abs(discrepancy.of(discrepancy.governing))
        taken = next((1.0 - share for least, share in _TRUST if off > least), min(1.0, 2.0 * taken))
    return 1.0 - taken


def damped(old: float, new: float, damping: float) -> float:
    """Move from one factor to another in the logarithm, by a share ``damping``."""
    return float(np.exp((1 - damping) * np.log(old) + damping * np.log(new)))


def damping_for(discrepancies: Sequence[Discrepancy]) -> float:
    """Full steps, halved once the discrepancy of the governing limit changes its sign twice.

    The limit by gradient that governs the last analysis is followed through all of them.
    """
    if not discrepancies:
        return 1.0
    signs = [np.sign(discrepancy.of(discrepancies[-1].governing)) for discrepancy in discrepancies]
    flips = sum(1 for a, b in pairwise(signs) if a * b < 0)
    return 0.5 if flips >= 2 else 1.0

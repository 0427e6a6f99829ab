"""Space mapping: bend the homogenised prediction onto the explicit result.

After each explicit analysis the ratio explicit over homogenised corrects what the next sizing
believes: a factor on the lattice stiffness from the most used displacement limit, a factor on
every displacement for what that one factor leaves, and a factor on the local stress.

References
----------
J. W. Bandler et al., IEEE Trans. Microwave Theory Tech. 52, 2004 (space mapping).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """Factors that the homogenised model carries; all 1 before the first explicit analysis.

    Attributes
    ----------
    stiffness : float
        On the lattice's C(rho), at the reference density.
    exponent : float
        The factor grows as ``(rho / reference) ** exponent``: small pieces of lattice lose more
        stiffness to their cut faces at low density than at high density.
    reference : float
        Density at which ``stiffness`` was learned.
    samples : tuple of (float, float)
        Mean density and total factor of every explicit analysis so far.
    displacement : tuple of float
        On the predicted value of every displacement limit.
    stress : float
        On the predicted local stress, the inverse of a factor on strength(rho).
    """

    stiffness: float = 1.0
    exponent: float = 0.0
    reference: float = 1.0
    samples: tuple[tuple[float, float], ...] = ()
    displacement: tuple[float, ...] = ()
    stress: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Predicted against explicit values of one design, prediction made before its analysis.

    Attributes
    ----------
    displacement : tuple of float
        explicit / predicted - 1 for every displacement limit.
    stress : float or None
        The same for the lattice's stress measure; None without a stress limit.
    governing : int
        Number of the displacement limit that the explicit analysis uses most.
    """

    displacement: tuple[float, ...] = field(default_factory=tuple)
    stress: float | None = None
    governing: int = 0


def gap_between(
    predicted: Sequence[float],
    explicit: Sequence[float],
    predicted_stress: float | None,
    explicit_stress: float | None,
    *,
    governing: int = 0,
) -> Gap:
    """Relative gaps, explicit over predicted minus one; ``governing`` is the most used limit."""
    stress = None
    if predicted_stress and explicit_stress is not None:
        stress = explicit_stress / predicted_stress - 1.0
    return Gap(
        displacement=tuple(e / p - 1.0 for p, e in zip(predicted, explicit, strict=True)),
        stress=stress,
        governing=governing,
    )


def stiffness_update(explicit: float, predicted: float, lattice_share: float) -> float:
    """Factor on the lattice stiffness that turns one predicted displacement into the explicit.

    Parameters
    ----------
    explicit, predicted : float, mm
    lattice_share : float
        Share of the predicted displacement that comes from strain of the lattice phase
        (its part of the mutual energy), so ``u(k) = u (1 - s + s / k)``.

    Returns
    -------
    float
        k; 1.0 where the lattice's share cannot explain the difference, which the factor on
        the displacement itself then carries.
    """
    if lattice_share <= 0.05:
        return 1.0
    needed = 1.0 + (explicit / predicted - 1.0) / lattice_share
    return 1.0 / needed if needed > 0.2 else 1.0


def stiffness_exponent(samples: Sequence[tuple[float, float]]) -> float:
    """Exponent of the stiffness factor in density.

    From two analyses whose mean densities differ by 3 % or more, the slope between the last two.
    Before that, the power law through the one sample and a factor of 1 for dense material: what
    free faces cost vanishes as the voids close. Kept within -0.5 to 4, the range that free faces
    of one to many cells explain.
    """
    if not samples:
        return 0.0
    (rho_a, factor_a) = samples[-2] if len(samples) > 1 else (1.0, 1.0)
    (rho_b, factor_b) = samples[-1]
    run = np.log(rho_b / rho_a)
    if abs(run) < 0.03:
        (rho_a, factor_a), run = (1.0, 1.0), np.log(rho_b)
    return float(np.clip(np.log(factor_b / factor_a) / run, -0.5, 4.0))


def damped(old: float, new: float, damping: float) -> float:
    """Move from one factor to another in the logarithm, by a share ``damping``."""
    return float(np.exp((1 - damping) * np.log(old) + damping * np.log(new)))


def damping_for(gaps: Sequence[Gap]) -> float:
    """Full steps, halved once the gap of the governing displacement changes its sign twice.

    The displacement that governs the last analysis is followed through all of them.
    """
    if not gaps or not gaps[-1].displacement:
        return 1.0
    governing = gaps[-1].governing
    signs = [np.sign(g.displacement[governing]) for g in gaps]
    flips = sum(1 for a, b in pairwise(signs) if a * b < 0)
    return 0.5 if flips >= 2 else 1.0

"""Warnings on the stress of the printed solid that no row of a limit shows."""

from __future__ import annotations

from collections.abc import Sequence

from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.explicit.measures import PHASES
from gradedesign.mechanics.explicit.yielding import yielding_words
from gradedesign.mechanics.limits.limit import Limit, limits_stress
from gradedesign.mechanics.limits.row import LEAST_JUDGED


def stress_warnings(
    limits: Sequence[Limit], result: ExplicitResult
) -> tuple[tuple[str, ...], list[str]]:
    """That the printed solid yields, and which of its phases a limit of stress hardly judges."""
    limited = limits_stress(limits)
    yields = yielding_words(result.yields, "the printed solid", limited=limited)
    return yields, _unjudged_phases(result) if limited else []


def _unjudged_phases(result: ExplicitResult) -> list[str]:
    """Warn of solid phases that lie mostly in the zones around supports; lattice may not."""
    zone, told = result.exclusion, []
    for phase, share in zone.share.items():
        if phase != PHASES[0] and 1.0 - share < LEAST_JUDGED:
            highest = max(values[phase] for values in zone.everywhere.values())
            told.append(
                f"stress in {phase} is judged on {1.0 - share:.1%} of its volume: the rest lies "
                f"within the exclusion radius of supports; with it the percentile is "
                f"{highest:.4g} MPa"
            )
    return told

"""Warnings on stress that no row of a limit shows, and on layers with few elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.explicit.measures import PHASES
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.yielding import yielding_words
from gradedesign.mechanics.limits.limit import Limit, limits_stress
from gradedesign.mechanics.limits.row import LEAST_JUDGED


def stress_warnings(
    limits: Sequence[Limit], result: ExplicitResult
) -> tuple[tuple[str, ...], list[str]]:
    """That the printed solid yields; phases that are hardly judged, and hot spots."""
    limited = limits_stress(limits)
    yields = yielding_words(result.yields, "the printed solid", limited=limited)
    unjudged = _unjudged_phases(result) if limited else []
    return yields, unjudged + [words for limit in limits for words in limit.hot_spots(result)]


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


#: Finite cells through a layer with which its dent between walls is known to some 4 %: a plate of
#: 1.5 mm on gyroid sheets of 8 mm, docs/finite-cells.md, "Error estimate".
ENOUGH = 3.0


def coarse_layer(solid: PrintedSolid, result: ExplicitResult) -> str:
    """The thinnest layer of a solid where an analysis has too few elements through it, or nothing.

    Returns str: such as ``1.4 finite cells of 1.07 mm go through region 'tip', 1.5 mm thick, where
    3 are enough``.

    ``result``: its finest analysis.
    """
    components = solid.design.domain.components
    thickness, name = min(((c.least, c.name) for c in components), default=(np.inf, ""))
    if thickness >= ENOUGH * result.mesh_size:
        return ""
    return (
        f"{thickness / result.mesh_size:.1f} finite cells of {result.mesh_size:.3g} mm go through "
        f"{name}, {thickness:.3g} mm thick, where {ENOUGH:g} are enough: a larger [run] "
        f"elements_per_wall takes more"
    )

"""The designs that no other one beats: the front of a trade-off."""

from __future__ import annotations

from collections.abc import Sequence

from gradedesign_sweep.table import DesignRow

#: A run calls a design lightest from 97 % of a limit on: where it ends up above is no merit.
SAME = 0.03


def non_dominated(rows: Sequence[DesignRow]) -> frozenset[int]:
    """Numbers of the designs that hold their limits and that no other such design dominates.

    A design dominates another of the same limits where it is no heavier and no worse in any of
    them, and better in something; within `SAME` two values of a limit count as equal. Limits are
    compared by value and by utilisation: where a study varies the limits themselves, a low
    utilisation of a wide limit is no merit, and where it varies the material, a low stress of a
    weak one is none.
    """
    feasible = [row for row in rows if row.holds]
    return frozenset(
        row.number for row in feasible if not any(_dominates(other, row) for other in feasible)
    )


def _dominates(row: DesignRow, other: DesignRow) -> bool:
    """Whether a design is no worse in anything and better in something."""
    if set(row.limits) != set(other.limits):
        return False
    mass, others_mass = (float("inf") if r.mass_g is None else r.mass_g for r in (row, other))
    pairs = list(zip(_values(row), _values(other), strict=True))
    if mass > others_mass or any(a > (1 + SAME) * b for a, b in pairs):
        return False
    return mass < others_mass or any((1 + SAME) * a < b for a, b in pairs)


def _values(row: DesignRow) -> list[float]:
    """Severities and utilisations of the limits, the less the better."""
    limits = [row.limits[name] for name in sorted(row.limits)]
    return [*(limit.severity for limit in limits), *(limit.utilisation for limit in limits)]

"""Tables and plot of a sweep."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from gradedesign.commands import save_figure, write_text
from gradedesign_sweep.non_dominated import non_dominated
from gradedesign_sweep.study import Study, value_text
from gradedesign_sweep.sweep_folder import PLOT, TABLE
from gradedesign_sweep.table import FAILED, DesignRow, limit_units, table_csv, table_json
from gradedesign_sweep.tradeoff_plot import TradeoffPoint, tradeoff_figure


def write_tables(folder: Path, study: Study, rows: Sequence[DesignRow]) -> frozenset[int]:
    """Write the table as CSV and JSON; the numbers of the non-dominated designs."""
    best = non_dominated(rows)
    write_text(folder / f"{TABLE}.csv", table_csv(study, rows, best))
    text = json.dumps(table_json(study, rows, best), indent=2, allow_nan=False)
    write_text(folder / f"{TABLE}.json", f"{text}\n")
    return best


def write_plot(folder: Path, study: Study, rows: Sequence[DesignRow], best: frozenset[int]) -> None:
    """Draw mass against the utilisation of each limit, where a design has both."""
    key = study.keys[0]
    groups = {row.number: value_text(row.values[key]) for row in rows if key in row.values}
    points = tradeoff_points(rows, best, groups)
    if not points:
        (folder / PLOT).unlink(missing_ok=True)
        return
    failed = sum(row.status == FAILED for row in rows)
    names = ", ".join(study.keys)
    figure = tradeoff_figure(
        points,
        list(limit_units(rows)),
        title=study.name,
        note=f"{len(points)} of {len(rows)} designs over {names}"
        + (f"; {failed} failed" if failed else ""),
    )
    save_figure(folder / PLOT, figure)


def tradeoff_points(
    rows: Sequence[DesignRow], best: frozenset[int], groups: Mapping[int, str]
) -> list[TradeoffPoint]:
    """Points of the designs that have a mass and a limit, each in the group of its number."""
    return [
        TradeoffPoint(
            number=row.number,
            label=row.label,
            group=groups.get(row.number, "-"),
            mass_g=row.mass_g,
            utilisation={
                name: limit.utilisation
                for name, limit in row.limits.items()
                if math.isfinite(limit.utilisation)
            },
            marked=row.number in best,
        )
        for row in rows
        if row.mass_g is not None
        and any(math.isfinite(limit.utilisation) for limit in row.limits.values())
    ]

"""The iterations of a run as a table for other programs: iterations.csv."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from itertools import chain

from gradedesign.design.loop.iteration_row import Iteration

#: Header and attribute of what every iteration has.
_COLUMNS = (
    ("iteration [-]", "number"),
    ("mass [g]", "mass_g"),
    ("lattice mass [g]", "lattice_mass_g"),
    ("mean density [-]", "mean_density"),
    ("largest utilisation [-]", "utilisation"),
    ("every limit holds [-]", "passed"),
    ("stiffness factor [-]", "stiffness_factor"),
    ("unknowns [-]", "dofs"),
    ("mesh size [mm]", "mesh_size_mm"),
    ("sizing iterations [-]", "sizing_iterations"),
    ("time [s]", "seconds"),
)


def iteration_log(iterations: Sequence[Iteration]) -> str:
    """One line per iteration, comma separated, one value in a field and its unit in the header.

    Every limit has columns of its own: the prediction before the analysis, the explicit value, the
    discrepancy, the latter over the former less one, and the factor on the prediction.
    """
    each = [
        (
            f"predicted {limit.label} [{limit.unit}]",
            f"explicit {limit.label} [{limit.unit}]",
            f"discrepancy of {limit.label} [-]",
            f"factor on {limit.label} [-]",
        )
        for limit in (iterations[0].limits if iterations else ())
    ]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(header for header, _ in _COLUMNS), *chain.from_iterable(each)])
    for iteration in iterations:
        columns = (
            (row.predicted, row.explicit, row.discrepancy, row.factor) for row in iteration.limits
        )
        values = [getattr(iteration, attribute) for _, attribute in _COLUMNS]
        writer.writerow([_cell(v) for v in (*values, *chain.from_iterable(columns))])
    return text.getvalue()


def _cell(value: float | bool | None) -> str:
    """A number in six digits, a truth as 1 or 0, nothing as an empty field."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return str(value) if isinstance(value, int) else f"{value:.6g}"

"""The rounds of a run as a table for other programs: iterations.csv."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from itertools import chain

from gradedesign.ladder.result import Iteration
from gradedesign.sizing.responses import DisplacementLimit

#: Header and attribute of what every round has.
_COLUMNS = (
    ("round [-]", "round"),
    ("mass [g]", "mass_g"),
    ("lattice mass [g]", "lattice_mass_g"),
    ("mean density [-]", "mean_density"),
    ("largest use [-]", "use"),
    ("every limit holds [-]", "passed"),
    ("predicted lattice stress [MPa]", "predicted_stress"),
    ("explicit lattice stress [MPa]", "explicit_stress"),
    ("lattice stress gap [-]", "stress_gap"),
    ("stiffness factor [-]", "stiffness_factor"),
    ("stress factor [-]", "stress_factor"),
    ("unknowns [-]", "dofs"),
    ("mesh size [mm]", "mesh_size_mm"),
    ("sizing iterations [-]", "sizing_iterations"),
    ("time [s]", "seconds"),
)


def iteration_log(iterations: Sequence[Iteration], limits: Sequence[DisplacementLimit]) -> str:
    """One line per round, comma separated, one value in a field and its unit in the header.

    Every displacement limit has columns of its own: what was predicted before the analysis, what
    the explicit analysis said, and the gap, the latter over the former less one.
    """
    names = [f"{limit.name} ({limit.load_case})" for limit in limits]
    each = [
        (
            f"predicted displacement of {name} [mm]",
            f"explicit displacement of {name} [mm]",
            f"displacement gap of {name} [-]",
        )
        for name in names
    ]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(header for header, _ in _COLUMNS), *chain.from_iterable(each)])
    for it in iterations:
        found = zip(
            it.predicted_displacement, it.explicit_displacement, it.displacement_gap, strict=True
        )
        values = [_cell(getattr(it, attribute)) for _, attribute in _COLUMNS]
        writer.writerow([*values, *(f"{v:.6g}" for v in chain.from_iterable(found))])
    return text.getvalue()


def _cell(value: float | bool | None) -> str:
    """A number in six digits, a truth as 1 or 0, nothing as an empty field."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return str(value) if isinstance(value, int) else f"{value:.6g}"

"""The table of a sweep: a row for each design, as records, CSV and JSON."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import StringIO
from typing import Any

from gradedesign.commands import (
    LimitRow,
    RunResult,
)
from gradedesign_sweep.study import Design, Study, value_text

#: Status of a design that was not run yet.
_WAITING = "waiting"
FAILED = "failed"
BEST_WORDS = "* no other design that holds its limits is lighter or uses them less"


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitValue:
    """One limit of one design.

    Attributes
    ----------
    utilisation : float
        By the unfavourable end of the value's band, as the run judged it.
    severity : float
        That end, or one over it where a low one is unfavourable: the less the better.
    """

    value: float
    limit: float
    unit: str
    utilisation: float
    severity: float


def limit_value(row: LimitRow) -> LimitValue:
    """A limit as the table has it."""
    end = row.decisive
    if row.unfavourable == "low":
        end = 1 / end if end > 0.0 else math.inf
    return LimitValue(
        value=row.value,
        limit=row.limit,
        unit=row.unit,
        utilisation=row.utilisation,
        severity=end,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRow:
    """One design of the table.

    Attributes
    ----------
    number : int
        From 1, in the order of the study.
    label : str
        Values of the design in one line.
    values : mapping of dotted key to value
    status : str
        Of its run, or `_WAITING`.
    limits : mapping of name to LimitValue
        In the order of the result.
    error : str
        One sentence where the run failed.
    folder : str
        Below that of the sweep.
    seconds : float or None
        Of the session that finished it.
    """

    number: int
    label: str
    values: Mapping[str, Any]
    status: str
    folder: str
    lightest: bool = False
    mass_g: float | None = None
    solid_mass_g: float | None = None
    relative_density: float | None = None
    limits: Mapping[str, LimitValue]
    error: str = ""
    seconds: float | None = None

    @property
    def utilisation(self) -> float | None:
        """Largest value over limit; None without limits."""
        return max((limit.utilisation for limit in self.limits.values()), default=None)

    @property
    def holds(self) -> bool:
        """Whether there is a mass and every limit holds, if only by the homogenised prediction."""
        most = self.utilisation
        return self.mass_g is not None and most is not None and most <= 1.0


def design_row(
    design: Design,
    folder: str,
    result: RunResult | None,
    *,
    error: str = "",
    seconds: float | None = None,
) -> DesignRow:
    """The row of a design.

    Parameters
    ----------
    folder : str
        Below that of the sweep.
    result : RunResult or None
        None before it ran.
    error : str
        Message of what ended its run; replaces the result.
    """
    waiting = DesignRow(
        number=design.number,
        label=design.label,
        values=dict(design.values),
        status=_WAITING,
        folder=folder,
        limits={},
        seconds=seconds,
    )
    if error:
        return replace(waiting, status=FAILED, error=" ".join(error.split()))
    return waiting if result is None else finished_row(waiting, result)


def finished_row(waiting: DesignRow, result: RunResult) -> DesignRow:
    """The row of a design once its run has ended."""
    if result.status == FAILED:
        return replace(waiting, status=FAILED, error=" ".join(result.reason.split()))
    return replace(
        waiting,
        status=result.status,
        lightest=result.lightest,
        mass_g=result.mass_g,
        solid_mass_g=result.solid_mass_g,
        relative_density=result.relative_density,
        limits={limit_name(row): limit_value(row) for row in result.limits},
    )


def limit_name(row: LimitRow) -> str:
    """Name of a limit, with its load case where it belongs to one."""
    return f"{row.name} ({row.key.load_case})" if row.key.load_case else row.name


def limit_units(rows: Sequence[DesignRow]) -> dict[str, str]:
    """Units of the limits of all designs by name, in the order in which they come."""
    return {name: limit.unit for row in rows for name, limit in row.limits.items()}


def table_csv(study: Study, rows: Sequence[DesignRow], best: frozenset[int]) -> str:
    """One line per design, comma separated, one value in a field and its unit in the header.

    Parameters
    ----------
    best : frozenset of int
        Numbers of the non-dominated designs.
    """
    units = limit_units(rows)
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_header(study, units))
    for row in rows:
        numbers = [row.mass_g, row.solid_mass_g, row.relative_density]
        for name in units:
            limit = row.limits.get(name)
            numbers += (
                [None] * 3 if limit is None else [limit.value, limit.limit, limit.utilisation]
            )
        writer.writerow(
            [
                row.number,
                *(value_text(row.values[key]) if key in row.values else "" for key in study.keys),
                row.status,
                int(row.lightest),
                int(row.number in best),
                *("" if number is None else f"{number:.6g}" for number in numbers),
                row.folder,
                row.error,
                "" if row.seconds is None else f"{row.seconds:.1f}",
            ]
        )
    return text.getvalue()


def _header(study: Study, units: Mapping[str, str]) -> Iterator[str]:
    yield "design"
    yield from study.keys
    yield from ("status", "lightest", "non-dominated")
    yield from ("mass [g]", "solid mass [g]", "relative density [-]")
    for name, unit in units.items():
        yield from (f"{name} [{unit}]", f"limit of {name} [{unit}]", f"utilisation of {name} [-]")
    yield from ("folder", "error", "time [s]")


def table_json(study: Study, rows: Sequence[DesignRow], best: frozenset[int]) -> dict[str, Any]:
    """The table as plain data, numbers in six digits as in the CSV."""
    return {
        "study": study.name,
        "keys": list(study.keys),
        "designs": [
            {
                **row_json(row, best),
                "values": json.loads(json.dumps(row.values, default=str)),
                "seconds": row.seconds,
            }
            for row in rows
        ],
    }


def row_json(row: DesignRow, best: frozenset[int]) -> dict[str, Any]:
    """A design and its limits as plain data."""
    return {
        "design": row.number,
        "status": row.status,
        "lightest": row.lightest,
        "non_dominated": row.number in best,
        "mass_g": short(row.mass_g),
        "solid_mass_g": short(row.solid_mass_g),
        "relative_density": short(row.relative_density),
        "limits": [
            {
                "name": name,
                "value": short(limit.value),
                "limit": short(limit.limit),
                "unit": limit.unit,
                "utilisation": short(limit.utilisation),
            }
            for name, limit in row.limits.items()
        ],
        "folder": row.folder,
        "error": row.error,
    }


def designs_table(
    name: str, rows: Sequence[DesignRow], best: frozenset[int]
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Columns and cells in short: what each design weighs, and the limit that it uses most.

    Parameters
    ----------
    name : str
        Of the column of labels.
    """
    columns = ("", name, "status", "mass", "of solid", "use", "of", "best")
    cells: list[tuple[str, ...]] = [
        (
            str(row.number),
            row.label,
            row.status + (", lightest" if row.lightest else ""),
            "-" if row.mass_g is None else f"{row.mass_g:.4g} g",
            "-" if row.relative_density is None else f"{row.relative_density:.1%}",
            "-" if row.utilisation is None else f"{row.utilisation:.1%}",
            max(row.limits, key=lambda limit: row.limits[limit].utilisation, default="-"),
            "*" if row.number in best else "",
        )
        for row in rows
    ]
    return columns, cells


def short(number: float | None) -> float | None:
    """A number in six digits, since further ones depend on threads; None for infinity."""
    return None if number is None or math.isinf(number) else float(f"{number:.6g}")

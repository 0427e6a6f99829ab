"""History of a suite of cases: a line of JSON for each case that ran, appended and never changed.

It tells which cases a change of the program or of a case concerns, and what moved by it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from gradedesign import CaseError
from gradedesign.commands import (
    COLOURS,
    GREY,
    Registry,
    content_key,
    empty_figure,
    save_figure,
    write_error,
)
from gradedesign_validate.expected_values import short

#: What compilers leave beside the sources.
_COMPILED = frozenset({".pyc", ".nbi", ".nbc"})
#: Times and memory of equal runs beside other work differ by less. Chosen, not measured.
_NOTABLE = 1.25
#: Dates on the axis of the plot that do not overlap. Chosen.
_MOST_DATES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class HistoryLine:
    """One case of one validation."""

    case: str
    version: str
    case_hash: str  #: Of the case and the files it names; empty where it cannot be read.
    text_key: str  #: Of the texts of case.toml and expected.toml.
    program_key: str  #: Of all files of the core and of the installed plugins: see `suite_key`.
    date: str  #: ISO 8601 in UTC.
    status: str
    reason: str
    passed: bool  #: Every expected quantity.
    mass_g: float | None
    #: Largest one of the first iteration, explicit / predicted - 1, with its sign.
    discrepancy: float | None
    seconds: float  #: s.
    peak_bytes: int  #: Resident memory of the process and of those it started.
    values: Mapping[str, Any]  #: By expected quantity.

    @property
    def cause(self) -> tuple[str, str, str]:
        """Everything that the outcome depends on."""
        return self.case_hash, self.text_key, self.program_key


def suite_key(registry: Registry) -> str:
    """Content key of the core and the installed plugins, with their data, and of what is loaded."""
    modules = {p.value.partition(":")[0] for p in metadata.entry_points(group="gradedesign")}
    roots: set[Path] = set()
    for package in {"gradedesign", *(name.partition(".")[0] for name in modules)}:
        spec = find_spec(package)
        if spec is not None and spec.origin is not None:
            own = spec.submodule_search_locations or [spec.origin]
            roots |= {Path(place) for place in own}
    files = sorted(f for root in roots for f in (root, *root.rglob("*")) if f.is_file())
    texts = (f.read_bytes() for f in files if f.suffix not in _COMPILED)
    return content_key(*map(str, registry.plugins), *texts)


def read_history(path: Path) -> list[HistoryLine]:
    """Lines of a history, oldest first; none where there is no file yet.

    Raises CaseError if a line is none of a history.
    """
    if not path.exists():
        return []
    lines = []
    try:
        for text in path.read_text(encoding="utf-8").splitlines():
            lines.append(HistoryLine(**json.loads(text)))
    except OSError as error:
        raise CaseError(f"{path}: {error.strerror}; expected a file of --history") from error
    except (ValueError, TypeError) as error:
        raise CaseError(
            f"{path}: line {len(lines) + 1} is none of a history of validations ({error}); remove "
            f"it, or name another file"
        ) from error
    return lines


def append_line(path: Path, line: HistoryLine) -> None:
    """Append a line to a history."""
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(line), allow_nan=False, default=str) + "\n")
    except OSError as error:
        raise write_error(path, error) from error


def last_of(history: Sequence[HistoryLine], case: str) -> HistoryLine | None:
    """Newest line of a case."""
    return next((line for line in reversed(history) if line.case == case), None)


def differences(before: HistoryLine, now: HistoryLine) -> list[tuple[str, str, str, str, str]]:
    """Case, quantity, value before and now and the change in per cent, of what moved.

    Times and memory are named from a change by a quarter on.
    """
    rows = []
    for name in ("status", "mass_g", "discrepancy", "seconds", "peak_bytes"):
        old, new = getattr(before, name), getattr(now, name)
        if name in ("seconds", "peak_bytes") and max(old, new) < _NOTABLE * min(old, new):
            continue
        rows.append((name, old, new))
    rows += [
        (name, before.values.get(name), value)
        for name, value in now.values.items()
        if name not in ("status", "mass_g")
    ]
    return [
        (now.case, name, short(old), short(new), _change(old, new))
        for name, old, new in rows
        if short(old) != short(new)
    ]


def _change(old: Any, new: Any) -> str:
    """A change in per cent where both are numbers."""
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (old, new))
    return f"{100.0 * (new / old - 1.0):+.3g} %" if numbers and old else ""


def draw_history(path: Path, history: Sequence[HistoryLine], case: str) -> Path:
    """Draw mass, discrepancy, time and memory of a case beside the history; the picture's path."""
    lines = [line for line in history if line.case == case]
    figure = empty_figure(10.0, 7.0, case)
    step = -(-len(lines) // _MOST_DATES)
    ticks = range(0, len(lines), step)
    for place, (name, label, scale) in enumerate(
        (
            ("mass_g", "mass [g]", 1.0),
            ("discrepancy", "first prediction off by [%]", 100.0),
            ("seconds", "time [s]", 1.0),
            ("peak_bytes", "memory [GB]", 1e-9),
        )
    ):
        axes: Any = figure.add_subplot(2, 2, place + 1)
        values = [getattr(line, name) for line in lines]
        shown = [(n, scale * v) for n, v in enumerate(values) if v is not None]
        axes.plot(*zip(*shown, strict=True), "-", color=GREY) if shown else None
        for n, value in shown:
            axes.plot(n, value, "o" if lines[n].passed else "x", color=COLOURS[not lines[n].passed])
        axes.set_xticks(ticks, [f"{lines[n].date[:10]}\n{lines[n].version}" for n in ticks])
        axes.set_xlim(-0.5, len(lines) - 0.5)
        axes.set_ylabel(label)
        axes.grid(visible=True, color="#e5e5e5", linewidth=0.6)
    figure.text(0.02, 0.01, "cross: a quantity deviates", fontsize=9, color="#333333")
    picture = path.with_name(f"{path.stem}-{case}.png")
    save_figure(picture, figure)
    return picture

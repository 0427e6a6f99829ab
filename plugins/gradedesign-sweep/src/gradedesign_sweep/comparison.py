"""Finished runs beside each other: their rows, margins, and what keeps them from being compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from gradedesign.commands import RunResult
from gradedesign_sweep.non_dominated import non_dominated
from gradedesign_sweep.table import DesignRow, finished_row, limit_name

#: Columns and rows of a table.
Cells: TypeAlias = tuple[tuple[str, ...], list[tuple[str, ...]]]

#: Relative difference up to which two parts have the same volume, which depends on how finely the
#: part is meshed by 2e-5 in the cases here, and two loads are the same.
_SAME = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """Finished runs beside each other.

    Attributes
    ----------
    results : sequence of RunResult
    rows : sequence of DesignRow
        The same runs, numbered from 1; masses are those of the whole part where the case mirrors
        one.
    best : frozenset of int
        Non-dominated ones; empty where the runs do not answer the same question.
    notes : sequence of str
        Sentences on what differs besides the design.
    """

    results: Sequence[RunResult]
    rows: Sequence[DesignRow]
    best: frozenset[int]
    notes: Sequence[str]

    @property
    def has_limits(self) -> bool:
        """Whether any run has a limit."""
        return any(row.limits for row in self.rows)

    @property
    def cells(self) -> dict[int, str]:
        """Cell of each run, or the law where there is none."""
        return {
            row.number: str(result.law.get("cell") or result.law.get("name") or "-")
            for row, result in zip(self.rows, self.results, strict=True)
        }

    @staticmethod
    def phases(result: RunResult) -> dict[str, float]:
        """Share of each phase in the volume of the printed solid; empty where none was written."""
        volumes: Mapping[str, float] = result.printed.get("volumes_mm3", {})
        whole = sum(volumes.values())
        return {name: volume / whole for name, volume in volumes.items()} if whole else {}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    """Name of a thing, its numbers, and both in words."""

    name: str
    words: str
    numbers: tuple[float, ...] = ()


def compared(results: Sequence[RunResult]) -> Comparison:
    """Put finished runs beside each other.

    Parameters
    ----------
    results : sequence of RunResult
        Of different folders.
    """
    rows = [
        _row(number, label, result)
        for number, (label, result) in enumerate(zip(_labels(results), results, strict=True), 1)
    ]
    unlike = [
        *_differing(results, _part_of, "parts", "their masses and shares are not comparable"),
        *_differing(results, _loads_of, "loads", "their margins are not comparable"),
        *_differing(results, _material_of, "materials"),
    ]
    unlike += _unshared_limits(rows)
    best = frozenset() if unlike else non_dominated(rows)
    mirrored = [row.number for row, result in zip(rows, results, strict=True) if result.symmetry]
    notes = [*unlike]
    if mirrored:
        notes.append(
            f"masses of {_numbers(mirrored)} are of the whole part, not of what was modelled"
        )
    for row in rows:
        if row.status == "partial":
            notes.append(f"{row.number} is partial: nothing of its mass and margins is proven")
    return Comparison(results=results, rows=rows, best=best, notes=notes)


def _unshared_limits(rows: Sequence[DesignRow]) -> list[str]:
    """A sentence where designs that hold their limits have not the same ones."""
    holding = [row for row in rows if row.holds]
    every = list(dict.fromkeys(name for row in holding for name in row.limits))
    unshared = [name for name in every if any(name not in row.limits for row in holding)]
    if not unshared:
        return []
    return [
        f"not every run has these limits, so that none is marked as best: {'; '.join(unshared)}"
    ]


def _row(number: int, label: str, result: RunResult) -> DesignRow:
    waiting = DesignRow(
        number=number, label=label, values={}, status="", folder=str(result.folder), limits={}
    )
    row, copies = finished_row(waiting, result), result.symmetry.get("copies", 1)

    def whole(mass: float | None) -> float | None:
        return None if mass is None else copies * mass

    return replace(row, mass_g=whole(row.mass_g), solid_mass_g=whole(row.solid_mass_g))


def _labels(results: Sequence[RunResult]) -> list[str]:
    """Names of the runs: of their folders, whole where two are the same, with the case's."""
    short = [result.folder.absolute().name for result in results]
    names = [
        name if short.count(name) == 1 else str(result.folder)
        for name, result in zip(short, results, strict=True)
    ]
    return [
        name if name == result.case_name else f"{name} ({result.case_name})"
        for name, result in zip(names, results, strict=True)
    ]


def _part_of(result: RunResult) -> _Found | None:
    """Files of a part, and the volume of what is modelled of it, whole; None if not known."""
    density = result.material.get("density_g_cm3")
    if result.solid_mass_g is None or not density:
        return None
    files = result.checksums.get("part", {})
    names = ", ".join(f"{Path(name).name} {digest[:8]}" for name, digest in sorted(files.items()))
    volume = 1e3 * result.solid_mass_g * result.symmetry.get("copies", 1) / density
    names = names or "stated in the case"
    return _Found(name=names, numbers=(volume,), words=f"{names}, {volume:.5g} mm³")


def _loads_of(result: RunResult) -> _Found | None:
    """Load cases by name, with the numbers of their resultants."""
    if not result.load_cases:
        return None
    cases = sorted(result.load_cases, key=lambda case: str(case["name"]))
    return _Found(
        name=", ".join(str(case["name"]) for case in cases),
        numbers=tuple(
            x for case in cases for x in (*case["force_N"], case["temperature_change_K"])
        ),
        words=", ".join(
            f"{case['name']} ({', '.join(f'{x:.4g}' for x in case['force_N'])}) N"
            + (f" and {heat:.4g} K" if (heat := case["temperature_change_K"]) else "")
            for case in cases
        ),
    )


def _material_of(result: RunResult) -> _Found | None:
    name = result.material.get("name")
    return None if name is None else _Found(name=str(name), words=str(name))


def _differing(
    results: Sequence[RunResult],
    what_of: Callable[[RunResult], _Found | None],
    what: str,
    so: str = "",
) -> list[str]:
    """A sentence where runs differ in something; who does not know it is left out."""
    groups: list[tuple[_Found, list[int]]] = []
    for number, result in enumerate(results, 1):
        found = what_of(result)
        if found is None:
            continue
        group = next((group for group in groups if _alike(group[0], found)), None)
        if group is None:
            groups.append((found, [number]))
        else:
            group[1].append(number)
    if len(groups) < 2:
        return []
    texts = "; ".join(f"{_numbers(numbers)} {found.words}" for found, numbers in groups)
    return [f"the runs have different {what}: {texts}" + (f"; {so}" if so else "")]


def _alike(first: _Found, second: _Found) -> bool:
    """Whether two have the same name and the same numbers."""
    if first.name != second.name or len(first.numbers) != len(second.numbers):
        return False
    size = max(map(abs, (*first.numbers, *second.numbers)), default=0.0)
    return all(
        math.isclose(a, b, rel_tol=_SAME, abs_tol=_SAME * size)
        for a, b in zip(first.numbers, second.numbers, strict=True)
    )


def _numbers(numbers: Iterable[int]) -> str:
    return ", ".join(map(str, numbers))


def bodies_table(comparison: Comparison) -> Cells:
    """Cell of each run, density of its lattice, and shares of its phases."""
    phases = [comparison.phases(result) for result in comparison.results]
    names = list(dict.fromkeys(name for shares in phases for name in shares))
    rows = []
    for row, result, shares in zip(comparison.rows, comparison.results, phases, strict=True):
        density = result.lattice_density
        rows.append(
            (
                str(row.number),
                comparison.cells[row.number],
                f"{density:.3f}" if density else "-",
                *(f"{shares[name]:.1%}" if name in shares else "-" for name in names),
            )
        )
    return ("", "cell", "lattice density", *names), rows


def margins_table(comparison: Comparison) -> Cells:
    """Limits in rows, runs in columns: what is left of each allowed value."""
    rows_of: list[dict[str, Any]] = [
        {limit_name(limit): limit for limit in result.limits} for result in comparison.results
    ]
    cells = []
    for name in dict.fromkeys(name for limits in rows_of for name in limits):
        found = [limits.get(name) for limits in rows_of]
        there = [limit for limit in found if limit is not None]
        allowed = {f"{limit.limit:.4g} {limit.unit}" for limit in there}
        governing = {limit.load_case for limit in there}
        line = [name, allowed.pop() if len(allowed) == 1 else "differs"]
        line.append(governing.pop() if len(governing) == 1 else "differs")
        for limit in found:
            if limit is None:
                line.append("-")
                continue
            words = [f"{1.0 - limit.utilisation:+.1%}"]
            words += [] if limit.word == "holds" else [limit.word]
            words += [f"of {limit.limit:.4g} {limit.unit}"] if line[1] == "differs" else []
            words += [f"in {limit.load_case}"] if line[2] == "differs" else []
            line.append(" ".join(words))
        cells.append(tuple(line))
    return ("limit", "allowed", "load case", *(str(row.number) for row in comparison.rows)), cells

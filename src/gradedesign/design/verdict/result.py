"""Result that a run returns and writes to result.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from math import isfinite
from pathlib import Path
from textwrap import shorten
from typing import Any, Literal

from gradedesign.common.values.shown_record import ShownRecord, frame_of
from gradedesign.design.check.price import PricedBody
from gradedesign.design.loop.iteration_row import Iteration, iteration_from_json
from gradedesign.errors import CaseError
from gradedesign.mechanics.limits.row import LimitRow, row_from_json

#: Limits and warnings that `repr` shows, so that it fits in a terminal of 24 lines. Chosen.
_ROWS_SHOWN, _WARNINGS_SHOWN = 6, 3
#: Characters of a warning in it: two lines of a terminal. Chosen.
_COLUMNS = 160


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RunResult(ShownRecord):
    """Outcome of a run.

    Attributes
    ----------
    status : {"met", "not_met", "infeasible", "partial", "failed"}
    reason : str
        One sentence for a person.
    ended_by : str
        ``tight``: a design with a limit at 97 % or more was accepted. ``enclosed``: a
        design was accepted, and one of at most 1 % less mass breaks a limit.
        ``iterations``, ``time``: that budget. ``stuck``: the last iteration changed
        nothing. ``saturated``: no density of this lattice can hold a limit. ``refused``:
        the next design could not be analysed. ``unjudged``: two designs in succession could
        be analysed at one resolution only, or not meshed anew. ``unaccepted``: acceptance
        of a design failed. ``solid``: the solid part breaks a limit. ``stop_after``: as the
        case asks. ``judged``: a body made elsewhere. ``error``.
    limits : tuple of LimitRow
        Of a run that failed, those of its last iteration.
    solid : tuple of LimitRow
        The same limits with their values on the fully solid part.
    mass_g, lattice_mass_g : float or None
        Of the solid that the printed file encloses, where one was written and read back; of the
        sized homogenised part where the run stopped there.
    relative_density : float or None
        Mass over solid mass.
    lattice_density : float or None
        Mean density of the lattice phase of the printed file: whole members on the part's faces add
        to the density of sizing, cut ones reduce it.
    measures : mapping
        Stress measures by phase, worst neighbourhood included.
    printed : mapping
        Measures of the printed file: volumes, thickness, and how the analysed solid differs.
    files : mapping of what to path below the run folder
    timing_s : mapping of stage to seconds
        ``sizing``, ``explicit mesh`` and ``explicit solve`` are parts of ``iteration``,
        ``whole printed surface`` one of ``acceptance``.
    predicted : mapping
        What ``timing_s`` compares with: a `CostPrediction` before the first iteration and another
        after it.
    budget : mapping
        Time and iterations that the run was allowed.
    bodies : tuple of PricedBody
        What others would weigh at the same limits, as sizing predicts; empty before a verdict, and
        where the case leaves them out.
    why_lattice : str
        One sentence on the body that the case asks for beside the others.
    repairs : mapping of str to int
        What was changed in the surface of the part's file, counted; empty where nothing was.
    file_bodies : tuple of mapping
        Name and role of each body of the part's file that is not in the part, and whether it was
        subtracted or left out.
    symmetry : mapping
        Planes on which the case mirrors its part, how often the whole part holds the modelled one
        (``copies``), and its masses; empty without any. All other masses are the modelled part's.
    yields : tuple of str
        Warnings that the fully solid part, or the printed solid, yields away from supports.
    date : str
        When the result was written, ISO 8601 in UTC; no part of `case_hash`.
    version : str
        Of gradedesign.
    checksums : mapping
        SHA-256 of the files of the part (``part``) and of the printed lattice (``print``), by name.
    load_cases : tuple of mapping
        Supports and resultants of the loads of every load case.
    material : mapping
        Numbers of the material with their units in their names.
    law : mapping
        Name, source, window and coefficients.
    """

    status: str
    lightest: bool
    reason: str
    ended_by: str = ""
    limits: tuple[LimitRow, ...] = ()
    mass_g: float | None = None
    solid_mass_g: float | None = None
    lattice_mass_g: float | None = None
    relative_density: float | None = None
    lattice_density: float | None = None
    iterations: tuple[Iteration, ...] = ()
    acceptance: Mapping[str, Any] = field(default_factory=dict)
    measures: Mapping[str, Any] = field(default_factory=dict)
    printed: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    timing_s: Mapping[str, float] = field(default_factory=dict)
    predicted: Mapping[str, Any] = field(default_factory=dict)
    budget: Mapping[str, float] = field(default_factory=dict)
    bodies: tuple[PricedBody, ...] = ()
    why_lattice: str = ""
    repairs: Mapping[str, int] = field(default_factory=dict)
    file_bodies: tuple[Mapping[str, str], ...] = ()
    symmetry: Mapping[str, Any] = field(default_factory=dict)
    yields: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    case_hash: str = ""
    case_name: str = ""
    folder: Path = Path()
    date: str = ""
    version: str = ""
    checksums: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    load_cases: tuple[Mapping[str, Any], ...] = ()
    material: Mapping[str, Any] = field(default_factory=dict)
    law: Mapping[str, Any] = field(default_factory=dict)
    solid: tuple[LimitRow, ...] = ()

    @property
    def verdict(self) -> str:
        """Status and reason in a sentence."""
        lightest = ", lightest" if self.lightest else ""
        return f"{self.status.upper()}{lightest}: {self.reason}"

    def to_frame(self, rows: Literal["limits", "solid", "iterations", "bodies"] = "limits") -> Any:
        """The limits, or other rows of the result, as a pandas ``DataFrame``.

        Parameters
        ----------
        rows : {"limits", "solid", "iterations", "bodies"}
            ``solid``: the limits on the fully solid part. ``bodies``: what others would weigh.

        Raises
        ------
        CaseError
            If there are no such rows, or pandas is not installed.
        """
        if rows in ("limits", "solid"):
            return frame_of([_limit_row(row) for row in getattr(self, rows)])
        if rows == "iterations":
            return frame_of([_iteration_row(iteration) for iteration in self.iterations])
        if rows == "bodies":
            return frame_of([asdict(body) for body in self.bodies])
        raise CaseError(f"rows is {rows!r}; expected one of limits, solid, iterations, bodies")

    def __repr__(self) -> str:
        """Verdict, mass, the most used limits, warnings and folder; the rest is in the fields."""
        verdict = f"{self.status}, lightest" if self.lightest else self.status
        lines = [f"<RunResult of case {self.case_name!r}: {verdict}", self.reason]
        if self.mass_g is not None:
            solid = "" if self.solid_mass_g is None else f" of {self.solid_mass_g:.4g} g solid"
            lines.append(f"mass {self.mass_g:.4g} g{solid}")
        used = sorted(self.limits, key=lambda row: row.utilisation, reverse=True)
        limits = [f"{row.name} ({row.load_case}): {row.words} {row.word}" for row in used]
        lines += _shortened(limits, _ROWS_SHOWN, "limits")
        warnings = [
            shorten(f"warning: {text}", width=_COLUMNS, placeholder=" ...")
            for text in self.warnings
        ]
        lines += _shortened(warnings, _WARNINGS_SHOWN, "warnings")
        lines.append(f"{len(self.iterations)} iterations, files in {self.folder}>")
        return "\n  ".join(lines)


def _shortened(lines: Sequence[str], most: int, what: str) -> list[str]:
    """The first lines, and how many more there are."""
    more = len(lines) - most
    return [*lines[:most], *([f"and {more} more {what}"] if more > 0 else [])]


def _limit_row(row: LimitRow) -> dict[str, Any]:
    """A limit in a row: what is compared, which end of its band decides, and whether it holds."""
    data = {k: v for k, v in asdict(row).items() if k not in ("key", "band")}
    low, high = (None, None) if row.band is None else (row.band.low, row.band.high)
    judged = {"decisive": row.decisive, "utilisation": row.utilisation, "passed": row.passed}
    return {**data, "low": low, "high": high, **judged}


def _iteration_row(iteration: Iteration) -> dict[str, Any]:
    """An iteration in a row, with predicted and explicit value of every limit."""
    row = {k: v for k, v in asdict(iteration).items() if k not in ("limits", "timing_s")}
    for limit in iteration.limits:
        for what in ("predicted", "explicit", "discrepancy"):
            row[f"{limit.label}, {what}"] = getattr(limit, what)
    return row


def from_json(data: Mapping[str, Any]) -> RunResult:
    """The result that `as_json` wrote.

    Raises `KeyError`, `TypeError`, `ValueError` if the data is of another layout.
    """
    field_names = {entry.name for entry in fields(RunResult)}
    plain = {name: value for name, value in data.items() if name in field_names}
    for name in ("limits", "solid"):
        plain[name] = tuple(row_from_json(row) for row in data.get(name, ()))
    plain["iterations"] = tuple(iteration_from_json(entry) for entry in data["iterations"])
    plain["bodies"] = tuple(PricedBody(**entry) for entry in data.get("bodies", ()))
    for name in ("yields", "warnings", "plugins"):
        plain[name] = tuple(data[name])
    for name in ("file_bodies", "load_cases"):
        plain[name] = tuple(data.get(name, ()))
    return RunResult(**{**plain, "folder": Path(data["folder"])})


def as_json(result: RunResult) -> dict[str, Any]:
    """Plain data for result.json; every number keeps its unit in its name."""
    data = asdict(result)
    data["folder"] = str(result.folder)
    if result.symmetry and result.mass_g is not None:
        data["symmetry"] = {**result.symmetry, "mass_g": result.symmetry["copies"] * result.mass_g}
    for key, rows in (("limits", result.limits), ("solid", result.solid)):
        data[key] = [
            {
                **asdict(row),
                "decisive": row.decisive,
                "utilisation": row.utilisation if isfinite(row.utilisation) else None,
                "passed": row.passed,
            }
            for row in rows
        ]
    return data


def scope_words(acceptance: Mapping[str, Any]) -> str:
    """Scope of acceptance on the printed surface, as plain text; empty before acceptance."""
    if not acceptance:
        return ""
    share = f"{acceptance['share_of_volume']:.1%} of the printed volume"
    basis = (
        "every limit is judged on the whole printed surface: read back from the file and analysed "
        "by finite cells at two resolutions or more"
    )
    if acceptance["scope"] == "none":
        stressed = any(entry["unit"] == "MPa" for entry in acceptance["limits"])
        why = (
            "a limit is broken whatever they show"
            if stressed
            else "no limit is on stress, which alone they judge"
        )
        return f"{basis}; no submodels were meshed again, since {why}"
    if acceptance["scope"] == "whole":
        return (
            f"{basis}; an independent mesher meshed it again whole ({share}) for stress, and "
            f"bands of displacements include what that mesh shows"
        )
    count = len(acceptance["submodels"])
    submodels = f"{count} most stressed submodels" if count != 1 else "most stressed submodel"
    return (
        f"{basis}; an independent mesher meshed it again in its {submodels} ({share}), whose "
        f"stress over that of the finite cells scales the stress in the lattice"
    )


def symmetry_words(result: RunResult) -> str:
    """The whole part of a case with planes of symmetry, as plain text; empty without any."""
    if not result.symmetry:
        return ""
    times = result.symmetry["copies"]
    masses = f"{result.symmetry['solid_mass_g']:.4g} g if solid"
    if result.mass_g is not None:
        masses = f"{times * result.mass_g:.4g} g, {masses}"
    return (
        f"Mirrored on {', '.join(result.symmetry['planes'])}: the whole part is {times} times this "
        f"one, {masses}; files, loads and other masses are those of the modelled one"
    )

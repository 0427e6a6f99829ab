"""What a run returns and writes to result.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from gradedesign.ladder.verdict import LimitRow


@dataclass(frozen=True, slots=True, kw_only=True)
class Iteration:
    """One round: what was predicted, what the explicit analysis said, what it taught.

    Attributes
    ----------
    round : int
        From 1.
    lattice_mass_g, mass_g : float
        By the explicit mesh.
    mean_density : float
        That sizing asked of the lattice phase.
    predicted_displacement, explicit_displacement : tuple of float, mm
    predicted_stress, explicit_stress : float or None, MPa
        Lattice stress measure.
    displacement_gap : tuple of float
        explicit / predicted - 1, prediction made before the analysis.
    stress_gap : float or None
    use : float
        Largest value over limit.
    passed : bool
    dofs : int
    mesh_size_mm : float
    grid_share : float
        Mesh size over the one that the thinnest wall asks for: less than 1 where that grid lost
        volume or pieces and was refined.
    seconds : float
    stiffness_factor, stress_factor : float
        Corrections that this round's sizing used.
    sizing_iterations : int
    sizing_converged : bool
    timing_s : mapping of stage to seconds
        ``sizing``, ``explicit mesh``, ``explicit solve``; the rest of ``seconds`` is learning.
    """

    round: int
    lattice_mass_g: float
    mass_g: float
    mean_density: float
    predicted_displacement: tuple[float, ...]
    explicit_displacement: tuple[float, ...]
    predicted_stress: float | None
    explicit_stress: float | None
    displacement_gap: tuple[float, ...]
    stress_gap: float | None
    use: float
    passed: bool
    dofs: int
    mesh_size_mm: float
    seconds: float
    stiffness_factor: float
    stress_factor: float
    sizing_iterations: int
    sizing_converged: bool
    grid_share: float = 1.0
    timing_s: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """Outcome of a run.

    Attributes
    ----------
    status : {"met", "not_met", "infeasible", "partial", "failed"}
    lightest : bool
    reason : str
        One sentence for a person.
    ended_by : str
        ``tight``: a design that uses a limit was accepted. ``rounds``, ``time``: that budget.
        ``stuck``: the last round changed nothing. ``saturated``: no density of this lattice can
        hold a limit. ``refused``: the next design could not be analysed. ``solid``: the solid part
        breaks a limit. ``stop_after``: as the case asks. ``error``.
    limits : tuple of LimitRow
    solid : tuple of LimitRow
        The same limits with their values on the fully solid part.
    mass_g, solid_mass_g, lattice_mass_g : float or None
    relative_density : float or None
        Mass over solid mass.
    lattice_density : float or None
        Mean density of the lattice phase by its explicit mesh: whole members on the part's faces
        add to what sizing asked, cut ones take away.
    iterations : tuple of Iteration
    acceptance : mapping
    measures : mapping
        Stress measures by phase, worst neighbourhood included.
    files : mapping of what to path below the run folder
    timing_s : mapping of stage to seconds
        ``sizing``, ``explicit mesh`` and ``explicit solve`` are parts of ``round``, ``second
        mesh`` one of ``acceptance``.
    predicted : mapping
        What ``timing_s`` compares with: a `CostPrediction` before the first round and another
        after it.
    budget : mapping
        Time and rounds that the run was allowed.
    warnings : tuple of str
    plugins : tuple of str
    versions : mapping
    case_hash : str
    case_name : str
    folder : Path
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
    files: Mapping[str, str] = field(default_factory=dict)
    timing_s: Mapping[str, float] = field(default_factory=dict)
    predicted: Mapping[str, Any] = field(default_factory=dict)
    budget: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    case_hash: str = ""
    case_name: str = ""
    folder: Path = Path()
    law: Mapping[str, Any] = field(default_factory=dict)
    solid: tuple[LimitRow, ...] = ()


def from_json(data: Mapping[str, Any]) -> RunResult:
    """The result that `as_json` wrote.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the data is of another layout.
    """
    known = {one.name for one in fields(RunResult)}
    plain = {name: value for name, value in data.items() if name in known}
    rows = {one.name for one in fields(LimitRow)}
    for name in ("limits", "solid"):
        plain[name] = tuple(
            LimitRow(**{k: v for k, v in row.items() if k in rows}) for row in data.get(name, ())
        )
    plain["iterations"] = tuple(_iteration(one) for one in data["iterations"])
    for name in ("warnings", "plugins"):
        plain[name] = tuple(data[name])
    return RunResult(**{**plain, "folder": Path(data["folder"])})


def _iteration(data: Mapping[str, Any]) -> Iteration:
    plain: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in data.items()
    }
    return Iteration(**plain)


def as_json(result: RunResult) -> dict[str, Any]:
    """Plain data for result.json; every number keeps its unit in its name."""
    data = asdict(result)
    data["folder"] = str(result.folder)
    for key, rows in (("limits", result.limits), ("solid", result.solid)):
        data[key] = [{**asdict(row), "use": row.use, "passed": row.passed} for row in rows]
    return data

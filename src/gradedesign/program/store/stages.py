"""Finished iterations in the run folder, from which an interrupted run resumes."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gradedesign.arrays import FloatArray
from gradedesign.common.system.cache import content_key
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.iteration_row import iteration_from_json
from gradedesign.design.loop.loop_stages import Judged
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import CaseError
from gradedesign.mechanics.explicit.correction import Correction, Discrepancy
from gradedesign.mechanics.limits.key import LimitKey, keyed_from_json
from gradedesign.mechanics.limits.row import row_from_json
from gradedesign.mechanics.limits.verdict import Factors
from gradedesign.mechanics.sizing.members import MemberField
from gradedesign.program.store.run_folder import RunFolder, open_run_folder

#: Raised when what an iteration stores changes its meaning.
_ITERATION_VERSION = 13


def default_folder(name: str) -> Path:
    """Run folder of a case below the working folder, from the letters of its name."""
    plain = re.sub(r"[^\w.-]+", "-", name).strip("-.") or "case"
    return Path("runs") / plain


def open_stages(path: Path, case_hash: str, *, resume: bool, overwrite: bool) -> RunFolder:
    """Open the run folder of a case; use it in a ``with`` statement."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make {path.parent} for the run folder: {error.strerror}; take another "
            f"folder=..."
        ) from error
    return open_run_folder(path, case_hash, resume=resume, overwrite=overwrite)


def design_key(model: DesignModel) -> str:
    """Content key of everything that the iterations of a run depend on."""
    mesh = model.homogenised.space.mesh
    return content_key(
        "iteration",
        _ITERATION_VERSION,
        model.plan.case.case_hash,
        model.cells.cell.name,
        repr([(law.name, law.source) for law in model.homogenised.law.laws]),
        mesh.points,
        mesh.tets,
    )


def begun_budget(out: RunFolder, case_hash: str, run: RunSpec, *, begins: bool = False) -> RunSpec:
    """``run`` with the memory and time with which the loop of a run folder began.

    ``begins``: it begins now, unless it has begun before.
    """
    key = content_key("budget", case_hash)
    stored = out.load_stage("budget", key)
    if stored is not None:
        return run.model_copy(update=dict(stored[1]))
    if begins:
        out.save_stage("budget", key, {}, {"memory": run.memory, "time": run.time})
    return run


def save_iteration(out: RunFolder, key: str, iteration: DesignIteration) -> None:
    """Store a finished iteration; ``key`` is that of `design_key`."""
    number = iteration.summary.number
    arrays, meta = iteration_to_stage(iteration)
    out.save_stage(f"iteration-{number}", key, arrays, meta)


def save_acceptance(
    out: RunFolder, key: str, refused: Sequence[int], factors: Factors, last: Judged
) -> None:
    """Store the outcome of acceptance: iterations that it refused, and factors on limits."""
    meta = {
        "refused": list(refused),
        "factors": [[asdict(key), value] for key, value in factors.items()],
        "last_holds": last.holds,
        "last_factors": [[asdict(key), value] for key, value in last.factors.items()],
    }
    out.save_stage("acceptance", key, {}, meta)


def load_acceptance(
    out: RunFolder, key: str, finished: int
) -> tuple[tuple[int, ...], Factors, Judged | None]:
    """Iterations that acceptance refused, its factors, and the design that it judged last.

    None before the first acceptance. Iterations after the ``finished`` ones that are stored are run
    again, and not refused yet.
    """
    stored = out.load_stage("acceptance", key)
    if stored is None:
        return (), {}, None
    meta = stored[1]
    factors = dict(keyed_from_json(meta["factors"]))
    refused = tuple(int(number) for number in meta["refused"] if number <= finished)
    last = Judged(
        holds=bool(meta["last_holds"]), factors=dict(keyed_from_json(meta["last_factors"]))
    )
    return refused, factors, last


def load_iterations(out: RunFolder, key: str) -> tuple[DesignIteration, ...]:
    """Iterations that an interrupted run finished, in order."""
    iterations: list[DesignIteration] = []
    while True:
        stored = out.load_stage(f"iteration-{len(iterations) + 1}", key)
        if stored is None:
            return tuple(iterations)
        iterations.append(iteration_from_stage(*stored))


def iteration_to_stage(iteration: DesignIteration) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Arrays and plain data of an iteration for the run folder."""
    meta = {
        "summary": asdict(iteration.summary),
        "rows": [asdict(row) for row in iteration.rows],
        "correction": asdict(iteration.correction),
        "at_lower_bound": iteration.at_lower_bound,
        "discrepancy": asdict(iteration.discrepancy),
        "expected": [[asdict(key), value] for key, value in iteration.expected.items()],
    }
    arrays = {"variables": iteration.variables, "rho": iteration.rho}
    if iteration.members is not None:
        field = iteration.members
        arrays["members"] = field.variables
        meta["members"] = [field.radius, field.offset, field.threshold, field.tied]
    return arrays, meta


def iteration_from_stage(
    arrays: Mapping[str, FloatArray], meta: Mapping[str, Any]
) -> DesignIteration:
    """The iteration that `iteration_to_stage` stored."""
    correction, discrepancy = dict(meta["correction"]), dict(meta["discrepancy"])
    correction["samples"] = tuple((float(a), float(b)) for a, b in correction["samples"])
    correction["factors"] = keyed_from_json(correction["factors"])
    governing = discrepancy["governing"]
    return DesignIteration(
        summary=iteration_from_json(meta["summary"]),
        rows=tuple(row_from_json(row) for row in meta["rows"]),
        correction=Correction(**correction),
        variables=arrays["variables"],
        rho=arrays["rho"],
        members=(MemberField(arrays["members"], *meta["members"]) if "members" in arrays else None),
        at_lower_bound=bool(meta["at_lower_bound"]),
        discrepancy=Discrepancy(
            values=keyed_from_json(discrepancy["values"]),
            governing=None if governing is None else LimitKey(**governing),
        ),
        expected=dict(keyed_from_json(meta["expected"])),
    )

"""Finished iterations in the run folder, from which an interrupted run resumes."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gradedesign.arrays import FloatArray
from gradedesign.case.schema import CaseIdentity
from gradedesign.errors import CaseError
from gradedesign.limits.key import LimitKey, keyed_from_json
from gradedesign.limits.row import row_from_json
from gradedesign.limits.verdict import Factors
from gradedesign.loop.rounds import Round
from gradedesign.output.result import iteration_from_json
from gradedesign.resolve.setup import Setup
from gradedesign.verify.correction import Correction, Discrepancy
from gradedesign.workspace.cache import content_key
from gradedesign.workspace.run_folder import RunFolder, open_run_folder

#: Raised when what a round stores changes its meaning.
ROUND_VERSION = 4


def default_folder(case: CaseIdentity) -> Path:
    """Run folder of a case below the working folder, from the letters of its name."""
    plain = re.sub(r"[^\w.-]+", "-", case.name).strip("-.") or "case"
    return Path("runs") / plain


def open_stages(path: Path, case: CaseIdentity, *, resume: bool, overwrite: bool) -> RunFolder:
    """Open the run folder of a case; use it in a ``with`` statement."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make {path.parent} for the run folder: {error.strerror}; choose another "
            f"folder with -o"
        ) from error
    return open_run_folder(path, case.case_hash, resume=resume, overwrite=overwrite)


def round_key(setup: Setup, number: int) -> str:
    """Content key of everything a round depends on."""
    return content_key(
        "round",
        ROUND_VERSION,
        number,
        setup.problem.case.case_hash,
        setup.cells.cell.name,
        setup.cells.law.name,
        setup.cells.law.source,
        setup.problem.space.mesh.points,
        setup.problem.space.mesh.tets,
    )


def save_round(out: RunFolder, setup: Setup, done: Round) -> None:
    """Store a finished round."""
    number = done.iteration.number
    arrays, meta = round_to_stage(done)
    out.save_stage(f"iteration-{number}", round_key(setup, number), arrays, meta)


def save_acceptance(out: RunFolder, setup: Setup, refused: Sequence[int], factors: Factors) -> None:
    """Store the outcome of acceptance: iterations that it refused, and factors on limits."""
    meta = {
        "refused": list(refused),
        "factors": [[asdict(key), value] for key, value in factors.items()],
    }
    out.save_stage("acceptance", round_key(setup, 0), {}, meta)


def load_acceptance(out: RunFolder, setup: Setup, played: int) -> tuple[tuple[int, ...], Factors]:
    """Rounds that acceptance refused, and its factors; none before the first acceptance.

    Rounds after the ``played`` ones that are stored will be played again, and are not refused yet.
    """
    stored = out.load_stage("acceptance", round_key(setup, 0))
    if stored is None:
        return (), {}
    meta = stored[1]
    factors = dict(keyed_from_json(meta["factors"]))
    return tuple(int(number) for number in meta["refused"] if number <= played), factors


def load_rounds(out: RunFolder, setup: Setup) -> tuple[Round, ...]:
    """Rounds that an interrupted run finished, in order."""
    rounds: list[Round] = []
    while True:
        number = len(rounds) + 1
        stored = out.load_stage(f"iteration-{number}", round_key(setup, number))
        if stored is None:
            return tuple(rounds)
        rounds.append(round_from_stage(*stored))


def round_to_stage(done: Round) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Arrays and plain data of a round for the run folder."""
    meta = {
        "iteration": asdict(done.iteration),
        "rows": [asdict(row) for row in done.rows],
        "correction": asdict(done.correction),
        "at_lower_bound": done.at_lower_bound,
        "discrepancy": asdict(done.discrepancy),
    }
    return {"variables": done.variables, "rho": done.rho}, meta


def round_from_stage(arrays: Mapping[str, FloatArray], meta: Mapping[str, Any]) -> Round:
    """The round that `round_to_stage` stored."""
    correction, discrepancy = dict(meta["correction"]), dict(meta["discrepancy"])
    correction["samples"] = tuple((float(a), float(b)) for a, b in correction["samples"])
    correction["factors"] = keyed_from_json(correction["factors"])
    governing = discrepancy["governing"]
    return Round(
        iteration=iteration_from_json(meta["iteration"]),
        rows=tuple(row_from_json(row) for row in meta["rows"]),
        correction=Correction(**correction),
        variables=arrays["variables"],
        rho=arrays["rho"],
        at_lower_bound=bool(meta["at_lower_bound"]),
        discrepancy=Discrepancy(
            values=keyed_from_json(discrepancy["values"]),
            governing=None if governing is None else LimitKey(**governing),
        ),
    )

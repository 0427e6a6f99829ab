"""Rounds in the run folder: what a killed run resumes from."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from gradedesign.case.schema import CaseIdentity
from gradedesign.errors import CaseError
from gradedesign.limits.key import keyed_from_json
from gradedesign.limits.verdict import Factors
from gradedesign.loop.rounds import Round, round_from_stage, round_to_stage
from gradedesign.resolve.setup import Setup
from gradedesign.workspace.cache import content_key
from gradedesign.workspace.run_folder import RunFolder, open_run_folder

#: Raised when what a round stores changes its meaning.
ROUND_VERSION = 3


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
        setup.case.case_hash,
        setup.cell.name,
        setup.law.name,
        setup.law.source,
        setup.space.mesh.points,
        setup.space.mesh.tets,
    )


def save_round(out: RunFolder, setup: Setup, done: Round) -> None:
    """Store a finished round."""
    number = done.iteration.round
    arrays, meta = round_to_stage(done)
    out.save_stage(f"round-{number}", round_key(setup, number), arrays, meta)


def save_acceptance(out: RunFolder, setup: Setup, refused: Sequence[int], factors: Factors) -> None:
    """Store what acceptance taught: rounds whose design it refused, and factors on limits."""
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
        stored = out.load_stage(f"round-{number}", round_key(setup, number))
        if stored is None:
            return tuple(rounds)
        rounds.append(round_from_stage(*stored))

"""The solver ``petsc-gamg``: conjugate gradients, smoothed aggregation by PETSc on ranks of MPI."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gradedesign import LinearAnswer, LinearSolver, LinearSystem, SolverError

if TYPE_CHECKING:
    from collections.abc import Callable

_RANKS = Path(__file__).with_name("_petsc_ranks.py")
#: Builds of PETSc as Debian installs them.
_DEBIAN = Path("/usr/lib/petscdir")
#: Seconds that a Python may take to import petsc4py.
_IMPORT_S = 60.0
#: Letters of the ranks' last words in a message.
_LAST_WORDS = 600


@dataclass(frozen=True, slots=True, kw_only=True)
class Ranks:
    """Command and environment that start PETSc's processes.

    Attributes
    ----------
    launch : tuple of str
        Such as ``("mpirun", "-n", "2")``.
    python : str
        With petsc4py and numpy.
    environment : mapping of str to str
        Added to that of this process.
    """

    launch: tuple[str, ...]
    python: str
    environment: Mapping[str, str]


def find_ranks() -> Ranks:
    """Command that starts ranks on this machine, from the environment or from what is installed.

    Raises
    ------
    SolverError
        If nothing starts them, or no Python has petsc4py.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    launch = tuple(shlex.split(os.environ.get("GRADEDESIGN_PETSC_LAUNCH", f"mpirun -n {cores}")))
    if not launch or shutil.which(launch[0]) is None:
        raise SolverError(
            f"petsc-gamg needs {launch[0] if launch else 'mpirun'}, which is not installed; "
            f"install MPI, or name what starts ranks in GRADEDESIGN_PETSC_LAUNCH"
        )
    named = os.environ.get("GRADEDESIGN_PETSC_PYTHON")
    pythons = [named] if named else [sys.executable, "/usr/bin/python3"]
    for python in pythons:
        for build in (None, *_builds()):
            environment = {} if build is None else {"PETSC_DIR": build}
            if _imports(python, build):
                return Ranks(launch=launch, python=python, environment=environment)
    raise SolverError(
        f"petsc-gamg needs petsc4py, which {' and '.join(pythons)} cannot import; install it, or "
        f"name a Python that has it in GRADEDESIGN_PETSC_PYTHON"
    )


def _builds() -> tuple[str, ...]:
    """Builds of Debian for real numbers, where none is named."""
    if "PETSC_DIR" in os.environ:
        return ()
    return tuple(str(path) for path in sorted(_DEBIAN.glob("petsc*/*-real"), reverse=True))


@cache
def _imports(python: str, build: str | None) -> bool:
    """Whether a Python imports petsc4py."""
    environment = dict(os.environ) if build is None else {**os.environ, "PETSC_DIR": build}
    environment.pop("PYTHONPATH", None)
    try:
        return (
            subprocess.run(
                [python, "-c", "from petsc4py import PETSc"],
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=_IMPORT_S,
                check=False,
            ).returncode
            == 0
        )
    except (OSError, subprocess.TimeoutExpired):
        return False


def prepare(system: LinearSystem) -> Callable[..., LinearAnswer]:
    """Write the matrix, the supports and the rigid motions where the ranks read them."""
    ranks = find_ranks()
    folder = Path(tempfile.mkdtemp(prefix="gradedesign-petsc-"))
    matrix = system.matrix.tobsr(blocksize=(3, 3))
    matrix.sort_indices()
    for name, array in (
        ("indptr", matrix.indptr),
        ("indices", matrix.indices),
        ("blocks", matrix.data),
        ("fixed", ~system.free),
        ("near_null_space", system.near_null_space),
    ):
        np.save(folder / f"{name}.npy", array)

    def solve(right: NDArray[Any], start: NDArray[Any], rtol: float) -> LinearAnswer:
        np.save(folder / "right.npy", right)
        np.save(folder / "start.npy", start)
        run_ranks(ranks, folder, rtol)
        return LinearAnswer(
            x=np.load(folder / "x.npy"), iterations=np.load(folder / "iterations.npy")
        )

    weakref.finalize(solve, shutil.rmtree, folder, ignore_errors=True)
    return solve


def run_ranks(ranks: Ranks, folder: Path, rtol: float) -> None:
    """Solve what lies in a folder; the ranks end with this call, or with this process.

    Raises
    ------
    SolverError
        If they fail or do not converge, with their last words.
    """
    environment = {**os.environ, **ranks.environment, "OMP_NUM_THREADS": "1"}
    # A path of gradedesign's Python would lead theirs to the wrong numpy.
    environment.pop("PYTHONPATH", None)
    log = folder / "log"
    with log.open("wb") as output:
        process = subprocess.Popen(
            [*ranks.launch, ranks.python, str(_RANKS), str(folder), repr(rtol)],
            env=environment,
            # Held open: the ranks end when it closes, also where this process is killed.
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait()
        finally:
            if process.poll() is None:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            if process.stdin is not None:
                process.stdin.close()
    if code != 0:
        # What the launcher adds below a rule says only that a rank ended.
        text = log.read_text(encoding="utf-8", errors="replace")
        words = " ".join((re.split(r"-{20,}", text)[0].strip() or text).split())
        raise SolverError(
            f"petsc-gamg: the ranks ended with code {code}: ... {words[-_LAST_WORDS:]}; take "
            f'solver = "multigrid"'
        )


PETSC_GAMG = LinearSolver(name="petsc-gamg", prepare=prepare)

"""Run a module in a process of its own that may crash, hang or eat memory without harm."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import ArrayLike, NDArray

from gradedesign.errors import GradeDesignError, MeshError, ResourceError
from gradedesign.workspace.atomic import read_npz, write_npz, write_text

Option: TypeAlias = float | int | str | bool

#: How a worker says that it ran out of memory: the exit code of `ResourceError`.
MEMORY_EXIT = ResourceError.exit_code

_LAUNCHER = Path(__file__).with_name("_launch_worker.py")
#: What libraries say when they cannot get address space, for arrays, stacks or their own code.
_OUT_OF_MEMORY = (
    "MemoryError",
    "bad_alloc",
    "Cannot allocate memory",
    "failed to map segment",
    "pthread_create has failed",
    "pthread_create failed",
)
_LAST_BYTES = 4096
_LAST_LINES = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkerResult:
    """What a worker returned.

    Attributes
    ----------
    arrays : mapping of str to array
    seconds : float
        Wall time, with starting the process.
    """

    arrays: Mapping[str, NDArray[Any]]
    seconds: float


def run_worker(
    module: str,
    arrays: Mapping[str, ArrayLike],
    options: Mapping[str, Option],
    *,
    time_limit_s: float,
    memory_limit_bytes: int,
) -> WorkerResult:
    """Run ``python -m module in.npz out.npz options.json`` within limits.

    The process runs in a private temporary folder, in a session of its own, and never outlives
    this call: its whole process group is killed at the time limit, on any error and on Ctrl-C.

    Parameters
    ----------
    module : str
        Dotted name; see `serve` for the other side.
    arrays : mapping of str to array_like
        What the worker reads from ``in.npz``.
    options : mapping of str to float, int, str or bool
        What it reads from ``options.json``.
    time_limit_s : float
        Wall time, s.
    memory_limit_bytes : int
        Address space of the process, bytes.

    Raises
    ------
    MeshError
        If the worker crashes (the signal is named), fails, is ``timed out``, or leaves no readable
        result; the message ends with its last lines of output.
    ResourceError
        If it ran out of memory.
    """
    if not all(part.isidentifier() for part in module.split(".")):
        raise ValueError(f"{module!r} is not the dotted name of a module")
    if not time_limit_s > 0 or memory_limit_bytes <= 0:
        raise ValueError(
            f"limits must be positive, not {time_limit_s} s and {memory_limit_bytes} bytes"
        )
    start = time.monotonic()
    with tempfile.TemporaryDirectory(
        prefix="gradedesign-worker-", ignore_cleanup_errors=True
    ) as name:
        folder = Path(name)
        write_npz(folder / "in.npz", **arrays)
        write_text(folder / "options.json", json.dumps(dict(options), allow_nan=False))
        code = _run(module, folder, time_limit_s, memory_limit_bytes)
        seconds = time.monotonic() - start
        if code != 0:
            raise _failure(module, folder, code, time_limit_s, memory_limit_bytes)
        try:
            result = read_npz(folder / "out.npz")
        except (OSError, ValueError) as cause:
            raise MeshError(
                f"worker {module} ended without a readable result ({cause}); {_last_words(folder)}"
            ) from cause
    return WorkerResult(arrays=result, seconds=seconds)


def serve(
    compute: Callable[[Mapping[str, NDArray[Any]], Mapping[str, Option]], Mapping[str, ArrayLike]],
) -> None:
    """Be the worker: read ``in.npz`` and ``options.json``, compute, write ``out.npz``.

    Parameters
    ----------
    compute : callable
        ``compute(arrays, options)`` returning named arrays.
    """
    source, target, options = (Path(argument) for argument in sys.argv[1:4])
    try:
        arrays = read_npz(source)
        result = compute(arrays, json.loads(options.read_text(encoding="utf-8")))
        write_npz(target, **result)
    except MemoryError:
        sys.exit(MEMORY_EXIT)


def _run(module: str, folder: Path, time_limit_s: float, memory_limit_bytes: int) -> int | None:
    """Run the process to its end or its limit; return its exit code, None if timed out."""
    command = [
        sys.executable,
        "-I",
        "-S",
        str(_LAUNCHER),
        str(os.getpid()),
        str(memory_limit_bytes),
    ]
    command += [sys.executable, "-P", "-m", module, "in.npz", "out.npz", "options.json"]
    with (folder / "log.txt").open("wb") as output:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, "TMPDIR": str(folder), "PYTHONUTF8": "1"},
        )
        try:
            return process.wait(timeout=time_limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            # Also after a normal end and on Ctrl-C: nothing the worker started may live on.
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _failure(
    module: str, folder: Path, code: int | None, time_limit_s: float, memory_limit_bytes: int
) -> GradeDesignError:
    """Say why a worker ended as it did."""
    words = _last_words(folder)
    if code is None:
        return MeshError(f"worker {module} timed out after {time_limit_s:.4g} s; {words}")
    # SIGKILL comes from the kernel's or the container's memory guard: we only kill after the end.
    if code in (MEMORY_EXIT, -signal.SIGKILL) or any(sign in words for sign in _OUT_OF_MEMORY):
        return ResourceError(
            f"worker {module} needs more memory than its limit of "
            f"{memory_limit_bytes / 2**30:.3g} GiB, or than the machine has left; "
            f"raise run.memory or ask for a coarser mesh; {words}"
        )
    if code < 0:
        return MeshError(f"worker {module} crashed with {_signal_name(-code)}; {words}")
    return MeshError(f"worker {module} failed with exit code {code}; {words}")


def _signal_name(number: int) -> str:
    """Return SIGSEGV and the like, or the number of a signal without a name."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _last_words(folder: Path) -> str:
    """Quote the last lines that the worker printed."""
    with (folder / "log.txt").open("rb") as handle:
        length = handle.seek(0, os.SEEK_END)
        handle.seek(max(0, length - _LAST_BYTES))
        text = handle.read().decode("utf-8", "replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()][-_LAST_LINES:]
    return "last output: " + " | ".join(lines) if lines else "it printed nothing"

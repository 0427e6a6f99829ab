"""Run a module in a process of its own that may crash, hang or eat memory without harm."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import psutil
from numpy.typing import ArrayLike, NDArray

from gradedesign.common.system.atomic import read_npz, write_npz, write_text
from gradedesign.common.system.limits import address_space_peak_bytes
from gradedesign.common.system.scratch import scratch_folder
from gradedesign.common.system.worker_failure import (
    LOG_NAME,
    MEMORY_EXIT,
    READY_NAME,
    Ending,
    last_words,
    runs_out_of_memory,
    worker_error,
)
from gradedesign.errors import MeshError

log = logging.getLogger(__name__)

Option: TypeAlias = float | int | str | bool

_LAUNCHER = Path(__file__).with_name("_launch_worker.py")
#: Instead of the names of files: load the libraries, print the address space they take, in bytes.
_WEIGH = "--weigh"
#: Time that loading the libraries may take, s. Chosen, not measured.
_WEIGHING_S = 60.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkerResult:
    """Arrays and wall time that a worker returned."""

    arrays: Mapping[str, NDArray[Any]]
    seconds: float  #: Wall time, with starting the process.


def run_worker(
    module: str,
    arrays: Mapping[str, ArrayLike],
    options: Mapping[str, Option],
    *,
    time_limit_s: float,
    memory_limit_bytes: int,
) -> WorkerResult:
    """Run ``python -m module in.npz out.npz options.json`` within limits.

    The process runs in a private temporary folder, in a session of its own, and never outlives this
    call: its whole process group is killed at the time limit, on any error and on Ctrl-C, and it
    goes with its folder where this process is killed. Raises `MeshError` if the worker crashes (the
    signal is named), fails, is ``timed out``, or leaves no readable result; the message ends with
    its last lines of output; `ResourceError` if it ran out of memory, or was killed from outside.

    - ``module``: dotted name; see `serve` for the other side
    - ``arrays``: arrays that the worker reads from ``in.npz``
    - ``options``: options that it reads from ``options.json``
    - ``time_limit_s``: wall time, s
    - ``memory_limit_bytes``: address space of the process, bytes. Linux holds the process to it;
      macOS and Windows have no such limit, which is logged as a warning.
    """
    if not all(part.isidentifier() for part in module.split(".")):
        raise ValueError(f"{module!r} is not the dotted name of a module")
    if not time_limit_s > 0 or memory_limit_bytes <= 0:
        raise ValueError(
            f"limits must be positive, not {time_limit_s} s and {memory_limit_bytes} bytes"
        )
    if not sys.platform.startswith("linux"):
        log.warning("this system cannot hold %s to run.memory; watch its memory", module)
    start = time.monotonic()
    with scratch_folder("worker") as folder:
        write_npz(folder / "in.npz", **arrays)
        write_text(folder / "options.json", json.dumps(dict(options), allow_nan=False))
        files = ("in.npz", "out.npz", "options.json")
        code = _run(module, files, folder, time_limit_s, memory_limit_bytes)
        seconds = time.monotonic() - start
        if code != 0:
            ending = Ending(
                module=module,
                folder=folder,
                code=code,
                time_limit_s=time_limit_s,
                memory_limit_bytes=memory_limit_bytes,
            )
            needed = None
            if runs_out_of_memory(ending) and not (folder / READY_NAME).exists():
                needed = _bytes_to_start(module, folder)
            raise worker_error(ending, needed)
        try:
            result = read_npz(folder / "out.npz")
        except (OSError, ValueError) as cause:
            raise MeshError(
                f"worker {module} ended without a readable result ({cause}); {last_words(folder)}"
            ) from cause
    return WorkerResult(arrays=result, seconds=seconds)


def serve(
    compute: Callable[[Mapping[str, NDArray[Any]], Mapping[str, Option]], Mapping[str, ArrayLike]],
    *,
    load: Callable[[], object] = dict,
) -> None:
    """Be the worker: read ``in.npz`` and ``options.json``, compute, write ``out.npz``.

    ``compute``: ``compute(arrays, options)`` returning named arrays. ``load``: imports the
    libraries that ``compute`` needs, so that running out of memory before the work begins can be
    told from running out of it at work.
    """
    if sys.argv[1:] == [_WEIGH]:
        load()
        sys.stdout.write(f"\n{address_space_peak_bytes()}\n")
        return
    source, target, options = (Path(argument) for argument in sys.argv[1:4])
    try:
        load()
        arrays = read_npz(source)
        source.with_name(READY_NAME).touch()
        result = compute(arrays, json.loads(options.read_text(encoding="utf-8")))
        write_npz(target, **result)
    except MemoryError:
        sys.exit(MEMORY_EXIT)


def _bytes_to_start(module: str, folder: Path) -> int | None:
    """Return the address space that a worker takes before it begins; None if it does not say."""
    if _run(module, (_WEIGH,), folder, _WEIGHING_S, 0, "weigh.txt") != 0:
        return None
    words = (folder / "weigh.txt").read_text(encoding="utf-8", errors="replace").split()
    return int(words[-1]) if words and words[-1].isdecimal() and int(words[-1]) > 0 else None


def _run(
    module: str,
    arguments: Sequence[str],
    folder: Path,
    time_limit_s: float,
    memory_limit_bytes: int,
    log_name: str = LOG_NAME,
) -> int | None:
    """Run the process to its end or its limit; return its exit code, None if timed out."""
    command = [sys.executable, "-P", "-m", module, *arguments]
    with (folder / log_name).open("wb") as output:
        process = start_process(
            command, folder, output, output, memory_limit_bytes=memory_limit_bytes
        )
        try:
            return process.wait(timeout=time_limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            # Also after a normal end and on Ctrl-C: nothing the worker started may live on.
            kill_all(process)
            process.wait()


def start_process(
    command: Sequence[str],
    folder: Path,
    output: BinaryIO,
    errors: BinaryIO,
    *,
    memory_limit_bytes: int = 0,
    environment: Mapping[str, str] = os.environ,
) -> subprocess.Popen[bytes]:
    """Start a process in a private folder and a session of its own; it ends with this one.

    ``kill_all`` ends it. Where this process dies, it goes with its folder.

    ``output``, ``errors``: binary file that get what it prints. ``memory_limit_bytes``: address
    space, bytes; 0 for no limit.
    """
    if sys.platform != "win32":  # which has no process groups: there it runs without a launcher
        watched = [str(_LAUNCHER), str(os.getpid()), str(memory_limit_bytes)]
        command = [sys.executable, "-I", "-S", *watched, *command]
    temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))
    return subprocess.Popen(
        command,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=errors,
        start_new_session=True,
        env={**environment, **temporary, "PYTHONUTF8": "1"},
    )


def kill_all(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and everything it started."""
    if sys.platform != "win32":
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        return
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(process.pid).children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                child.kill()
    process.kill()

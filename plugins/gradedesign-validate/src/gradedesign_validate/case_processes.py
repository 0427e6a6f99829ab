"""Cases of a suite as processes of their own, some at a time.

Each is the same command with one folder. It has its share of the processors, is ended where it
holds more than its ``[run] memory``, and its output is kept whole.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from gradedesign import report_step
from gradedesign.commands import (
    available_memory_bytes,
    kill_all,
    resident_memory_bytes,
    say,
    scratch_folder,
    start_process,
    usable_cores,
)

#: Seconds between looks at the processes. Chosen, not measured.
_POLL = 0.25
_OUTPUT, _LOG, _LINE = "output.json", "log.txt", "line.jsonl"


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseTask:
    """A case and the memory that it states, bytes."""

    folder: Path
    memory: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseEnd:
    """How a process ended.

    ``answer``: what the command printed as JSON, empty where it gave none, for the ``reason``;
    ``line`` of its history; ``log`` what else it said.
    """

    folder: Path
    answer: str
    line: str
    reason: str
    log: str
    seconds: float
    peak_bytes: int


@dataclass(slots=True, kw_only=True)
class _Running:
    """A process with its files in ``place``."""

    task: CaseTask
    place: Path
    process: subprocess.Popen[bytes]
    exits: ExitStack
    began: float = field(default_factory=time.monotonic)
    peak: int = 0

    def end(self) -> None:
        """Kill what is left of it and remove its files."""
        kill_all(self.process)
        self.process.wait()
        self.exits.close()


def in_processes(
    tasks: Sequence[CaseTask], jobs: int, *, strict_plugins: bool
) -> Iterator[CaseEnd]:
    """Run cases, at most ``jobs`` at a time, and hand on their ends as they come.

    Another one begins only where the memory that all of them state is there, or none is running.
    """
    threads = max(1, usable_cores() // jobs)
    room = available_memory_bytes()
    waiting, running = list(tasks), list[_Running]()
    try:
        while waiting or running:
            taken = sum(job.task.memory for job in running)
            fitting = [t for t in waiting if not running or taken + t.memory <= room]
            if fitting and len(running) < jobs:
                waiting.remove(fitting[0])
                running.append(_start(fitting[0], threads, strict_plugins=strict_plugins))
                continue
            names = ", ".join(job.task.folder.name for job in running)
            done = len(tasks) - len(waiting) - len(running)
            report_step(f"{done} of {len(tasks)} cases done; {names}", done / len(tasks))
            for job in list(running):
                if (end := _look_at(job)) is not None:
                    running.remove(job)
                    job.end()
                    yield end
            time.sleep(_POLL)
    finally:
        for job in running:
            job.end()


def _start(task: CaseTask, threads: int, *, strict_plugins: bool) -> _Running:
    """Start the command with one case."""
    exits = ExitStack()
    place = exits.enter_context(scratch_folder("validate"))
    command = [
        sys.executable, "-P", "-m", "gradedesign", "validate", str(task.folder.resolve()),
        "--json", "--history", str(place / _LINE),
        *(["--strict-plugins"] if strict_plugins else []),
    ]  # fmt: skip
    stated = int(os.environ.get("NUMBA_NUM_THREADS", threads))
    environment = {
        **{name: str(threads) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")},
        **os.environ,
        "NUMBA_NUM_THREADS": str(min(stated, threads)),
    }
    with (place / _OUTPUT).open("wb") as output, (place / _LOG).open("wb") as log:
        process = start_process(command, place, output, log, environment=environment)
    return _Running(task=task, place=place, process=process, exits=exits)


def _look_at(job: _Running) -> CaseEnd | None:
    """Measure a process; its end if it has ended or holds more memory than it may."""
    code = job.process.poll()
    if code is None:
        job.peak = max(job.peak, resident_memory_bytes(job.process.pid))
        if job.peak <= job.task.memory:
            return None
        reason = (
            f"held {job.peak / 1e9:.2f} GB, more than its run.memory of "
            f"{job.task.memory / 1e9:.2f} GB, and was ended"
        )
    else:
        reason = f"its process ended with code {code}"
    output, log, line = (job.place / name for name in (_OUTPUT, _LOG, _LINE))
    answered = code in (0, 1) and line.exists()
    return CaseEnd(
        folder=job.task.folder,
        answer=output.read_text(encoding="utf-8") if answered else "",
        line=line.read_text(encoding="utf-8") if answered else "",
        reason=reason,
        log=log.read_text(encoding="utf-8", errors="replace"),
        seconds=time.monotonic() - job.began,
        peak_bytes=job.peak,
    )


def say_log(end: CaseEnd) -> None:
    """Print all that a process said beside its answer, as one block."""
    if end.log.strip():
        say(f"output of {end.folder}:\n{end.log.rstrip()}", err=True)

"""A command of gradedesign as a process of its own, as typed, which ends with this one."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil
from mcp.server.mcpserver import Context

from gradedesign.commands import kill_all, scratch_folder, start_process

#: Seconds between looks at a job, and between notes of its progress. Chosen, not measured.
POLL, NOTE = 0.1, 2.0
_OUTPUT, _LOG = "output.txt", "log.txt"
#: Exit codes with an answer: done, and limits that do not hold.
_ANSWERED = (0, 4)
#: Lines of a process that ended without a message of its own. Chosen, not measured.
_LAST_LINES = 12


@dataclass(slots=True, kw_only=True, eq=False)
class Job:
    """A command that runs or has ended, with its output in a private folder.

    Attributes
    ----------
    began : float
        By the monotonic clock, s.
    stopped : bool
        Whether it was asked to end.
    """

    place: Path
    process: subprocess.Popen[bytes]
    exits: ExitStack
    began: float
    stopped: bool = False

    @property
    def code(self) -> int | None:
        """Exit code; None while it runs."""
        return self.process.poll()

    @property
    def answered(self) -> bool:
        """Whether it ended with an answer, met or not."""
        return self.code in _ANSWERED

    @property
    def output(self) -> str:
        """Lines that it has printed so far."""
        return _text(self.place / _OUTPUT)

    @property
    def last_words(self) -> str:
        """Its message, where it failed; else its last lines."""
        lines = [line for line in _text(self.place / _LOG).splitlines() if line.strip()]
        starts = [n for n, line in enumerate(lines) if line.startswith("error: ")]
        if starts:
            return "\n".join(lines[starts[-1] :]).removeprefix("error: ")
        return "\n".join(lines[-_LAST_LINES:]) or f"its process ended with code {self.code}"

    @property
    def last_line(self) -> str:
        """Last line about its progress."""
        return _text(self.place / _LOG).rstrip().rpartition("\n")[2]

    def end(self, *, grace_s: float) -> None:
        """Ask it to end, end it after a while with everything it started, and keep its output.

        ``grace_s``: s, in which it can release its run folder.
        """
        if self.code is None:
            self.stopped = True
            # Where there is a launcher, that one passes nothing on.
            with suppress(psutil.NoSuchProcess):
                started = psutil.Process(self.process.pid)
                for one in started.children() or [started]:
                    with suppress(psutil.NoSuchProcess):
                        one.terminate()
            end = time.monotonic() + grace_s
            while self.code is None and time.monotonic() < end:
                time.sleep(POLL)
        kill_all(self.process)
        self.process.wait()

    def close(self) -> None:
        """End it at once, and remove its output."""
        kill_all(self.process)
        self.process.wait()
        self.exits.close()


def start(words: Sequence[str]) -> Job:
    """Start ``gradedesign WORDS``; no code is loaded from the folder that it works on."""
    exits = ExitStack()
    place = exits.enter_context(scratch_folder("mcp"))
    command = [sys.executable, "-P", "-m", "gradedesign", *words]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with (place / _OUTPUT).open("wb") as output, (place / _LOG).open("wb") as log:
        process = start_process(command, place, output, log, environment=environment)
    return Job(place=place, process=process, exits=exits, began=time.monotonic())


async def report(ctx: Context, job: Job, words: str) -> None:
    """Tell the client that a call goes on, and with what."""
    await ctx.report_progress(time.monotonic() - job.began, message=words.strip() or None)


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")

"""Tools on runs: start one in the background, follow it, end it, read its verdict."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import anyio
from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from pydantic import Field

from gradedesign.commands import RESULT_NAME
from gradedesign_mcp.bounds import Bounds, name_of
from gradedesign_mcp.job import NOTE, POLL, Job, report, start

#: Seconds in which a run that is refused at once says so. Chosen, not measured.
_REFUSED_S = 4.0
#: Seconds that `follow_run` waits at most, below the time that clients allow a call. Chosen, not
#: measured.
_LONGEST_WAIT_S = 50.0
#: Lines of a run that one call tells. Chosen, not measured.
_MOST_LINES = 200
#: Seconds in which a run can release its folder: one that is stopped, and one that ends with the
#: server, which clients kill after two. Chosen, not measured.
_GRACE_S, _LAST_GRACE_S = 10.0, 1.0

_Case = Annotated[
    str, Field(description="case.toml or its folder, relative to the server's folder.")
]
_Run = Annotated[str, Field(description="Run folder, as start_run names it.")]


@dataclass(slots=True, kw_only=True, eq=False)
class Runs:
    """Tools on runs, and the runs that they have started.

    Attributes
    ----------
    most : int
        At a time.
    jobs : dict of Path to Job
        By run folder.
    """

    bounds: Bounds
    most: int
    jobs: dict[Path, Job] = field(default_factory=dict)

    async def start_run(
        self,
        case: _Case,
        run: Annotated[
            str | None, Field(description="Run folder [runs/NAME, by the folder of the case].")
        ] = None,
        resume: Annotated[bool, Field(description="Go on with an interrupted run.")] = False,
        overwrite: Annotated[bool, Field(description="Replace earlier results.")] = False,
    ) -> dict[str, Any]:
        """Start a run in the background: minutes to hours on all processors.

        Follow it with `follow_run`, end it with `stop_run`; it ends with this server. The same as
        `gradedesign run CASE -o RUN`.
        """
        path = self.bounds.case(case)
        folder = self.bounds.inside(f"runs/{name_of(path)}" if run is None else run, "run")
        if folder in self.jobs and self.jobs[folder].code is None:
            raise ToolError(f"run: {self._name(folder)} is running; follow_run tells how it stands")
        going = [self._name(one) for one, job in self.jobs.items() if job.code is None]
        if len(going) >= self.most:
            raise ToolError(
                f"{' and '.join(going)} is running, and {self.most} may run at a time "
                f"(gradedesign mcp --runs); wait for it, or end it with stop_run"
            )
        if (earlier := self.jobs.pop(folder, None)) is not None:
            earlier.close()
        options = (("--resume", resume), ("--overwrite", overwrite))
        words = ["run", str(path), f"--output={folder}", *(one for one, asked in options if asked)]
        job = self.jobs[folder] = start(words)
        while job.code is None and not job.output and time.monotonic() - job.began < _REFUSED_S:
            await anyio.sleep(POLL)
        if job.code is not None and not job.answered:
            raise ToolError(self.bounds.told(job.last_words))
        return self._state(folder, after=0)

    async def follow_run(
        self,
        ctx: Context,
        run: _Run,
        after: Annotated[
            int, Field(ge=0, description="Lines that are known: `next` of the last call.")
        ] = 0,
        wait_s: Annotated[
            float, Field(ge=0, le=_LONGEST_WAIT_S, description="Wait so long for its end.")
        ] = 20.0,
    ) -> dict[str, Any]:
        """Tell what a run has printed since, and whether it has ended.

        One line for each stage and iteration: mass, use of each limit, difference of prediction and
        analysis. `state` is running, ended, stopped or failed; read a verdict with `read_verdict`.
        """
        folder = self.bounds.inside(run, "run")
        job = self._job(folder, run)
        end, note = time.monotonic() + wait_s, time.monotonic() + NOTE
        while job.code is None and time.monotonic() < end:
            await anyio.sleep(POLL)
            if time.monotonic() >= note:
                note += NOTE
                await report(ctx, job, job.output.rstrip().rpartition("\n")[2])
        return self._state(folder, after=after)

    async def stop_run(self, run: _Run) -> dict[str, Any]:
        """End a run that goes on; `start_run` with `resume` goes on where it was."""
        folder = self.bounds.inside(run, "run")
        job = self._job(folder, run)
        if job.code is not None:
            raise ToolError(f"run: {run!r} has ended already; read_verdict tells what it found")
        await anyio.to_thread.run_sync(lambda: job.end(grace_s=_GRACE_S))
        return {**self._state(folder, after=0), "resumable": "start_run with resume"}

    def read_verdict(
        self,
        run: _Run,
        iterations: Annotated[bool, Field(description="With what each iteration found.")] = False,
    ) -> dict[str, Any]:
        """The verdict of a run (its result.json).

        `status` is met, not_met, infeasible, partial or failed; `limits` has each limit with value,
        band and what judged it, `files` what was written. Masses are in g.
        """
        folder = self.bounds.inside(run, "run")
        file = self.bounds.inside(f"{run}/{RESULT_NAME}", "run")
        job = self.jobs.get(folder)
        if job is not None and job.code is None:
            raise ToolError(f"run: {run!r} goes on; follow_run tells when it has ended")
        try:
            result = json.loads(file.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise ToolError(
                f"run: {run!r} holds no {RESULT_NAME}; start_run makes one, with resume where the "
                f"run was interrupted"
            ) from None
        except (OSError, ValueError) as error:
            raise ToolError(f"run: its {RESULT_NAME} cannot be read ({error})") from None
        if not iterations:
            result.pop("iterations", None)
        return dict(self.bounds.told(result))

    def close(self) -> None:
        """End everything that was started."""
        for job in self.jobs.values():
            job.end(grace_s=_LAST_GRACE_S)
            job.close()

    def _job(self, folder: Path, run: str) -> Job:
        if folder not in self.jobs:
            known = ", ".join(self._name(one) for one in self.jobs) or "none"
            raise ToolError(
                f"run: {run!r} was not started by this server (started were: {known}); "
                f"read_verdict tells what a finished run found"
            )
        return self.jobs[folder]

    def _name(self, folder: Path) -> str:
        return folder.relative_to(self.bounds.root).as_posix()

    def _state(self, folder: Path, *, after: int) -> dict[str, Any]:
        """Lines that a run has printed, and how it stands."""
        job = self.jobs[folder]
        code = job.code
        # The last line may be half written.
        whole = job.output if code is not None else job.output.rpartition("\n")[0]
        lines = [self.bounds.told(line) for line in whole.splitlines()]
        end = min(len(lines), after + _MOST_LINES)
        told = {
            "run": self._name(folder),
            "state": _state(job),
            "seconds": round(time.monotonic() - job.began, 1),
            "lines": lines[after:end],
            "next": end,
        }
        failed = told["state"] == "failed"
        return {**told, "error": self.bounds.told(job.last_words)} if failed else told


def _state(job: Job) -> str:
    """How a run stands."""
    if job.code is None:
        return "running"
    return "ended" if job.answered else "stopped" if job.stopped else "failed"

"""Progress on the terminal: a line for each event, and regular lines during long steps.

A thread of its own looks at the steps that the computation reports. Without a terminal it prints
a line after `SILENCE` seconds without one; with a terminal it keeps one live line up to date. It
gets its turn whenever Python runs, or a kernel or library that releases the interpreter's lock.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from gradedesign.common.system.compiling import compiling
from gradedesign.common.system.limits import resident_memory_bytes
from gradedesign.common.system.progress import Event, Step, Watch, watching
from gradedesign.program.commands.layout import say, width_now, wrapped

#: Seconds without a line after which one is printed, where there is no terminal. Below the 10 s of
#: silence that `benchmarks/bench_silence.py` allows.
SILENCE = 7.0
#: Seconds to the first of these lines: Python took some to start, in silence. Chosen, not measured.
FIRST = 3.0
#: Seconds without a line after which one is printed before a step that lets no thread run. Chosen,
#: not measured.
BLOCKED = 2.0
#: Seconds between looks at the steps. Chosen, not measured.
POLL, LIVE_POLL = 0.5, 0.5
#: Sizing reports every iteration; only each n-th is worth a line. Chosen, not measured.
_SIZING_EVERY = 10
#: Share and seconds of a step from which on the time left is shown. Chosen, not measured.
LEAST_SHARE, _LEAST_SECONDS = 0.05, 2.0
#: Columns of the stage's name. The longest, ``acceptance``, takes ten.
_STAGE = 12


class ProgressLines:
    """A listener that prints a line per stage and iteration, and while a step takes long.

    Use it as a context manager around the computation, or as a mere listener, which shows no steps.

    Parameters
    ----------
    stage : str
        Where the computation begins.
    budget_s : float, optional
        Time that the computation may take, s.
    err : bool
        Write to standard error: standard output holds the answer.
    events : bool
        Print events; False shows only that the computation lives.
    memory : callable
        Resident memory, bytes.
    """

    def __init__(
        self,
        stage: str = "start",
        *,
        budget_s: float | None = None,
        err: bool = False,
        events: bool = True,
        memory: Callable[[], int] = resident_memory_bytes,
    ) -> None:
        self._stages = [stage]
        self._budget, self._err, self._events, self._memory = budget_s, err, events, memory
        self._sizing = 0
        self._watch = Watch(before_blocking=self._speak_before)
        self._began = self._spoke = self._entered = time.monotonic()
        self._patience = min(FIRST, SILENCE)
        self._stop, self._lock = threading.Event(), threading.Lock()
        self._thread: threading.Thread | None = None
        self._exits = ExitStack()
        self._live: Live | None = None

    def __enter__(self) -> Self:
        self._exits.enter_context(watching(self._watch))
        console = Console(stderr=self._err)
        if console.is_terminal and not console.is_dumb_terminal:
            self._live = Live(
                console=console,
                transient=True,
                auto_refresh=False,
                # An answer that goes to a file stays out of the terminal.
                redirect_stdout=sys.stdout.isatty(),
                redirect_stderr=sys.stderr.isatty(),
            )
            self._exits.enter_context(self._live)
        self._began = self._spoke = time.monotonic()
        self._thread = threading.Thread(target=self._beat, name="progress", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._exits.close()

    def __call__(self, event: Event) -> None:
        """Take note of an event, and print it unless it is one of many or a mere start."""
        if event.message == "started":
            self._sizing = 0
            self._enter(event.stage)
            return
        if event.message == "done" and event.seconds is not None:
            self._leave(event.stage)
        if event.stage == "sizing" and event.seconds is None:
            self._sizing += 1
            if self._sizing % _SIZING_EVERY != 1:
                return
        if self._events:
            took = "" if event.seconds is None else f" ({event.seconds:.1f} s)"
            self._print(event.stage, f"{event.message}{took}")

    def status(self) -> Event:
        """Present step of the computation, as an event of the current stage."""
        now = time.monotonic()
        steps = self._watch.steps()
        if (compilation := compiling()) is not None:
            steps = (*steps, compilation)
        with self._lock:
            stage, entered = self._stages[-1], self._entered
        memory = self._memory()
        inner = steps[-1] if steps else Step(text="working", fraction=None, began=entered)
        values = {
            "step_s": now - inner.began,
            "elapsed_s": now - self._began,
            "memory_GB": memory / 1e9,
        }
        if self._budget is not None:
            values["budget_s"] = self._budget
        return Event(
            stage=stage,
            message=status_text(steps or (inner,), values),
            values=values,
            fraction=inner.fraction,
        )

    def _enter(self, stage: str) -> None:
        with self._lock:
            self._watch.report("")
            self._stages.append(stage)
            self._entered = time.monotonic()

    def _leave(self, stage: str) -> None:
        with self._lock:
            self._watch.report("")
            if self._stages[-1] == stage and len(self._stages) > 1:
                self._stages.pop()
            self._entered = time.monotonic()

    def _speak_before(self) -> None:
        """Print progress before a step during which no other thread can run."""
        if self._live is None and time.monotonic() - self._spoke >= BLOCKED:
            event = self.status()
            self._print(event.stage, event.message)

    def _print(self, stage: str, message: str) -> None:
        """Print an event, wrapped to the width."""
        with self._lock:
            lines = wrapped(f"{stage:<{_STAGE - 1}} {message}", hang=_STAGE)
            say("\n".join(lines), err=self._err)
            self._spoke = time.monotonic()
            self._patience = SILENCE

    def _beat(self) -> None:
        """Give a sign of life until the computation ends."""
        live = self._live
        while not self._stop.wait(POLL if live is None else LIVE_POLL):
            compiling()  # listens from the first look on
            if live is not None:
                event = self.status()
                text = f"{event.stage:<{_STAGE - 1}} {event.message}"
                lines = wrapped(text, width=width_now() - 1, hang=_STAGE)
                live.update(Text("\n".join(lines), style="dim"), refresh=True)
            elif time.monotonic() - self._spoke >= self._patience:
                event = self.status()
                self._print(event.stage, event.message)


def status_text(steps: Sequence[Step], values: dict[str, float]) -> str:
    """One line: the steps, the share and seconds of the innermost, time of the budget, memory.

    What is left of the innermost step is shown where enough is done to say.

    Examples
    --------
    >>> step = Step(text="multigrid, load case 'pull'", fraction=0.43, began=0.0)
    >>> status_text([step], {"step_s": 12, "elapsed_s": 220, "budget_s": 1200, "memory_GB": 1.24})
    "multigrid, load case 'pull', 43 %, 12 s, 16 s left; 3:40 of 20:00; 1.2 GB"
    """
    share = steps[-1].fraction
    done = "" if share is None else f", {100 * min(max(share, 0.0), 1.0):.0f} %"
    remaining = ""
    if share is not None and LEAST_SHARE <= share <= 1.0 and values["step_s"] >= _LEAST_SECONDS:
        remaining = f", {values['step_s'] * (1.0 - share) / share:.0f} s left"
    budget = f" of {clock(values['budget_s'])}" if "budget_s" in values else " in all"
    return (
        f"{': '.join(step.text for step in steps)}{done}, {values['step_s']:.0f} s{remaining}; "
        f"{clock(values['elapsed_s'])}{budget}; {values['memory_GB']:.1f} GB"
    )


def clock(seconds: float) -> str:
    """Minutes and seconds, with hours where there are any.

    Examples
    --------
    >>> clock(75), clock(3600)
    ('1:15', '1:00:00')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"

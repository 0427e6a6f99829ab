"""Processor time that the first run on a machine spends in compiling kernels, kernel by kernel.

Run ``python benchmarks/bench_first_run.py [FOLDER_OF_A_CASE [ROWS]]``. The case runs in this process
with numba's cache in an empty folder, and numba's own events say what is compiled. A kernel that
another calls is compiled within its caller: its seconds are counted once, as its own. Processor
time, since others on the machine change wall times.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

MINI = Path(__file__).parents[1] / "cases" / "mini"
#: Kernels that are printed: those below take less than 0.5 s each.
ROWS = 60


@dataclass(slots=True)
class Compilations:
    """Listener to numba: seconds and signatures of each function that it compiled."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    signatures: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    #: Thread, function, its processor time at the beginning, and that of functions within.
    open: dict[int, list[list[float]]] = field(default_factory=lambda: defaultdict(list))

    def notify(self, event: Any) -> None:
        """Open or close a compilation; each thread has its own."""
        stack, now = self.open[threading.get_ident()], time.thread_time()
        if event.is_start:
            stack.append([now, 0.0])
            return
        if not stack:
            return
        began, within = stack.pop()
        took = now - began
        if stack:
            stack[-1][1] += took
        function = event.data["dispatcher"].py_func
        name = f"{function.__module__.removeprefix('gradedesign.')}.{function.__qualname__}"
        self.seconds[name] += took - within
        self.signatures[name].append(", ".join(map(str, event.data["args"])))


def main() -> None:
    """Run a case and print the table."""
    case, rows = (Path(sys.argv[1]) if sys.argv[1:] else MINI), int((*sys.argv[2:], ROWS)[0])
    with tempfile.TemporaryDirectory() as scratch:
        os.environ["NUMBA_CACHE_DIR"] = f"{scratch}/numba"
        os.environ["XDG_CACHE_HOME"] = f"{scratch}/cache"
        from numba.core import event

        from gradedesign.program.commands import main as gradedesign  # the environment first

        compilations = Compilations()
        event.Listener.register(Compilations)
        event.register("numba:compile", compilations)
        began, wall = time.process_time(), time.perf_counter()
        try:
            gradedesign(["run", str(case), "-o", f"{scratch}/run"])
        except SystemExit as ended:
            print(f"exit code {ended.code}")
        used, wall = time.process_time() - began, time.perf_counter() - wall
    of_numba = sum(s for name, s in compilations.seconds.items() if name.startswith("numba"))
    count = sum(map(len, compilations.signatures.values()))
    print(
        f"{used:.0f} s of the processor in {wall:.0f} s, {sum(compilations.seconds.values()):.0f} s "
        f"of it compiling {len(compilations.seconds)} functions for {count} signatures, "
        f"{of_numba:.0f} s of that numba's own"
    )
    print("function, signatures, processor seconds")
    for name, seconds in sorted(compilations.seconds.items(), key=lambda row: -row[1])[:rows]:
        print(f"{name}, {len(compilations.signatures[name])}, {seconds:.1f}")
        if os.environ.get("SIGNATURES"):
            for signature in compilations.signatures[name]:
                print("   ", signature)


if __name__ == "__main__":
    main()

"""Processor time that the first run on a machine spends in compiling kernels, kernel by kernel.

Run ``python benchmarks/bench_first_run.py [FOLDER_OF_A_CASE [ROWS [beside]]]``. The case runs here,
numba's cache in an empty folder, and numba's own events say what is compiled. A kernel that
another calls is compiled within its caller: its seconds are counted once, as its own; what numba
brings itself, such as that which assigns arrays, counts for the kernel that needs it first.
Processor time, since others on the machine change wall times. With ``beside`` the process that
compiles ahead may run, whose kernels then are in no table.
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
class Row:
    """One kernel: processor seconds, those of numba's own functions within, and signatures."""

    seconds: float = 0.0
    of_numba: float = 0.0
    signatures: list[str] = field(default_factory=list)


@dataclass(slots=True)
class Compilations:
    """Listener to numba: what it compiles, by kernel."""

    rows: dict[str, Row] = field(default_factory=lambda: defaultdict(Row))
    numba_functions: int = 0
    #: Of each thread: processor time at the beginning, and that of functions within.
    open: dict[int, list[tuple[str, float, float]]] = field(
        default_factory=lambda: defaultdict(list)
    )

    def notify(self, event: Any) -> None:
        """Open or close a compilation; each thread has its own."""
        stack, now = self.open[threading.get_ident()], time.thread_time()
        if event.is_start:
            function = event.data["dispatcher"].py_func
            name = f"{function.__module__.removeprefix('gradedesign.')}.{function.__qualname__}"
            stack.append((name, now, 0.0))
            return
        if not stack:
            return
        name, began, within = stack.pop()
        took = now - began
        if stack:
            outer, outer_began, outer_within = stack[-1]
            stack[-1] = (outer, outer_began, outer_within + took)
        if not name.startswith("numba."):
            row = self.rows[name]
            row.seconds += took - within
            row.signatures.append(", ".join(map(str, event.data["args"])))
            return
        self.numba_functions += 1
        caller = next((n for n, _, _ in reversed(stack) if not n.startswith("numba.")), "none")
        self.rows[caller].of_numba += took - within


def main() -> None:
    """Run a case and print the table."""
    case, count = (Path(sys.argv[1]) if sys.argv[1:] else MINI), int((*sys.argv[2:], ROWS)[0])
    with tempfile.TemporaryDirectory() as scratch:
        os.environ["NUMBA_CACHE_DIR"] = f"{scratch}/numba"
        os.environ["XDG_CACHE_HOME"] = f"{scratch}/cache"
        # The environment first.
        from numba.core import event

        from gradedesign.program.commands import compiled_ahead
        from gradedesign.program.commands import main as gradedesign

        if "beside" not in sys.argv:
            compiled_ahead.usable_cores = lambda: 1
        compilations = Compilations()
        event.Listener.register(Compilations)
        event.register("numba:compile", compilations)
        began, wall = time.process_time(), time.perf_counter()
        try:
            gradedesign(["run", str(case), "-o", f"{scratch}/run"])
        except SystemExit as ended:
            print(f"exit code {ended.code}")
        used, wall = time.process_time() - began, time.perf_counter() - wall
    rows = compilations.rows
    of_numba = sum(row.of_numba for row in rows.values())
    all_of_it = of_numba + sum(row.seconds for row in rows.values())
    signatures = sum(len(row.signatures) for row in rows.values())
    print(
        f"{used:.0f} s of the processor in {wall:.0f} s, {all_of_it:.0f} s of it compiling: "
        f"{len(rows)} kernels for {signatures} signatures, "
        f"{of_numba:.0f} s of that {compilations.numba_functions} functions of numba's own"
    )
    print("kernel, signatures, processor seconds, numba's own seconds within")
    for name, row in sorted(rows.items(), key=lambda r: -r[1].seconds - r[1].of_numba)[:count]:
        print(f"{name}, {len(row.signatures)}, {row.seconds:.1f}, {row.of_numba:.1f}")
        if os.environ.get("SIGNATURES"):
            for signature in row.signatures:
                print("   ", signature)


if __name__ == "__main__":
    main()

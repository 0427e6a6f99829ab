"""Two runs of ``cases/mini`` side by side over one alone, with libtbb present and absent.

Run ``python benchmarks/bench_side_by_side.py [FOLDER_OF_LIBTBB [LAYER]]``; a layer that is named
is forced on every run, as a user's setting is. Each turn runs one alone and then two, so that a
ratio compares neighbours in time; medians of the turns. Processor time shows threads that spin.
Others on the machine change wall times, so the cores that they keep busy stand beside (Linux).
At most 1.3 times the wall time is wanted on two idle cores; one run alone keeps 1.4 of them busy,
so that twice its processor time takes 1.4 times its wall time at best.

Three turns on two idle cores, kernels in the cache: libtbb absent, 16.1 to 17.2 s alone, 1.40 times
for two (1.36, 1.40, 1.49) at 1.00 times the processor time a run (0.96, 1.00, 1.06); present, 16.4
to 17.1 s alone, 1.43 times (1.43, 1.51, 1.42) at 1.01 times (1.01, 1.07, 1.01). Two runs take 45.6
to 48.6 s of processor time in 23.4 to 25.0 s: all of both cores.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MINI = Path(__file__).parents[1] / "cases" / "mini"
TURNS = 3
#: What would decide the threads before gradedesign does.
SETTINGS = (
    "NUMBA_THREADING_LAYER", "NUMBA_THREADING_LAYER_PRIORITY", "NUMBA_NUM_THREADS",
    "OMP_WAIT_POLICY", "OMP_NUM_THREADS",
)  # fmt: skip
LAYER = (
    "import gradedesign; from gradedesign.common.system.processor import threading_layer as layer; "
    "print(layer())"
)
LOADS = "import numba.np.ufunc.tbbpool"


def environment(library: str, layer: str) -> dict[str, str]:
    """The environment of a run: nothing said of threads, libtbb where it is given."""
    kept = {k: v for k, v in os.environ.items() if k not in SETTINGS}
    if library:
        kept["LD_LIBRARY_PATH"] = library
    if layer:
        kept["NUMBA_THREADING_LAYER"] = layer
    return kept


def together(count: int, kept: dict[str, str]) -> tuple[float, float, float]:
    """Seconds until all of some runs have ended, their processor seconds, others' busy cores."""
    with tempfile.TemporaryDirectory() as scratch:
        used, busy, begin = processor_seconds(), busy_seconds(), time.perf_counter()
        runs = [
            subprocess.Popen(
                [sys.executable, "-m", "gradedesign", "run", str(MINI), "-o", f"{scratch}/{k}"],
                env=kept, stdout=subprocess.DEVNULL,
            )
            for k in range(count)
        ]  # fmt: skip
        codes = [run.wait() for run in runs]
        wall = time.perf_counter() - begin
        used, busy = processor_seconds() - used, busy_seconds() - busy
    if any(codes):
        raise SystemExit(f"runs ended with exit codes {codes}, expected 0")
    return wall, used, (busy - used) / wall


def processor_seconds() -> float:
    """Of all runs that have ended, their workers included."""
    own = resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime


def busy_seconds() -> float:
    """Of all processes on the machine: user, nice and system time."""
    ticks = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()[1:4]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def said(code: str, kept: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """A line of Python in the environment of a run."""
    return subprocess.run(
        [sys.executable, "-c", code], env=kept, capture_output=True, text=True, check=False
    )


def main() -> None:
    """Print a line for each turn, then the medians."""
    library, layer = (*sys.argv[1:], "", "")[:2]
    settings = {"absent": environment("", layer)}
    if library:
        settings["present"] = environment(library, layer)
    for name, kept in settings.items():
        loads = "loads" if said(LOADS, kept).returncode == 0 else "does not load"
        print(f"libtbb {name}: {loads}; layer {said(LAYER, kept).stdout.strip()}")
    print("libtbb, alone s, two s, ratio, alone CPU s, two CPU s, ratio, others' cores")
    ratios: dict[str, list[tuple[float, float]]] = {name: [] for name in settings}
    for _ in range(TURNS):
        for name, kept in settings.items():
            alone, two = together(1, kept), together(2, kept)
            ratios[name].append((two[0] / alone[0], two[1] / (2.0 * alone[1])))
            print(
                f"{name}, {alone[0]:.1f}, {two[0]:.1f}, {ratios[name][-1][0]:.2f}, "
                f"{alone[1]:.1f}, {two[1]:.1f}, {ratios[name][-1][1]:.2f}, "
                f"{alone[2]:.2f} and {two[2]:.2f}",
                flush=True,
            )
    for name, own in ratios.items():
        wall, used = (statistics.median(column) for column in zip(*own, strict=True))
        print(f"libtbb {name}: {wall:.2f} times the wall time, {used:.2f} the processor time a run")


if __name__ == "__main__":
    main()

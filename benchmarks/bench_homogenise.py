"""Periodic homogenisation of the gyroid sheet at density 0.3: six load cases, wall time, memory.

    python benchmarks/bench_homogenise.py [--peer FOLDER] [N ...]

Each size runs in a process of its own, so that its peak memory is its own. All six cases are
solved: what the symmetry of the grid saves is shown apart. FOLDER holds a module `homo` with
`homog_fe(fill, rtol=...)` to time beside it. Limits: 64 in 3 s; 128 in 25 s and 1.3 GB, on two
cores that do nothing else.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

LIMITS = {64: (3.0, None), 128: (25.0, 1.3)}


def gyroid_sheet(count: int, rho: float = 0.3) -> np.ndarray:
    """Solid or void by the centre of each voxel."""
    c = (np.arange(count) + 0.5) / count * 2 * np.pi
    z, y, x = np.meshgrid(c, c, c, indexing="ij")
    g = np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))
    # Samples that are equal by symmetry go together, as in the sampling of cells.
    g = np.round(g, 12)
    rank = int(rho * count**3) - 1
    return (g <= np.partition(g, rank, axis=None)[rank]).astype(float)


def measure(count: int, peer: str | None) -> None:
    """Time one size in this process and print a line."""
    small, fill = gyroid_sheet(48), gyroid_sheet(count)
    if peer:
        sys.path.insert(0, peer)
        from homo import homog_fe

        homog_fe(small, rtol=1e-2)
        start, cpu = time.perf_counter(), time.process_time()
        c = homog_fe(fill, rtol=1e-6)[0]
        report("peer", count, c, start, cpu)
        return
    from gradedesign.mechanics.homogenise.periodic import solve_periodic

    solve_periodic(small, rtol=1e-2)
    for name, symmetry in (("six cases", False), ("by symmetry", True)):
        start, cpu = time.perf_counter(), time.process_time()
        c = solve_periodic(fill, rtol=1e-6, use_symmetry=symmetry).stiffness
        report(name, count, c, start, cpu)


def report(name: str, count: int, c: np.ndarray, start: float, cpu: float) -> None:
    """Print one line."""
    wall, cpu = time.perf_counter() - start, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    limit, memory = LIMITS.get(count, (None, None))
    within = (
        "" if limit is None else f"  limit {limit:g} s" + (f", {memory:g} GB" if memory else "")
    )
    print(
        f"{name:12s} N = {count:4d}  wall {wall:7.2f} s  cpu {cpu:7.2f} s  peak {peak:5.2f} GB  "
        f"C11 {c[0, 0]:.6f} C12 {c[0, 1]:.6f} C44 {c[3, 3]:.6f}{within}",
        flush=True,
    )


def main() -> None:
    """Run every size in its own process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=int, default=[64, 128])
    parser.add_argument("--peer", help="folder with the module homo")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        measure(options.sizes[0], options.peer)
        return
    for count in options.sizes:
        for peer in (None, *([options.peer] if options.peer else [])):
            command = [sys.executable, str(Path(__file__)), "--inside", str(count)]
            subprocess.run(command + (["--peer", peer] if peer else []), check=True)


if __name__ == "__main__":
    main()

"""Field of a family on a cube of samples in bricks: time, and peak memory of at most 2 GB.

    python benchmarks/bench_bricks.py [--samples 512] [FAMILY ...]

Four cells along each axis, default parameters, in single precision as surfaces are extracted;
tables that a shape builds first are counted. Each family runs in a process of its own. Memory
hardly depends on the samples, since a brick is dropped when it is done: ``--samples 128`` tells it
in seconds. Without names those of the heaviest tables run.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

HEAVIEST = (
    "gyroid-sheet", "gyroid-wall", "octet-convolution", "bcc-straight-to-helix", "kelvin-voxel",
    "spinodoid-isotropic-sheet", "voronoi-closed", "sphere-pores-noise",
)  # fmt: skip
CELLS, LIMIT = 4.0, 2.0


def measure(name: str, samples: int) -> None:
    """Sample one family in this process and print a line."""
    from gradedesign.geometry.contour.sample import sample_slabs
    from gradedesign.program.host.registry import build_registry

    family = build_registry().cell_families[name]

    def field(points: np.ndarray) -> np.ndarray:
        return family.shape(points.astype(np.float32), **family.parameters)

    wall, cpu, least = time.perf_counter(), time.process_time(), np.inf
    for piece in sample_slabs(field, (0, 0, 0), (samples,) * 3, CELLS / (samples - 1)):
        least = min(least, float(piece.values.min()))
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"{name:28s} {samples}^3  wall {wall:7.2f} s  cpu {cpu:7.2f} s  peak {peak:5.2f} GB "
        f"({'within' if peak <= LIMIT else 'ABOVE'} {LIMIT:g} GB)  least value {least:.3g}",
        flush=True,
    )


def main() -> None:
    """Run every family in its own process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("families", nargs="*", default=HEAVIEST)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        measure(options.families[0], options.samples)
        return
    for name in options.families:
        command = [sys.executable, str(Path(__file__)), "--inside", name]
        subprocess.run([*command, "--samples", str(options.samples)], check=True)


if __name__ == "__main__":
    main()

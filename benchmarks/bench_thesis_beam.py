"""The constant beams of Ramirez Salazar (2022), Table 4.5, by finite cells beside his shells.

``python benchmarks/bench_thesis_beam.py [bricks a cell ...]``, 2.667 and 4 by default. His beam of
1500 x 300 x 200 mm, 720 cells of 50 mm, holds walls of constant thickness about middle surfaces:
gyroid 5.28 mm (density 0.326) and primitive 7.11 mm (0.331). It is clamped at x = 0 and carries
5 kN along z on its other end. He reports the largest displacement of shell elements: 1.38 and
2.12 mm. Each analysis runs in a process of its own; memory is its peak.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))

SIZE, BOX = 50.0, (1500.0, 300.0, 200.0)
#: Cell, thickness in mm, and displacement by his shells in mm.
BEAMS = (("gyroid-wall", 5.28, 1.38), ("primitive-wall", 7.11, 2.12))
ORDERS = (0.75, 1.5, 3.0)


def one(name, thickness, bricks):
    """Solve one beam at a resolution and print what it does."""
    from finite_cell_solids import analyse, box_face, load_case, newtons, problem

    from gradedesign.program.host.registry import build_registry

    shape = build_registry().cell_families[name].shape
    level = thickness / (2.0 * SIZE)

    def field(points):
        return SIZE * (shape(points / SIZE) - level)

    low = (0.0, 0.0, 0.0)
    regions = {side: box_face(side, low, BOX, 0, k) for k, side in enumerate(("root", "tip"))}
    load = load_case("tip load", [("root", "xyz")], [("tip", {"force": newtons(0, 0, -5000)})])
    began = time.perf_counter()
    result = analyse(problem(field, low, BOX, [load], regions), SIZE / bricks)
    tip = result.region_displacement("tip", "tip load")
    print(
        json.dumps(
            {
                "spacing": result.spacing,
                "unknowns": result.unknowns,
                "density": round(result.volume / float(np.prod(BOX)), 4),
                "tip, mean": float(-result.mean_displacement("tip", "tip load")[2]),
                "tip, largest": float(np.linalg.norm(tip, axis=0).max()),
                "largest": result.largest_displacement("tip load"),
                "seconds": round(time.perf_counter() - began),
                "peak GB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2),
            }
        )
    )


def main(resolutions):
    """Solve both beams at all resolutions and compare the last two with the shells."""
    from gradedesign.mechanics.limits.banded import banded

    for name, thickness, shells in BEAMS:
        rows = []
        for bricks in resolutions:
            command = [sys.executable, __file__, "one", name, str(thickness), bricks]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            rows.append(json.loads(done.stdout.splitlines()[-1]))
            print(f"{name}, {bricks} bricks a cell: {rows[-1]}", flush=True)
        for measure in ("tip, mean", "largest") if len(rows) > 1 else ():
            band = banded([(row["spacing"], row[measure]) for row in rows], ORDERS)
            print(
                f"{name}, {measure}: {band.value:.3f} ({band.low:.3f} to {band.high:.3f}) mm, "
                f"{band.value / shells:.3f} of the shells' {shells:g} mm",
                flush=True,
            )


if __name__ == "__main__":
    if sys.argv[1:2] == ["one"]:
        one(sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
    else:
        main(sys.argv[1:] or ["2.667", "4"])

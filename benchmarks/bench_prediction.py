"""Predicted against real seconds of a first iteration, of acceptances and of a whole run.

Run ``python benchmarks/bench_prediction.py [CASE ...]`` on an otherwise idle machine;
``cases/mini`` by default. Every case is run to its end in a folder of its own. Within a
factor of two is wanted.
What was measured: ``bench_prediction.md``.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
HEAD = (
    "case, first predicted s, first s, ratio, unknowns predicted M, M, an acceptance predicted s, "
    "all acceptances s, whole run predicted s, s"
)


def compared(case: str, folder: Path) -> str:
    """One line of the table: a run of the case, by the command that a user types."""
    command = [sys.executable, "-m", "gradedesign", "run", case, "-o", str(folder)]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    predicted, first = result["predicted"]["at_start"], result["iterations"][0]
    real, total = first["seconds"], sum(result["timing_s"].values())
    return (
        f"{result['case_name']}, {predicted['iteration_s']:.0f}, {real:.0f}, "
        f"{predicted['iteration_s'] / real:.2f}, {predicted['explicit_dofs'] / 1e6:.2f}, "
        f"{first['dofs'] / 1e6:.2f}, {predicted['whole_s'] + predicted['acceptance_s']:.0f}, "
        f"{result['timing_s'].get('acceptance', 0.0):.0f}, {predicted['run_s']:.0f}, {total:.0f}"
    )


def main() -> None:
    """Print the table."""
    print(HEAD)
    with tempfile.TemporaryDirectory() as scratch:
        for number, case in enumerate(sys.argv[1:] or [str(ROOT / "cases" / "mini")]):
            print(compared(case, Path(scratch) / str(number)), flush=True)


if __name__ == "__main__":
    main()

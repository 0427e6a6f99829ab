"""Processor time of ``check`` on a case whose text is wrong, beside ``check`` on the right one.

    python benchmarks/bench_text_mistake.py

A mistake in the text is to cost at most 1.5 s of processor time: no plugin, solver or field is
loaded before the text is read. The median of five, each in a process of its own.
"""

import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from mistakes import CHECKED

REPEATS = 5
MOST_S = 1.5
WRONG = {
    "no mistake": CHECKED,
    "end quote missing": CHECKED.replace('"8 mm"', '"8 mm'),
    "unit of another kind": CHECKED.replace('"8 mm"', '"8 N"'),
    "unknown key": CHECKED.replace("size =", "sizes ="),
}


def seconds(folder: Path) -> float:
    """Processor time of one check, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "gradedesign", "check", str(folder), "--no-picture"],
        capture_output=True,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> int:
    """Print a row for each text; 1 if a mistake costs more than it may."""
    slow = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for what, text in WRONG.items():
            (folder / "case.toml").write_text(text)
            median = statistics.median(seconds(folder) for _ in range(REPEATS))
            slow += text is not CHECKED and median > MOST_S
            print(f"{what:24} {median:6.2f} s")
    return int(slow > 0)


if __name__ == "__main__":
    sys.exit(main())

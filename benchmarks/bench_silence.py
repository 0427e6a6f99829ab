"""Longest silence of a command without a terminal, seconds, and what was said before it.

Run ``python benchmarks/bench_silence.py run cases/bracket -o runs/silence``: the arguments are
those of ``gradedesign``, a run of ``cases/mini`` without any. Lines of standard output and standard
error count. At most 10 s are wanted.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]


def longest_silence(arguments: list[str]) -> tuple[float, str, int]:
    """Longest time without a line, the line before it, and the exit code of the command."""
    command = [sys.executable, "-m", "gradedesign", *arguments]
    spoke, last, longest, before = time.monotonic(), "(start)", 0.0, ""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        for line in process.stdout or ():
            print(line, end="", flush=True)
            now = time.monotonic()
            if now - spoke > longest:
                longest, before = now - spoke, last
            spoke, last = now, line.rstrip()
        code = process.wait()
    if time.monotonic() - spoke > longest:
        longest, before = time.monotonic() - spoke, last
    return longest, before, code


def main() -> None:
    """Run the command and print what was found."""
    with tempfile.TemporaryDirectory() as scratch:
        mini = ["run", str(ROOT / "cases" / "mini"), "-o", str(Path(scratch) / "run")]
        longest, before, code = longest_silence(sys.argv[1:] or mini)
    print(f"longest silence {longest:.1f} s (wanted: 10 s at most), exit code {code}, after:")
    print(f"  {before}")


if __name__ == "__main__":
    main()

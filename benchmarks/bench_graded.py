"""Graded against uniform: lattice mass of one case, both judged by the same verdict.

Run ``python benchmarks/bench_graded.py [CASE FOLDER] [graded result.json]``. The uniform design is
found by the same loop with one density; it ends within 1 % of mass of its optimum because a limit
must be used to 97 % and stiffness grows at least twice as fast as density.
"""

import json
import sys
import tempfile
from pathlib import Path

from gradedesign import load_case, run
from gradedesign.program.commands.progress_lines import ProgressLines


def solved(folder: Path, grading: str, out: Path) -> dict:
    """Run a case with the given grading and return its result.json."""
    text = (folder / "case.toml").read_text(encoding="utf-8")
    if f'grading = "{grading}"' not in text:
        text = text.replace('grading = "level"', f'grading = "{grading}"')
    copy = out / grading
    copy.mkdir()
    for entry in folder.iterdir():
        if entry.suffix == ".stl":
            (copy / entry.name).write_bytes(entry.read_bytes())
    (copy / "case.toml").write_text(text, encoding="utf-8")
    run(load_case(copy), folder=copy / "run", on_event=ProgressLines())
    return json.loads((copy / "run" / "result.json").read_text(encoding="utf-8"))


def main() -> None:
    """Run what is not given and print the ratio."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("cases/bracket")
    with tempfile.TemporaryDirectory() as temporary:
        out = Path(temporary)
        if len(sys.argv) > 2:
            graded = json.loads(Path(sys.argv[2]).read_text(encoding="utf-8"))
        else:
            graded = solved(folder, "level", out)
        uniform = solved(folder, "uniform", out)
    for name, data in (("graded", graded), ("uniform", uniform)):
        utilisation = max(row["utilisation"] for row in data["limits"])
        print(
            f"{name}: {data['status']}, lightest {data['lightest']}, lattice "
            f"{data['lattice_mass_g']:.4g} g at {data['lattice_density']:.4f}, "
            f"utilisation {utilisation:.1%}"
        )
    print(f"ratio {graded['lattice_mass_g'] / uniform['lattice_mass_g']:.3f}")


if __name__ == "__main__":
    main()

"""A case that the command runs in a process of its own."""

import json
import subprocess
import sys

from result_keys import undocumented


def result_of(case, folder):
    """Result of a case, run below a folder: its limits hold, and each of its keys is documented."""
    (folder / "case.toml").write_text(case, encoding="utf-8")
    command = [
        *(sys.executable, "-m", "gradedesign", "run", str(folder)),
        *("-o", str(folder / "r"), "--json"),
    ]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((folder / "r" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "met"
    assert undocumented(result) == []
    return result

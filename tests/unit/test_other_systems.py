"""What Windows and macOS lack is not needed to start; nothing else of them is tried here."""

import subprocess
import sys

import pytest

#: Names that Windows has not, taken away from our own modules only.
WITHOUT = """
import builtins, os, pathlib, signal, sys
import filelock, numba, numpy, platformdirs, psutil, pydantic, scipy, typer, rich

real = builtins.__import__
def imported(name, given=None, *rest):
    ours = (given or {}).get("__name__", "").startswith("gradedesign")
    if ours and name in ("fcntl", "resource"):
        raise ImportError(f"no module named {name}")
    return real(name, given, *rest)
builtins.__import__ = imported
for module, names in (
    (signal, ("SIGKILL", "SIGALRM", "setitimer", "getitimer", "ITIMER_REAL")),
    (os, ("fork", "killpg", "O_NOFOLLOW", "pread", "pwrite", "sched_getaffinity")),
):
    for name in names:
        delattr(module, name)
"""


@pytest.mark.parametrize(
    "use",
    [
        "import gradedesign.program.commands.app",
        "from gradedesign.program.store.run_folder import open_run_folder as o\n"
        "path = pathlib.Path(sys.argv[1]) / 'run'\n"
        "with o(path, 'a' * 64, resume=True, overwrite=False) as run:\n"
        "    run.write_text('x.txt', 'x')",
        "from gradedesign.program.commands.interrupt import interruptible\n"
        "with interruptible() as asked:\n"
        "    assert not asked.stop_requested",
        "from gradedesign.common.system.worker_failure import Ending, worker_error\n"
        "(pathlib.Path(sys.argv[1]) / 'log.txt').write_text('bad')\n"
        "end = Ending(module='m', folder=pathlib.Path(sys.argv[1]), code=3221225477,"
        " time_limit_s=1.0, memory_limit_bytes=10)\n"
        "assert 'exit code 3221225477' in str(worker_error(end, None))",
    ],
    ids=["commands", "run folder", "interruption", "crash"],
)
def test_it_starts_without_what_only_unix_has(tmp_path, use):
    ended = subprocess.run(
        [sys.executable, "-c", WITHOUT + use, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stderr

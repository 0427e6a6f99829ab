"""Start a worker process under limits, wait for it, and clean up after it.

Run as a script, apart from the package, in the worker's folder:
``_launch_worker.py PARENT MEMORY_BYTES COMMAND...``. Limits set before ``exec`` hold for everything
the worker loads, which a ``preexec_fn`` cannot do safely in a process with threads. The launcher
stays: when the parent dies, however that dies, it kills the worker and removes the folder.
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
import time

#: Linux, prctl(2): the signal that a process gets when its parent ends.
_PR_SET_PDEATHSIG = 1
#: Seconds between two looks at the worker and the parent. The interval doubles, so that short work
#: ends soon and long work costs nothing. Chosen, not measured.
_SHORTEST, _LONGEST = 0.001, 0.02
#: Written beside the worker's files: the most memory it held, bytes.
_PEAK_NAME = "peak.txt"


def _die_with(parent: int) -> None:
    """Ask Linux to kill this process when its parent dies, however that dies."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before the request was made
        os.kill(os.getpid(), signal.SIGKILL)


def _become_worker(launcher: int, memory: int, command: list[str]) -> None:
    """Apply the limits and replace this process; 0 bytes stand for no limit."""
    _die_with(launcher)
    if sys.platform == "darwin":  # which refuses a limit of the address space
        os.execv(command[0], command)
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    if hard != resource.RLIM_INFINITY:
        memory = min(memory, hard) if memory else hard
    if memory:
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    os.execv(command[0], command)


def _watch(child: int, parent: int) -> int:
    """Wait for the worker; return its status, or never if the parent dies first."""
    pause = _SHORTEST
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return status
        if os.getppid() != parent:
            _abandon(child)
        time.sleep(pause)
        pause = min(2 * pause, _LONGEST)


def _abandon(child: int) -> None:
    """Kill the worker, remove its folder, and end with everything it started."""
    import shutil  # only here: it takes longer to import than all of the rest

    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    folder = os.getcwd()  # noqa: PTH109
    os.chdir(os.sep)
    shutil.rmtree(folder, ignore_errors=True)
    os.killpg(os.getpgrp(), signal.SIGKILL)


def _note_peak() -> None:
    """Tell the parent how much memory the worker held."""
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    try:
        with open(_PEAK_NAME, "x", encoding="ascii") as file:  # noqa: PTH123 - pathlib is slow
            file.write(str(peak if sys.platform == "darwin" else 1024 * peak))
    except OSError:
        pass  # a full disk: then it is not known


def main() -> None:
    """Start the worker, wait for it and end as it did."""
    parent, memory = int(sys.argv[1]), int(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    launcher = os.getpid()
    child = os.fork()
    if child == 0:
        _become_worker(launcher, memory, sys.argv[3:])
    status = _watch(child, parent)
    _note_peak()
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        if number != signal.SIGKILL:
            signal.signal(number, signal.SIG_DFL)
        os.kill(launcher, number)
        sys.exit(128 + number)
    sys.exit(os.WEXITSTATUS(status))


if __name__ == "__main__":
    main()

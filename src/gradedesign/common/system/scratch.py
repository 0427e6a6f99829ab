"""Temporary folders that do not outlive their process, even if that is killed."""

from __future__ import annotations

import logging
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from filelock import FileLock, Timeout

from gradedesign.errors import ResourceError

log = logging.getLogger(__name__)

_LOCK = "lock"
_NAME = re.compile(r"gradedesign-[a-z]+-(\d+)-.+")


@contextmanager
def scratch_folder(purpose: str) -> Iterator[Path]:
    """Make a private temporary folder, and remove those of processes that were killed.

    Raises `ResourceError` if there is no place for temporary files.

    ``purpose``: lower case, part of the folder's name, as in ``"worker"``.

    Yields
    ------
    Path
        Absolute; removed at the end, whatever happened.
    """
    try:
        root = Path(tempfile.gettempdir())
        sweep_scratch(root)
        name = tempfile.mkdtemp(prefix=f"gradedesign-{purpose}-{os.getpid()}-")
    except OSError as cause:
        raise ResourceError(
            f"no place for temporary files: {cause}; free disk space, or set TMPDIR to a folder "
            f"you may write in"
        ) from cause
    folder = Path(name).absolute()
    try:
        with FileLock(folder / _LOCK, timeout=0, thread_local=False):
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def sweep_scratch(root: Path) -> None:
    """Remove the scratch folders of this user below ``root`` that no process uses any more."""
    for entry in root.glob("gradedesign-*-*-*"):
        owner = _NAME.fullmatch(entry.name)
        if owner and _is_stale(entry, int(owner[1])):
            log.info("removing %s, which a killed run left", entry)
            shutil.rmtree(entry, ignore_errors=True)


def _is_stale(folder: Path, pid: int) -> bool:
    """Tell whether the process that made a folder is gone.

    Its number may be one of another container, so that the lock has to be free as well.
    """
    try:
        status = folder.lstat()
        foreign = sys.platform != "win32" and status.st_uid != os.getuid()
        if foreign or folder.is_symlink() or psutil.pid_exists(pid):
            return False
        with FileLock(folder / _LOCK, timeout=0):
            return True
    except Timeout:
        return False
    except OSError as cause:
        log.info("leaving %s: %s", folder, cause)
        return False

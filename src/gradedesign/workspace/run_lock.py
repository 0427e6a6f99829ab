"""One run at a time in a folder: a lock file that names its owner."""

from __future__ import annotations

import errno
import fcntl
import json
import logging
import os
import socket
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

from gradedesign.errors import CaseError
from gradedesign.workspace.atomic import write_error

log = logging.getLogger(__name__)

LOCK_NAME = ".lock"
_SAME_START_S = 2.0
_ATTEMPTS = 10


@dataclass(slots=True, kw_only=True, eq=False)
class RunLock:
    """A held lock.

    The kernel's ``flock`` decides between runs of this machine and ends with its process; the
    process number, its start time and the host inside the file serve the message, shared file
    systems and those without ``flock``.

    Attributes
    ----------
    path : Path
    descriptor : int or None
        Open file; None once released.
    """

    path: Path
    descriptor: int | None

    @classmethod
    def acquire(cls, folder: Path) -> RunLock:
        """Lock a folder; a lock whose owner is dead is taken over with a warning.

        Raises
        ------
        CaseError
            If another run holds it (process and host are named) or the folder is read-only.
        """
        path = folder / LOCK_NAME
        for _ in range(_ATTEMPTS):
            try:
                descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
            except OSError as cause:
                raise write_error(path, cause) from cause
            try:
                exclusive = _flock(descriptor)
                if exclusive and not _is_same_file(descriptor, path):
                    os.close(descriptor)  # its owner released it between our open and our lock
                    continue
                _refuse_or_take(descriptor, path, exclusive=exclusive)
            except BaseException:
                os.close(descriptor)
                raise
            return cls(path=path, descriptor=descriptor)
        raise CaseError(f"{path} keeps changing hands; other runs are starting in this folder")

    def release(self) -> None:
        """Give the lock back; releasing twice does no harm."""
        if self.descriptor is None:
            return
        # Removed while still held, so that nobody can lock a file that then disappears.
        with suppress(OSError):
            self.path.unlink()
        os.close(self.descriptor)
        self.descriptor = None


def _flock(descriptor: int) -> bool:
    """Take the kernel's lock; return False where another holds it."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as cause:
        if cause.errno in (errno.EWOULDBLOCK, errno.EACCES):
            return False
        if cause.errno not in (errno.ENOTSUP, errno.ENOLCK, errno.EINVAL):
            raise
        log.debug("this file system has no flock; relying on the process named in the lock file")
    return True


def _is_same_file(descriptor: int, path: Path) -> bool:
    """Tell whether the open file still is the one of that name."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _refuse_or_take(descriptor: int, path: Path, *, exclusive: bool) -> None:
    """Raise if the owner named in the file may be alive; else become the owner."""
    owner = _owner(os.pread(descriptor, 4096, 0))
    host = socket.gethostname()
    if not exclusive or (owner and _may_run(owner, host)):
        who = f"process {owner.get('pid')} on {owner.get('host')}" if owner else "another process"
        raise CaseError(
            f"{path.parent} is in use by {who}; wait for that run, choose another folder with -o, "
            f"or remove {path} if that process is certainly gone"
        )
    if owner:
        log.warning(
            "taking over %s: its run (process %s) ended without releasing it",
            path.parent,
            owner.get("pid"),
        )
    mine = {"pid": os.getpid(), "host": host, "started": psutil.Process().create_time()}
    try:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, json.dumps(mine).encode("utf-8"), 0)
        os.fsync(descriptor)
    except OSError as cause:
        raise write_error(path, cause) from cause


def _owner(content: bytes) -> dict[str, Any]:
    """Return who wrote a lock file; empty for a new file or one cut off while being written."""
    try:
        owner = json.loads(content)
    except ValueError:
        return {}
    return owner if isinstance(owner, dict) else {}


def _may_run(owner: dict[str, Any], host: str) -> bool:
    """Tell whether the owner could still be running; one on another host always could."""
    if owner.get("host") != host:
        return True
    pid = owner.get("pid")
    # Our own number: an earlier process had it, or this one lost its lock without releasing it.
    if not isinstance(pid, int) or pid == os.getpid():
        return False
    try:
        process = psutil.Process(pid)
        started, state = process.create_time(), process.status()
    except (psutil.NoSuchProcess, ValueError):
        return False
    except psutil.AccessDenied:
        return True
    recorded = owner.get("started")
    if state == psutil.STATUS_ZOMBIE:
        return False
    # A recycled process number has another start time.
    return not isinstance(recorded, int | float) or abs(started - recorded) < _SAME_START_S

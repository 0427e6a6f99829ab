"""One run at a time in a folder: a lock, and beside it who holds it."""

from __future__ import annotations

import json
import logging
import os
import socket
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import BaseFileLock, FileLock, Timeout

from gradedesign.common.system.atomic import write_error, write_text
from gradedesign.errors import CaseError

log = logging.getLogger(__name__)

LOCK_NAME, OWNER_NAME = ".lock", ".owner"
#: For an owner that is just giving the lock back, s. Chosen, not measured.
_PATIENCE_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunLock:
    """A held lock.

    The operating system's lock of ``.lock`` decides, and ends with its process. ``.owner`` names
    that process in messages, and guards shared file systems whose locks end at the machine.
    """

    folder: Path
    system_lock: BaseFileLock

    @classmethod
    def acquire(cls, folder: Path) -> RunLock:
        """Lock a folder; a lock whose owner is dead is taken over with a warning.

        Raises `CaseError` if another run holds it (process and host are named) or the folder is
        read-only.
        """
        path = folder / LOCK_NAME
        lock = cls(folder=folder, system_lock=FileLock(path, thread_local=False))
        try:
            lock.system_lock.acquire(timeout=_PATIENCE_S)
        except Timeout as cause:
            raise _in_use(folder, _owner(folder)) from cause
        except OSError as cause:
            raise write_error(path, cause) from cause
        try:
            _take_over(folder)
        except BaseException:
            lock.system_lock.release()
            raise
        return lock

    def release(self) -> None:
        """Give the lock back; releasing twice does no harm."""
        if not self.system_lock.is_locked:
            return
        # Removed while still held, so that nobody can lock a file that then disappears; Windows
        # keeps the name of an open file.
        for name in (OWNER_NAME, LOCK_NAME):
            with suppress(OSError):
                (self.folder / name).unlink()
        self.system_lock.release()


def _take_over(folder: Path) -> None:
    """Become the owner of a locked folder; refuse where a run of another machine may go on."""
    host = socket.gethostname()
    if owner := _owner(folder):
        if owner.get("host") != host:
            raise _in_use(folder, owner)
        log.warning(
            "taking over %s: its run (process %s) ended without releasing it",
            folder,
            owner.get("pid"),
        )
    write_text(folder / OWNER_NAME, json.dumps({"pid": os.getpid(), "host": host}))


def _in_use(folder: Path, owner: dict[str, Any]) -> CaseError:
    who = f"process {owner.get('pid')} on {owner.get('host')}" if owner else "another process"
    return CaseError(
        f"{folder} is in use by {who}; wait for that run, take another folder=..., or remove "
        f"{folder / LOCK_NAME} and {OWNER_NAME} if that process is certainly gone"
    )


def _owner(folder: Path) -> dict[str, Any]:
    """Return who is named as owner; empty for nobody, or a file that is not ours."""
    try:
        owner = json.loads((folder / OWNER_NAME).read_bytes())
    except (OSError, ValueError):
        return {}
    return owner if isinstance(owner, dict) else {}

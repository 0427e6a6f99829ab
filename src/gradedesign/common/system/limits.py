"""Memory and time of this process, and what is left of both."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from gradedesign.errors import ResourceError

_CGROUPS = Path("/sys/fs/cgroup")
_OWN_STATUS = Path("/proc/self/status")
_OWN_CGROUP = Path("/proc/self/cgroup")
#: Names of (limit, usage, cache that the kernel gives back) in control groups 2 and 1.
_V2 = ("memory.max", "memory.current", "inactive_file")
_V1 = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")


def address_space_peak_bytes() -> int:
    """Return the largest address space this process has had, in bytes; 0 where it is not known."""
    try:
        lines = _OWN_STATUS.read_text(encoding="ascii").splitlines()
    except OSError:
        return 0  # not Linux
    return next((1024 * int(x.split()[1]) for x in lines if x.startswith("VmPeak:")), 0)


def resident_memory_bytes(pid: int | None = None) -> int:
    """Return the resident memory of a process, this one, and of those it started, in bytes.

    A process that ends while it is asked counts as nothing.
    """
    total = 0
    with suppress(psutil.Error):
        own = psutil.Process(pid)
        for process in (own, *own.children(recursive=True)):
            with suppress(psutil.Error):
                total += int(process.memory_info().rss)
    return total


def available_memory_bytes() -> int:
    """Return what this process can still take without swapping, in bytes.

    The least of what the machine has left and what each control group around this process
    (container, batch job) leaves.
    """
    available = int(psutil.virtual_memory().available)
    return min([available, *_control_group_rooms(_CGROUPS, _OWN_CGROUP)])


def _control_group_rooms(root: Path, membership: Path) -> list[int]:
    """Return the bytes left in every memory control group that this process is in."""
    try:
        lines = membership.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []  # not Linux
    rooms = []
    for line in lines:
        number, controllers, name = line.split(":", 2)
        if number == "0":
            base, files = root, _V2
        elif "memory" in controllers.split(","):
            base, files = root / "memory", _V1
        else:
            continue
        # A container may see its own group as the root, so every level that exists counts.
        folder = base / name.lstrip("/")
        for level in (folder, *folder.parents):
            if level.is_relative_to(base):
                room = _room(level, files)
                rooms.extend([] if room is None else [room])
    return rooms


def _room(folder: Path, files: tuple[str, str, str]) -> int | None:
    """Return the bytes left in one control group; None if it sets no limit or does not exist."""
    limit_file, usage_file, cache_line = files
    try:
        limit = (folder / limit_file).read_text(encoding="ascii").strip()
        if limit == "max":
            return None
        usage = int((folder / usage_file).read_text(encoding="ascii"))
        statistics = (folder / "memory.stat").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    cache = dict(line.split(" ", 1) for line in statistics).get(cache_line, "0")
    return max(0, int(limit) - usage + int(cache))


@dataclass(frozen=True, slots=True)
class Deadline:
    """A point in time, counted from the creation of the record by a clock that never jumps."""

    seconds: float  #: How long from the start; infinity for no limit.
    start: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        if not self.seconds > 0:
            raise ValueError(f"a time limit must be positive, not {self.seconds} s")

    def elapsed(self) -> float:
        """Return the seconds since the start."""
        return time.monotonic() - self.start

    def remaining(self) -> float:
        """Return the seconds left; 0 once the time is over."""
        return max(0.0, self.seconds - self.elapsed())

    def expired(self) -> bool:
        """Tell whether the time is over."""
        return self.remaining() == 0.0

    def require(self, step: str) -> None:
        """Raise `ResourceError` if the time is over; ``step`` names the step not begun."""
        if self.expired():
            raise ResourceError(
                f"the time limit of {self.seconds:g} s was used up before {step}; "
                "raise run.time or resume with a higher one"
            )

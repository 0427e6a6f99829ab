"""Largest memory that this process has had, for tests of what must not grow."""

import sys

import psutil


def peak_memory_bytes() -> int:
    """Return the largest resident memory this process has had, in bytes."""
    if sys.platform == "win32":
        return int(psutil.Process().memory_info().peak_wset)
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak) if sys.platform == "darwin" else int(peak) * 1024

"""Cores that this process may use, and how the threads of compiled kernels share them.

Imported before numba, which reads its settings once: this module imports the standard library
alone.
"""

from __future__ import annotations

import math
import os
from importlib import import_module
from pathlib import Path

#: Threading layers of numba, the one that is taken if it loads first. Threads of ``tbb`` spin while
#: they wait for each other: two runs of `cases/mini` side by side on two cores take four times as
#: long as with ``omp``. ``workqueue`` needs no library.
LAYERS = {"omp": "omppool", "workqueue": "workqueue", "tbb": "tbbpool"}
#: Quota and period of processor time of a control group, version 2 of the kernel's interface.
_QUOTA = Path("/sys/fs/cgroup/cpu.max")


def usable_cores() -> int:
    """Cores this process may use: by affinity, and by the processor time of its control group."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, min(cores or 1, _cores_of_quota()))


def _cores_of_quota() -> int:
    """Cores that a control group's processor time keeps busy; many where it states none."""
    try:
        quota, period = _QUOTA.read_text(encoding="ascii").split()
        return math.ceil(int(quota) / int(period))
    except (OSError, ValueError):  # no control groups, or "max"
        return 1 << 20


def settle_threads() -> None:
    """State in the environment, unless the user has, how numba's threads run and wait.

    Worker processes inherit it. Threads that spin while they wait for each other take the
    processor from those they wait for as soon as anything else runs on the machine.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    os.environ.setdefault("NUMBA_NUM_THREADS", str(usable_cores()))
    if "NUMBA_THREADING_LAYER" not in os.environ:
        os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", " ".join(LAYERS))


def threading_layer() -> str:
    """Layer that numba's threads take here: stated by the user, or the first that loads."""
    stated = os.environ.get("NUMBA_THREADING_LAYER", "")
    if stated in LAYERS:
        return stated
    for name in os.environ.get("NUMBA_THREADING_LAYER_PRIORITY", "").split():
        try:
            import_module(f"numba.np.ufunc.{LAYERS[name]}")
        except (ImportError, KeyError):
            continue
        return name
    return "none"

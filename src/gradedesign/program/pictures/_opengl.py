"""Test of drawing with OpenGL on this machine, in a process where a crash does no harm."""

from __future__ import annotations

import logging
import os
import platform
import re
import subprocess
import sys
import time
from functools import cache
from importlib.metadata import version

import numpy as np

from gradedesign.common.system.cache import content_key, load_arrays, store_arrays

log = logging.getLogger(__name__)

_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
plotter.close()
raise SystemExit(0 if image.min() != image.max() else 3)
"""

#: Seconds for which an answer in the user's cache is valid. Chosen, not measured.
_BELIEVED_S = 86_400.0
#: Environment variables that change what VTK draws with.
_STEERING = re.compile(r"DISPLAY|WAYLAND_DISPLAY|(VTK|LIBGL|MESA|GALLIUM|EGL|_*GLX?|CUDA)_.*")


@cache
def opengl_works() -> bool:
    """Whether a small sphere could be drawn, today in this environment or just now.

    Only a success is kept, for a day: where nothing can be drawn the next process looks again.
    """
    key = _environment_key()
    stored = load_arrays("opengl", key)
    if stored is not None and 0.0 <= time.time() - float(stored["seen"]) < _BELIEVED_S:
        return True
    works = probe_opengl()
    if works:
        store_arrays("opengl", key, seen=np.array(time.time()))
    return works


def _environment_key() -> str:
    """Cache key of the conditions on which OpenGL depends: machine, session and versions."""
    steering = sorted(item for item in os.environ.items() if _STEERING.fullmatch(item[0]))
    machine = (platform.node(), platform.platform(), sys.executable, repr(steering))
    return content_key(_PROBE, version("vtk"), version("pyvista"), *machine)


def probe_opengl(limit_s: float = 90.0) -> bool:
    """Draw a small sphere in a process of its own.

    VTK ends the whole process where no OpenGL is found, so it is never tried in ours first.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PROBE],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=limit_s,
            check=False,
        )
    except (subprocess.TimeoutExpired, OSError) as cause:
        log.info("no OpenGL: %s", cause)
        return False
    if done.returncode:
        log.info("no OpenGL: the probe ended with %d", done.returncode)
    return done.returncode == 0

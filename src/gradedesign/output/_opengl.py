"""Whether this machine can draw with OpenGL, found out where a crash does no harm."""

from __future__ import annotations

import logging
import subprocess
import sys
from functools import cache

log = logging.getLogger(__name__)

_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
plotter.close()
raise SystemExit(0 if image.min() != image.max() else 3)
"""


@cache
def opengl_works(limit_s: float = 90.0) -> bool:
    """Draw a small sphere in a process of its own; asked once per process.

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

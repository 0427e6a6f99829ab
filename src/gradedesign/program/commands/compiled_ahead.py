"""Kernels that the end of a run needs, compiled in a process beside its beginning.

Numba compiles a kernel for the types that it is called with, once on a machine, on one core. So the
process, ``python -m`` this module, solves a small solid on finite cells, contours and draws it: the
stages that a run reaches last and whose kernels take longest. The run finds them in numba's cache.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from subprocess import DEVNULL, Popen

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.compiling import when_compiling
from gradedesign.common.system.processor import usable_cores
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.finite_cell.analysis import divide, solve_divided
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem
from gradedesign.mechanics.finite_cell.recovery import recovered_stress
from gradedesign.mechanics.finite_cell.stress import displacement_at, solid_points
from gradedesign.mechanics.finite_cell.surface import element_table, locate
from gradedesign.mechanics.material.material import Material
from gradedesign.program.pictures.pictures import surface_still

log = logging.getLogger(__name__)

#: Size of the solid in finite cells of edge 1: so many that the multigrid cycle has all its levels.
_SIZE = (12.0, 8.0, 8.0)


@contextmanager
def compiling_ahead() -> Iterator[None]:
    """Start the process as soon as a kernel is compiled, and end it with the block.

    Nothing is started where all kernels are in numba's cache, nor for a single core.
    """
    started: list[Popen[bytes]] = []

    def start() -> None:
        if usable_cores() < 2:
            return
        command = [sys.executable, "-m", __name__]
        # The second core is enough: compiling takes one thread.
        environment = {**os.environ, "NUMBA_NUM_THREADS": "1"}
        nothing = DEVNULL
        started.append(
            Popen(command, env=environment, stdin=nothing, stdout=nothing, stderr=nothing)
        )

    with when_compiling(start):
        try:
            yield
        finally:
            for process in started:
                # One that has ended by itself has compiled all.
                process.kill()
                log.info("compiling ahead ended with %d", process.wait())


def rehearse() -> None:
    """Solve a small solid on finite cells, take its stress, contour and draw it."""
    upper = np.array(_SIZE)
    press = LoadCaseSpec.model_validate(
        {
            "name": "press",
            "fix": [{"region": "x0"}],
            "load": [{"region": "x1", "force": ["-1 N", "0 N", "0 N"]}],
        }
    )
    problem = CutProblem(
        field=_sheets,
        lower=np.zeros(3),
        upper=upper,
        cases=(press,),
        regions={"x0": _end(0.0), "x1": _end(_SIZE[0])},
        material=Material(
            name="any", youngs_modulus=1e5, poissons_ratio=0.3, density=4e-9, yield_strength=1.0
        ),
    )
    result = solve_divided(problem, *divide(problem, 1.0))
    at, u = solid_points(result.elements), result.solutions[0].u
    recovered_stress(result.elements, result.space, u, result.moduli, at, 0.0)
    found = locate(result.elements, element_table(result.elements), at.points[:, :9])
    displacement_at(result.elements, result.space, u, found, at.points[:, :9])
    surface_still(extract_surface(_sheets, np.zeros(3) - 0.5, upper + 0.5, 0.5), "any")


def _sheets(points: FloatArray) -> FloatArray:
    """Sheets of a periodic surface of cells of edge 4, between two solid ends."""
    x, y, z = np.asarray(points) * (0.5 * np.pi)
    level = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    ends = np.abs(points[0] - 0.5 * _SIZE[0]) - 0.5 * _SIZE[0] + 1.0
    shape = (3, *[1] * level.ndim)
    half = 0.5 * np.array(_SIZE).reshape(shape)
    outside = (np.abs(points - half) - half).max(axis=0)
    return np.maximum(np.minimum(np.abs(level) - 0.5, -ends), outside)


def _end(x: float) -> Region:
    """An end of the solid across x."""
    _, b, c = _SIZE
    quad = np.array([[x, 0.0, 0.0], [x, b, 0.0], [x, b, c], [x, 0.0, c]])
    if x == 0.0:
        quad = quad[::-1]
    return Region(
        name=f"x{int(x > 0.0)}",
        triangles=np.arange(2),
        corners=quad[[[0, 1, 2], [0, 2, 3]]],
        area=b * c,
        centroid=quad.mean(axis=0),
        faces=(0,),
    )


if __name__ == "__main__":
    rehearse()

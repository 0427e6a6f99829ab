"""How well the surface of a lattice must hold its volume, and within which memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gradedesign.errors import LatticeError, ResourceError

#: Memory that a vertex takes with its triangles at the peak of what is made of a surface: 1.53 GB
#: for 5.56 million (10 x 10 x 10 gyroid sheets), the program itself included.
_BYTES_PER_VERTEX = 300.0
#: A finer grid aims at these shares of the allowed error, after one contour and after more, whose
#: order is measured: no two grids meet struts alike. Chosen, not measured.
_AIM, _MEASURED_AIM = 0.8, 0.95
#: Its step over the last one is held between these: where struts are hardly met no power of the
#: step holds, and less of a change is not worth a contour.
_LEAST_FINER, _MOST_FINER = 0.5, 0.9
#: Powers of the step with which the error falls, at least and at most: a smooth surface has the
#: fourth, which is taken of a first contour, and edges between struts one to one and a half.
#: `knot`, whose net meets its struts in edges, took six contours by the fourth power alone.
_ORDERS = (1.0, 4.0)


class CoarseContourError(LatticeError):
    """A grid too coarse for the volume of the lattice.

    Attributes
    ----------
    step : float, mm
        Of the grid.
    error : float
        Of the volume of a cell by estimate, relative to its solid.
    """

    def __init__(self, message: str, *, step: float, error: float) -> None:
        super().__init__(message)
        self.step = step
        self.error = error


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """How well a surface holds the volume of a lattice."""

    within: float  #: Most that the volume of a cell may be off by estimate, relative to its solid.
    memory: float  #: bytes. That the surface may take.

    def finer_step(self, missed: Sequence[CoarseContourError]) -> float:
        """Step that should do after contours that were too coarse, mm; the last one of them last.

        The error is taken to fall on as it did between the last two.

        Examples
        --------
        >>> first = CoarseContourError("", step=0.4, error=0.02)
        >>> second = CoarseContourError("", step=0.32, error=0.016)
        >>> asked = Resolution(within=0.01, memory=1e9)
        >>> round(asked.finer_step([first]), 3), round(asked.finer_step([first, second]), 3)
        (0.318, 0.19)
        """
        last, order, aim = missed[-1], _ORDERS[1], _AIM
        if len(missed) > 1:
            before, aim = missed[-2], _MEASURED_AIM
            order = math.log(before.error / last.error) / math.log(before.step / last.step)
        power = 1.0 / min(max(order, _ORDERS[0]), _ORDERS[1])
        ratio = (aim * self.within / last.error) ** power
        return last.step * min(max(ratio, _LEAST_FINER), _MOST_FINER)


def require_volume(error: float, asked: Resolution | None, step: float) -> None:
    """Refuse a contour at a step, mm, whose estimated error of a cell's volume is too large.

    Raises `CoarseContourError`.
    """
    if asked is not None and error > asked.within:
        raise CoarseContourError(
            f"at a grid of {step:.3g} mm the surface of a cell is estimated to hold {error:.1%} "
            f"more or less than its solid, expected at most {asked.within:.1%}",
            step=step,
            error=error,
        )


def require_room(vertices: int, share: float, cubes: int, memory: float, h: float) -> None:
    """Refuse a contour that is going to take more than its memory.

    Raises `ResourceError`.

    - ``vertices``: so far
    - ``share``: of the grid's planes that are done
    - ``cubes``: of the grid
    - ``memory``, bytes
    - ``h``, mm: spacing of the grid
    """
    if _BYTES_PER_VERTEX * vertices + cubes > memory:
        need = _BYTES_PER_VERTEX * vertices / max(share, 1e-9) + cubes
        raise ResourceError(
            f"the surface of the lattice needs a grid of {h:.3g} mm, and about {need / 1e9:.3g} GB "
            f"there, but [run] memory is {memory / 1e9:.3g} GB; raise [run] memory, or take "
            f"larger cells, a higher lowest density or a smaller part"
        )

"""How well the surface of a lattice must hold its volume, and within which memory."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign.arrays import FloatArray
from gradedesign.errors import LatticeError, ResourceError

#: Memory that a vertex takes with its triangles at the peak of what is made of a surface: 1.53 GB
#: for 5.56 million (10 x 10 x 10 gyroid sheets), the program itself included.
_BYTES_PER_VERTEX = 300.0

#: Lower and upper corners of boxes, each ``(3,)``, mm.
Boxes = tuple[tuple[FloatArray, FloatArray], ...]


class CoarseContourError(LatticeError):
    """A grid too coarse for the volume of the lattice.

    Attributes
    ----------
    step : float, mm
        Of the grid.
    error : float
        Of the volume of a cell by estimate, relative to its solid.
    worst : tuple of (lower, upper), each (3,) array, mm
        Boxes of the cells of the largest errors.
    """

    def __init__(self, message: str, *, step: float, error: float, worst: Boxes = ()) -> None:
        super().__init__(message)
        self.step = step
        self.error = error
        self.worst = worst


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """How well a surface holds the volume of a lattice."""

    within: float  #: Most that the volume of a cell may be off by estimate, relative to its solid.
    memory: float  #: bytes. That the surface may take.


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

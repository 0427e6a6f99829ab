"""How well the surface of a lattice must hold its volume, and within which memory."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign.errors import LatticeError, ResourceError

#: Memory that a vertex takes with its triangles at the peak of what is made of a surface: 1.53 GB
#: for 5.56 million (10 x 10 x 10 gyroid sheets), the program itself included.
_BYTES_PER_VERTEX = 300.0
#: A finer grid aims at this share of the allowed error, which grows as the fourth power of the
#: step: no two grids meet struts alike. Its step over the last one is held between these: where
#: struts are hardly met the power does not hold, and less of a change is not worth a contour.
_AIM, _LEAST_FINER, _MOST_FINER = 0.8, 0.5, 0.9


class CoarseContourError(LatticeError):
    """A grid too coarse for the volume of the lattice.

    Attributes
    ----------
    finer : float, mm
        Step that should do.
    """

    def __init__(self, message: str, *, finer: float) -> None:
        super().__init__(message)
        self.finer = finer


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """How well a surface holds the volume of a lattice."""

    within: float  #: Most that the volume of a cell may be off by estimate, relative to its solid.
    memory: float  #: bytes. That the surface may take.


def require_volume(error: float, asked: Resolution | None, step: float) -> None:
    """Refuse a contour at a step, mm, whose estimated error of a cell's volume is too large.

    Raises `CoarseContourError`.
    """
    if asked is not None and error > asked.within:
        power = (_AIM * asked.within / error) ** 0.25
        raise CoarseContourError(
            f"at a grid of {step:.3g} mm the surface of a cell is estimated to hold {error:.1%} "
            f"more or less than its solid, expected at most {asked.within:.1%}",
            finer=step * min(max(power, _LEAST_FINER), _MOST_FINER),
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

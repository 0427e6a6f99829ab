"""A net-skin: the struts below the part's surface, laid onto it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError

#: Depths at which struts are looked for, along a cell. Chosen, not measured.
_PER_CELL = 24
#: How often the distance of these depths is halved about the best one. Chosen, not measured.
_HALVINGS = 3
#: Points that are evaluated at a time. Bounds the memory of one step; the result does not depend on
#: it. Chosen, not measured.
_BATCH = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetSkin:
    """Struts laid onto the part's surface.

    Attributes
    ----------
    thickness : float, mm
        Of the net below the surface.
    reach : float, mm
        Struts down to this depth are laid onto the surface.
    outward : callable
        Unit vector in which the part's signed distance grows, points ``(3, n)`` mm to ``(3, n)``.
    start : float, mm
        Depth from which they are, and by which ``thickness`` has grown with the part's faces.
    faces : callable, optional
        Unsigned distance to the faces that carry it, points ``(3, ...)`` mm to ``(...)`` mm; the
        whole surface carries it without.

    Raises
    ------
    LatticeError
        If thickness or reach are not positive.
    """

    thickness: float
    reach: float
    outward: Field
    start: float = 0.0
    faces: Field | None = None

    def __post_init__(self) -> None:
        if not (self.thickness > 0 and self.reach > 0):
            raise LatticeError(
                f"a net-skin of {self.thickness:g} mm from struts down to {self.reach:g} mm is "
                f"impossible; expected both above 0 mm"
            )


def net_value(
    net: NetSkin,
    points: FloatArray,
    distance: FloatArray,
    cell: tuple[Field, float],
) -> FloatArray:
    """Values of a net-skin at points ``(3, n)`` mm, ``(n,)``, about mm, negative in it.

    Four steps, for any direction of the surface: the layer below the surface (C); the lattice
    down to the reach (D), which takes the place of the lattice less the eroded part; its
    projection along the surface's normal, the smallest value of the cells along it; and of the
    layer what the projection meets.

    Parameters
    ----------
    net : NetSkin
    points : (3, n) array, mm
    distance : (n,) array, mm
        Signed distance of the part there, exact down to twice the thickness.
    cell : (callable, float)
        Field of the infinite lattice, about mm, negative inside, and the size of its cells, mm.

    References
    ----------
    Aremu et al., "A voxel-based method of constructing and skinning conformal and functionally
    graded lattice structures suitable for additive manufacturing", Additive Manufacturing 13
    (2017) 1-13, section 2.5; there projections go along coordinate axes, on voxels.
    """
    field, size = cell
    # Beyond the part it goes on, as every solid layer does: the part trims it.
    layer = -distance - net.thickness
    if net.faces is not None:
        layer = np.maximum(layer, net.faces(points) - net.thickness + net.start)
    near = np.flatnonzero(layer < net.thickness)
    depths = depths_of(net, size)
    value = np.array(layer)
    for start in range(0, len(near), _BATCH):
        some = near[start : start + _BATCH]
        normal = net.outward(points[:, some])
        foot = points[:, some] - distance[some] * normal
        least = _projected(field, foot, normal, depths, layer[some])
        value[some] = np.maximum(layer[some], least)
    return value


def depths_of(net: NetSkin, size: float) -> FloatArray:
    """Depths below the surface at which struts are looked for in cells of a size, ``(k,)``, mm."""
    count = int(np.ceil(_PER_CELL * (net.reach - net.start) / size)) + 1
    return np.linspace(net.start, net.reach, count)


def _projected(
    field: Field, foot: FloatArray, outward: FloatArray, depths: FloatArray, enough: FloatArray
) -> FloatArray:
    """Least value of a field below feet ``(3, n)``, ``(n,)``: of samples, then about the best.

    A foot whose value falls to ``enough`` is not looked at again.
    """
    least: FloatArray = np.full(foot.shape[1], np.inf)
    best = np.zeros(foot.shape[1])

    def look(at: FloatArray) -> None:
        open_ones = np.flatnonzero(least > enough)
        if not len(open_ones):
            return
        at = np.clip(at[open_ones], depths[0], depths[-1])
        value = field(foot[:, open_ones] - at * outward[:, open_ones])
        better = value < least[open_ones]
        least[open_ones[better]], best[open_ones[better]] = value[better], at[better]

    for depth in depths:
        look(np.full(best.shape, depth))
    step = depths[1] - depths[0]
    for _ in range(_HALVINGS):
        step /= 2
        middle = best.copy()
        look(middle - step)
        look(middle + step)
    return least

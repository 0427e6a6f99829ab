"""A net-skin: the struts below the part's surface, laid onto it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import CaseError, LatticeError
from gradedesign.geometry.lattice.component import CellComponent
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.part.place import distance_to_faces

#: Depths at which struts are looked for, along a cell. Chosen, not measured.
_PER_CELL = 24
#: How often the distance of these depths is halved about the best one. Chosen, not measured.
_HALVINGS = 3
#: Points that are evaluated at a time. Bounds the memory of one step; the result does not depend on
#: it. Chosen, not measured.
_BATCH = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetSkin(CellComponent):
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

    ties_faces: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not (self.thickness > 0 and self.reach > 0):
            raise LatticeError(
                f"a net-skin of {self.thickness:g} mm from struts down to {self.reach:g} mm is "
                f"impossible; expected both above 0 mm"
            )

    @property
    def least(self) -> float:
        """Its thickness, mm."""
        return self.thickness

    @property
    def part_depth(self) -> float:
        """Twice its thickness, mm."""
        return 2 * self.thickness

    def over(
        self, cells: FloatArray, points: FloatArray, to_part: FloatArray, cell: tuple[Field, float]
    ) -> FloatArray:
        """The cells and the net.

        Four steps, for any direction of the surface: the layer below the surface (C); the lattice
        down to the reach (D), which takes the place of the lattice less the eroded part; its
        projection along the surface's normal, the smallest value of the cells along it; and of the
        layer what the projection meets.

        References
        ----------
        Aremu et al., "A voxel-based method of constructing and skinning conformal and functionally
        graded lattice structures suitable for additive manufacturing", Additive Manufacturing 13
        (2017) 1-13, section 2.5; there projections go along coordinate axes, on voxels.
        """
        field, size = cell
        # Beyond the part it goes on, as every solid layer does: the part trims it.
        layer = -to_part - self.thickness
        if self.faces is not None:
            layer = np.maximum(layer, self.faces(points) - self.thickness + self.start)
        near = np.flatnonzero(layer < self.thickness)
        depths = depths_of(self, size)
        value = np.array(layer)
        for start in range(0, len(near), _BATCH):
            some = near[start : start + _BATCH]
            normal = self.outward(points[:, some])
            foot = points[:, some] - to_part[some] * normal
            least = _projected(field, foot, normal, depths, layer[some])
            value[some] = np.maximum(layer[some], least)
        return np.minimum(cells, value)

    def grown(self, overhang: float) -> Self:
        """It reaches from the new faces as deep as before."""
        return replace(
            self,
            thickness=self.thickness + overhang,
            reach=self.reach + overhang,
            start=self.start + overhang,
        )


def depths_of(net: NetSkin, size: float) -> FloatArray:
    """Depths below the surface at which struts are looked for in cells of a size, ``(k,)``, mm.

    Examples
    --------
    >>> net = NetSkin(thickness=0.5, reach=2.0, outward=lambda p: p)
    >>> len(depths_of(net, 6.0))
    9
    """
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


def _make(place: ComponentPlace) -> Made:
    """Nets of a case.

    Raises CaseError if cells have no struts: projected walls nearly close the surface.
    """
    where = place.where("lattice.skin")
    stated = [spec for spec in place.lattice.skin if spec.net]
    for cell in place.cells if stated else ():
        if cell.axes is None:
            raise CaseError(
                f"{where}: a net-skin lays struts on the surface, and cell '{cell.name}' "
                f"has none; expected a strut cell such as bcc, or a skin without net"
            )
    nets = [
        NetSkin(
            name="the net",
            where=where,
            thickness=spec.thickness[1],
            reach=spec.net_depth or max(place.lattice.edges),
            outward=place.distance.outward,
            faces=distance_to_faces(place.part, spec.faces),
        )
        for spec in stated
    ]
    return nets, ()


#: Struts laid onto the surface, ``skin = {thickness = "1 mm", net = true}``.
KIND = ComponentKind(name="net_skin", stage="cells", make=_make)

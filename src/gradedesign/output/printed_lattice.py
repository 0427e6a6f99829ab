"""The printed lattice as an exporter receives it."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign.arrays import Field
from gradedesign.mesh.surface_mesh import SurfaceMesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrintedLattice:
    """What is printed: the surface that is written, and what files may say about it.

    More attributes may follow; those that are there keep their meaning.

    Attributes
    ----------
    surface : SurfaceMesh
        Closed and outward oriented: ``vertices`` (n, 3) and ``faces`` (m, 3), in ``unit``. Where a
        verdict was reached, it is the surface that was judged.
    name : str
        Of the case.
    material : str or None
        Its name; None where the case states none.
    field : callable or None
        Points ``(3, ...)`` mm to values ``(...)``, about mm, negative inside the lattice; built
        when it is first called. Loose pieces, which the surface leaves out, are still in it.
    unit : str
        Always ``"mm"``.
    """

    surface: SurfaceMesh
    name: str
    material: str | None = None
    field: Field | None = None
    unit: str = "mm"

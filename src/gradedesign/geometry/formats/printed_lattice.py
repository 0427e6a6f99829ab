"""The printed lattice as an exporter receives it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.direction import FRAMES
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredField:
    """Bounds and volume of a lattice of which no surface was made."""

    bounds: FloatArray  #: ``(2, 3)``, mm. Least and largest corner of the part.
    volume: float  #: mm^3. Inside the field, by evenly spread points, with disconnected components.


class SampledPrint(Protocol):
    """Samples of the field from which formats write a lattice without a surface, such as layers."""

    @property
    def words(self) -> str:
        """Kind, number and size of the samples, such as ``50 layers of 80 x 80 pixels``."""

    @property
    def sizes(self) -> Mapping[str, float]:
        """Sizes of the samples by their names in the result."""

    @property
    def printed_volume(self) -> float:
        """Volume that is printed, mm^3."""

    @property
    def dropped(self) -> int:
        """Number of disconnected components that were left out."""

    @property
    def dropped_share(self) -> float:
        """Their share of the solid volume before."""

    def axis_volumes(self) -> Sequence[tuple[FloatArray, FloatArray]]:
        """Middles ``(k,)`` mm of slices across x, y and z, and the volume ``(k,)`` mm^3 in each."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrintedLattice:
    """Printed lattice: its surface, the field behind that surface, and metadata for files.

    More attributes may follow; those that are there keep their meaning.

    Attributes
    ----------
    surface : SurfaceMesh
        Closed and outward oriented: ``vertices`` (n, 3) and ``faces`` (m, 3), in ``unit``. Where a
        verdict was reached, it is the surface that was judged. Empty where no format needs it.
    name : str
        Of the case.
    version : str
        Of gradedesign.
    case_hash : str
        SHA-256 of what the case asks for, as in ``result.json``.
    material : str or None
        Its name; None where the case states none.
    mass_g : float or None
        Of what the surface encloses, g; None where the case states no material.
    field : callable or None
        Points ``(3, ...)`` mm to values ``(...)``, about mm, negative inside the lattice; built
        when it is first called. Disconnected components, which the surface leaves out, are still in
        it.
    design : LatticeDesign or None
        Cells, density and part of which the field is made.
    bodies : int
        Connected components of the part: as many of the lattice are printed.
    layer_height, pixel_size : float or None, mm
        Of the printer, as far as the case states them.
    build_direction : str
        ``"+x"`` to ``"-z"``: what points upwards in the printer.
    part : SurfaceMesh or None
        The part that the lattice fills; its signed distance is ``design.domain.distance``.
    outer_records : bytes
        Of the surface's first triangles as the part's own binary STL holds them, 50 bytes each;
        empty where none are kept so.
    unit : str
        Always ``"mm"``.
    measured : MeasuredField or None
        What takes the place of the surface where none was made.
    sampled : SampledPrint or None
        Where an exporter's ``sample`` was called before.
    """

    surface: SurfaceMesh
    name: str
    version: str = ""
    case_hash: str = ""
    material: str | None = None
    mass_g: float | None = None
    field: Field | None = None
    design: LatticeDesign | None = None
    bodies: int = 1
    layer_height: float | None = None
    pixel_size: float | None = None
    build_direction: str = "+z"
    part: SurfaceMesh | None = None
    outer_records: bytes = b""
    unit: str = "mm"
    measured: MeasuredField | None = None
    sampled: SampledPrint | None = None

    @property
    def bounds(self) -> FloatArray:
        """Least and largest corner ``(2, 3)`` of the surface, mm; ``field`` is positive beyond.

        Of the part where no surface was made.
        """
        if self.measured is not None:
            return self.measured.bounds
        used = np.zeros(len(self.surface.vertices), dtype=bool)
        used[self.surface.faces] = True
        points = self.surface.vertices[used]
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @property
    def volume(self) -> float:
        """Inside the surface; inside the field where no surface was made, mm^3."""
        return enclosed_volume(self.surface) if self.measured is None else self.measured.volume

    @property
    def frame(self) -> FloatArray:
        """Axes of the machine as rows ``(3, 3)``, the build direction last."""
        return np.array(FRAMES[self.build_direction], dtype=np.float64)

    @property
    def metadata(self) -> dict[str, str]:
        """Metadata for a file as text, by name; empty entries are left out."""
        words = {
            "name": self.name,
            "unit": self.unit,
            "material": self.material or "",
            "mass_g": "" if self.mass_g is None else f"{self.mass_g:.6g}",
            "gradedesign": self.version,
            "case_hash": self.case_hash,
        }
        return {key: value for key, value in words.items() if value}

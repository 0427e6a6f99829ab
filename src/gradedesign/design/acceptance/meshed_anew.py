"""Body-fitted tetrahedra of the exported surface or a part of it, by the mesher of the case."""

from __future__ import annotations

import logging
from dataclasses import dataclass

from gradedesign.common.system.limits import Deadline
from gradedesign.errors import LatticeError, MeshError
from gradedesign.geometry.tets.meshed_surface import MeshedSurface, tetrahedralize
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.geometry.triangles.chord_tolerance import within_chord
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid

log = logging.getLogger(__name__)

#: Edge of the mesher's tetrahedra over the surface size of the explicit analysis. Chosen, not
#: measured.
EDGE_PER_SPACING = 1.2
#: Tetrahedra for each cube of solid with their edge: 14 where walls are two or three of them thick,
#: 25 where they are one (`cases/mini`).
_TETS_PER_CUBE = 18.0
#: The mesher's envelope as a share of the surface size. Chosen, not measured.
ENVELOPE = 0.06
#: Chord within which the surface is first given fewer triangles, as a share of the surface size:
#: the mesher keeps an envelope about each of them. Half of its own: 140 k triangles of gyroid
#: sheets became 41 k and 169 k tetrahedra 175 k in half the time, with a volume that was 0.0003 %
#: instead of 0.03 % off.
CHORD = 0.03
#: Where no mesh of that size passes the checks, one with edges and an envelope this much smaller is
#: tried: the volume that the envelope loses falls with it. Chosen: 3.4 times the tetrahedra are
#: still made in the time of the first mesh and its retries.
FINER = 1.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshedAnew:
    """A checked mesh of the inside of a surface."""

    mesh: TetMesh
    attempts: tuple[str, ...]  #: One line for each, those at a larger size included.
    seconds: float  #: Wall time.
    size: float  #: mm. Surface size of the mesh: the one that was asked for, or a smaller one.


def mesher_tets(volume: float, size: float) -> float:
    """Tetrahedra that the mesher is expected to make of a solid.

    ``volume``, mm^3. ``size``, mm: surface size of the explicit analysis.
    """
    return _TETS_PER_CUBE * volume / (EDGE_PER_SPACING * size) ** 3


def mesh_anew(
    surface: SurfaceMesh, solid: PrintedSolid, size: float, time_limit_s: float
) -> MeshedAnew:
    """Mesh the inside of a closed surface for acceptance.

    A mesh that fails its checks, of volume or shape, is made again with smaller tetrahedra, while
    there is time; the checks stay as they are. Raises `MeshError`, `ResourceError` as
    `tetrahedralize` does.

    - ``surface``: read back from the exported file
    - ``solid``: its mesher and memory
    - ``size``, mm: surface size of the explicit analysis: sets edge length and envelope
    - ``time_limit_s``, s: of the mesher
    """
    clock = Deadline(time_limit_s)
    failed: tuple[str, ...] = ()
    try:
        made = _meshed(surface, solid, size, time_limit_s)
    except MeshError as error:
        if clock.expired():
            raise
        log.warning("meshing with smaller tetrahedra: %s", error)
        failed, size = (f"tetrahedra of {EDGE_PER_SPACING * size:.3g} mm: {error}",), size / FINER
        try:
            made = _meshed(surface, solid, size, clock.remaining())
        except MeshError as again:
            words = f"{failed[0]}; tetrahedra of {EDGE_PER_SPACING * size:.3g} mm: {again}"
            raise MeshError(words) from again
    return MeshedAnew(
        mesh=made.mesh, attempts=(*failed, *made.attempts), seconds=clock.elapsed(), size=size
    )


def _meshed(
    surface: SurfaceMesh, solid: PrintedSolid, size: float, time_limit_s: float
) -> MeshedSurface:
    """Tetrahedra of one size, in all the ways of the mesher."""
    try:
        fewer = within_chord(surface, CHORD * size)
    except LatticeError as error:
        # The mesher takes any surface; with all its triangles it takes longer.
        log.info("meshed with all its triangles: %s", error)
        fewer = surface
    return tetrahedralize(
        fewer,
        edge_length=EDGE_PER_SPACING * size,
        epsilon=ENVELOPE * size,
        time_limit_s=time_limit_s,
        memory_limit_bytes=solid.memory,
        mesher=solid.mesher,
    )

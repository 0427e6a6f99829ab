"""Body-fitted tetrahedra of the exported surface or a part of it, by the mesher of the case."""

from __future__ import annotations

import logging

from gradedesign.errors import LatticeError
from gradedesign.mesh.chord_tolerance import within_chord
from gradedesign.mesh.meshed_surface import MeshedSurface, tetrahedralize
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.verify.printed_solid import PrintedSolid

log = logging.getLogger(__name__)

#: Edge of the mesher's tetrahedra over the surface size of the explicit analysis.
EDGE_PER_SPACING = 1.2
#: The mesher's envelope as a share of the surface size.
ENVELOPE = 0.06
#: Chord within which the surface is first given fewer triangles, as a share of the surface size:
#: the mesher keeps an envelope about each of them. Half of its own: 140 k triangles of gyroid
#: sheets became 41 k and 169 k tetrahedra 175 k in half the time, with a volume that was 0.0003 %
#: instead of 0.03 % off.
CHORD = 0.03


def mesh_anew(
    surface: SurfaceMesh, solid: PrintedSolid, size: float, time_limit_s: float
) -> MeshedSurface:
    """Mesh the inside of a closed surface for acceptance.

    Parameters
    ----------
    surface : SurfaceMesh
        Read back from the exported file.
    solid : PrintedSolid
        Its mesher, and the memory of its case.
    size : float, mm
        Surface size of the explicit analysis: sets edge length and envelope.
    time_limit_s : float, s
        Of the mesher.

    Raises
    ------
    MeshError, ResourceError
        As `tetrahedralize` does.
    """
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
        memory_limit_bytes=solid.case.run.memory,
        mesher=solid.mesher,
    )

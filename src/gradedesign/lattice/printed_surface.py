"""The surface that is printed, from a design."""

from __future__ import annotations

from gradedesign.lattice.islands import Islands, remove_islands
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.lattice.trim import trimmed_surface
from gradedesign.mesh.chord_tolerance import within_chord
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.workspace.progress import report_step


def printed_surface(
    design: LatticeDesign, part: SurfaceMesh, step: float, chord_tolerance: float | None
) -> tuple[SurfaceMesh, Islands]:
    """Closed surface of a lattice in a part, without disconnected components.

    Parameters
    ----------
    design : LatticeDesign
    part : SurfaceMesh
        As for `trimmed_surface`.
    step : float, mm
        Grid of the contour.
    chord_tolerance : float or None, mm
        Fewer triangles within this distance; None: those of the contour.

    Raises
    ------
    LatticeError
        As `trimmed_surface`, `remove_islands` and `within_chord`.
    """
    raw = trimmed_surface(design, part, step)
    report_step("disconnected components of the surface")
    surface, islands = remove_islands(
        raw, keep=design.domain.bodies, least_pocket=(0.5 * step) ** 3
    )
    del raw
    if chord_tolerance is not None:
        surface = within_chord(surface, chord_tolerance)
    return surface, islands

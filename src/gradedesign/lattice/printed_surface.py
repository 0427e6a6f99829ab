"""The surface that is printed, from a design."""

from __future__ import annotations

from gradedesign.lattice.internal_surface import (
    LEAST_DEPTH,
    appended,
    internal_of,
    require_thick_skin,
    surface_behind_skin,
)
from gradedesign.lattice.islands import Islands, remove_islands
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.lattice.trim import trimmed_surface
from gradedesign.mesh.chord_tolerance import within_chord
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.workspace.progress import report_step


def printed_surface(
    design: LatticeDesign,
    part: SurfaceMesh,
    step: float,
    chord_tolerance: float | None,
    *,
    keep_outer: bool = False,
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
    keep_outer : bool
        Whether the part's triangles stay as they are, first in the surface, see
        `surface_behind_skin`.

    Raises
    ------
    LatticeError
        As `trimmed_surface`, `surface_behind_skin`, `remove_islands` and `within_chord`.
    """
    raw = (surface_behind_skin if keep_outer else trimmed_surface)(design, part, step)
    report_step("disconnected components of the surface")
    surface, islands = remove_islands(
        raw, keep=design.domain.bodies, least_pocket=(0.5 * step) ** 3
    )
    del raw
    if keep_outer:
        internal = internal_of(surface, part)
        if chord_tolerance is not None and len(internal.faces):
            least = LEAST_DEPTH * step + chord_tolerance
            require_thick_skin(design.domain, least, "a grid step and the chord tolerance")
            internal = within_chord(internal, chord_tolerance)
        return appended(part, internal), islands
    if chord_tolerance is not None:
        surface = within_chord(surface, chord_tolerance)
    return surface, islands

"""The printed surface with the part's own faces: contour the lattice, then cut it with the part."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.lattice.domain import grown
from gradedesign.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.lattice.surface import extract_surface, require_closed
from gradedesign.mesh.boolean import intersection
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.workspace.progress import stepping

#: The lattice is contoured this many grid steps beyond the part before it is cut.
OVERHANG = 2.0
#: Edges shorter than this share of the grid step are collapsed after the cut: single precision
#: files cannot hold them apart.
SHORTEST = 0.02


def trimmed_surface(design: LatticeDesign, part: SurfaceMesh, step: float) -> SurfaceMesh:
    """Closed surface of a lattice whose outer faces are exactly those of the part.

    Contouring the trimmed field would chamfer every edge between a wall and the part's faces by
    half a grid step. Here the lattice is contoured a little beyond the part and then cut by the
    part's own triangles, so faces stay flat and edges sharp.

    Parameters
    ----------
    design : LatticeDesign
    part : SurfaceMesh
        Closed and outward oriented; its signed distance is ``design.domain.distance``.
    step : float, mm
        Grid of the contour.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    LatticeError
        If the lattice has no solid, or the result is not closed.
    MeshError
        If the Boolean kernel refuses a surface or nothing is left.
    """
    overhang = OVERHANG * step
    untrimmed = replace(design, domain=grown(design.domain, overhang))
    field = lattice_field(untrimmed, band=3 * step, single=True)
    with stepping(f"contouring at {step:.3g} mm"):
        raw = extract_surface(
            field, untrimmed.domain.lower - step, untrimmed.domain.upper + step, step
        )
    with stepping(f"cutting {len(raw.faces)} triangles with the part"):
        trimmed = intersection(raw, part, what="printed surface", shortest=SHORTEST * step)
    require_closed(trimmed)
    return trimmed

"""Body-fitted tetrahedra of a lattice design, on a grid that follows its thinnest wall."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import MeshError, ResourceError
from gradedesign.fe.solve import predict_memory_bytes
from gradedesign.lattice.islands import largest_piece
from gradedesign.lattice.lattice import LatticeDesign, body_field, lattice_field
from gradedesign.mesh.quality import TetReport, tet_report
from gradedesign.mesh.sharpen import sharpen
from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.workspace.progress import counted, report_step, stepping

log = logging.getLogger(__name__)

#: Loose pieces may hold this share of the volume before the mesh is refused.
LOOSE_SHARE = 0.01
#: The mesh's volume may differ from the field's by this share.
VOLUME_TOLERANCE = 0.04
#: Points per cube edge when the field's volume is counted.
VOLUME_SAMPLES = 3
#: Smallest dihedral angle that is accepted, degrees.
LEAST_DIHEDRAL = 5.0
#: Quadratic dofs per tetrahedron of a thin-walled lattice, measured 5.6 to 5.8.
DOFS_PER_TET = 5.8
#: Tetrahedra per solid volume of one grid cube: twelve of the body-centred grid, and what
#: the cuts at the surface add (measured 1.1 to 1.4).
TETS_PER_CUBE = 12.0 * 1.4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExplicitMesh:
    """Tetrahedra of a lattice with what was checked on them.

    Attributes
    ----------
    mesh : TetMesh
    report : TetReport
    cube : float, mm
        Edge of the grid cubes.
    dropped_pieces : int
    dropped_share : float
        Volume share of the loose pieces that were removed.
    field_volume : float, mm^3
        Volume of the field by sampling.
    """

    mesh: TetMesh
    report: TetReport
    cube: float
    dropped_pieces: int
    dropped_share: float
    field_volume: float


def mesh_lattice(design: LatticeDesign, cube: float, *, memory_limit_bytes: float) -> ExplicitMesh:
    """Mesh a design by isosurface stuffing and refuse what lost pieces or volume.

    Parameters
    ----------
    design : LatticeDesign
    cube : float, mm
        Edge of the grid cubes; the thinnest wall should span at least 1.25 of them.
    memory_limit_bytes : float
        Budget that the following solve must fit.

    Raises
    ------
    ResourceError
        If the solve would not fit the memory budget.
    MeshError
        If pieces, volume or angles are out of their gates.
    """
    cube = fitted_cube(design, cube)
    lower, shape = grid_for(design, cube)
    field = lattice_field(design, band=3 * cube)
    with stepping(f"volume of the lattice at {cube:.3g} mm"):
        volume = field_volume(design, cube)
    _require_memory(volume, cube, memory_limit_bytes)
    with stepping(f"meshing the lattice at {cube:.3g} mm"):
        stuffed = stuff(field, lower, shape, cube)
        report_step("sharp edges")
        raw = sharpen(stuffed, design.part, body_field(design), cube)
        report_step("loose pieces")
        mesh, dropped, share = largest_piece(raw, max_share=LOOSE_SHARE)
        report_step("quality")
        report = tet_report(mesh)
    _require_gates(report, volume * (1 - share), cube)
    log.info("lattice mesh: %d tets, cube %.3g mm, %d loose pieces", report.count, cube, dropped)
    return ExplicitMesh(
        mesh=mesh,
        report=report,
        cube=cube,
        dropped_pieces=dropped,
        dropped_share=share,
        field_volume=volume,
    )


def fitted_cube(design: LatticeDesign, cube: float) -> float:
    """Largest cube, at most 12 % below the asked one, that divides the design's box best, mm.

    Faces of the part on grid planes come out flat and sharp; others are chamfered by a third of
    a cube where they meet.
    """
    size = np.asarray(design.upper) - np.asarray(design.lower)
    candidates = cube * np.linspace(1.0, 0.88, 241)
    count = size[:, None] / candidates
    misfit = np.abs(count - np.round(count)).max(axis=0)
    good = misfit <= max(float(misfit.min()), 1e-3) * 1.0001
    return float(_exact_division(size, candidates[good][0]))


def _exact_division(size: FloatArray, cube: float) -> float:
    """Nudge a cube so that it divides the axis it misses least exactly."""
    count = size / cube
    whole = np.maximum(np.round(count), 1)
    best = int(np.argmin(np.abs(count - whole)))
    return float(size[best] / whole[best])


def grid_for(design: LatticeDesign, cube: float) -> tuple[FloatArray, tuple[int, int, int]]:
    """Grid that covers the design with two cubes to spare, with nodes on its lower faces."""
    lower = np.asarray(design.lower) - 2 * cube
    count = np.ceil((np.asarray(design.upper) - np.asarray(design.lower)) / cube).astype(int) + 4
    return lower, (int(count[0]), int(count[1]), int(count[2]))


def field_volume(design: LatticeDesign, cube: float) -> float:
    """Volume of the solid by counting points of a grid twice as fine as the mesh's, mm^3."""
    step = cube / VOLUME_SAMPLES
    field = lattice_field(design, band=2 * cube)
    lower, shape = grid_for(design, cube)
    # An irrational offset keeps grid planes off the flat faces of the part.
    axes = [
        lower[d] + step * (np.arange(VOLUME_SAMPLES * shape[d]) + 1 / np.sqrt(7)) for d in range(3)
    ]
    inside = 0
    for x in counted(axes[0], "layer", len(axes[0])):
        grid = np.stack(np.meshgrid([x], axes[1], axes[2], indexing="ij"))
        inside += int(np.count_nonzero(field(grid) < 0))
    return inside * step**3


def _require_memory(volume: float, cube: float, limit: float) -> None:
    dofs = int(TETS_PER_CUBE * volume / cube**3 * DOFS_PER_TET)
    need = predict_memory_bytes(dofs, 2)
    if need > limit:
        coarser = cube * (need / limit) ** (1 / 3)
        raise ResourceError(
            f"the explicit analysis needs about {dofs / 1e6:.2g} M unknowns and "
            f"{need / 1e9:.3g} GB at a grid of {cube:.3g} mm, but [run] memory is "
            f"{limit / 1e9:.3g} GB; allow more memory, raise the lower density, or use larger "
            f"cells (a grid of {coarser:.3g} mm would fit)"
        )


def _require_gates(report: TetReport, volume: float, cube: float) -> None:
    off = report.volume / volume - 1.0
    if abs(off) > VOLUME_TOLERANCE:
        raise MeshError(
            f"the lattice mesh holds {report.volume:.6g} mm^3, the field {volume:.6g} mm^3 "
            f"({off:+.1%}, allowed {VOLUME_TOLERANCE:.0%}); the grid of {cube:.3g} mm is too "
            f"coarse for the walls: raise [run] mesh_cubes_per_wall or the lower density"
        )
    if report.inverted or report.min_dihedral < LEAST_DIHEDRAL:
        raise MeshError(
            f"the lattice mesh has {report.inverted} inverted tetrahedra and a smallest dihedral "
            f"angle of {report.min_dihedral:.2f} degrees, expected none and at least "
            f"{LEAST_DIHEDRAL:g}; change [run] mesh_cubes_per_wall slightly"
        )

"""Body-fitted tetrahedra of a lattice design, on a grid that follows its thinnest wall.

A grid that loses volume or components, or makes flat tetrahedra, is refined as far as the memory
budget goes. Above 300 lines: the size of the grid and the gates of its mesh depend on each other.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray
from gradedesign.errors import MeshError, ResourceError
from gradedesign.fe.solve import predict_memory_bytes
from gradedesign.lattice.islands import largest_components
from gradedesign.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.mesh.quality import TetReport, tet_report
from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.verify.sharp_edges import sharpen
from gradedesign.workspace.progress import counted, report_step, stepping

log = logging.getLogger(__name__)

#: Disconnected components may hold this share of the volume before the mesh is refused.
DISCONNECTED_SHARE = 0.01
#: The mesh's volume may differ from the field's by this share.
VOLUME_TOLERANCE = 0.04
#: Points per grid spacing when the field's volume is counted.
VOLUME_SAMPLES = 3
#: Of the places of these points, the same in every run.
VOLUME_SEED = 2007
#: Smallest dihedral angle that is accepted, degrees.
LEAST_DIHEDRAL = 5.0
#: Share of the allowed volume error that a refined grid aims at; errors fall as spacing squared.
AIM = 0.6
#: A refined spacing over the last one: neither so little that meshing is repeated for nothing, nor
#: so much that the budget is missed where less would have done.
LEAST_STEP, LARGEST_STEP = 0.85, 0.55
#: Step of refinement where the volume error cannot set it.
PLAIN_STEP = 0.8
#: Quadratic dofs per tetrahedron of a lattice: measured 4.8 to 5.1 of struts and thick walls, 5.6
#: to 5.8 of thin ones.
DOFS_PER_TET = 5.4
#: Tetrahedra per solid volume of one grid cell: twelve of the body-centred grid, and what the cuts
#: at the surface add (measured 1.1 to 1.4). What a mesh really has is counted before it is solved.
TETS_PER_GRID_CELL = 14.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExplicitMesh:
    """Tetrahedra of a lattice with what was checked on them.

    Attributes
    ----------
    mesh : TetMesh
    report : TetReport
    spacing : float, mm
        Grid spacing.
    requested : float, mm
        The edge before it was fitted to the box of the part.
    dropped_components : int
    dropped_share : float
        Volume share of the disconnected components that were removed.
    refused : tuple of str
        Faults of the coarser grids that were tried first.
    """

    mesh: TetMesh
    report: TetReport
    spacing: float
    requested: float
    dropped_components: int
    dropped_share: float
    refused: tuple[str, ...] = ()


class CoarseGridError(MeshError):
    """A grid on which the lattice lost volume or components, or became flat tetrahedra.

    Attributes
    ----------
    step : float
        Spacing that should do, over the one that did not.
    disconnected, volume : float
        Share of the volume in disconnected components, and by which the volume is off; 0 where
        another gate failed.
    """

    def __init__(
        self, message: str, *, step: float, disconnected: float = 0.0, volume: float = 0.0
    ) -> None:
        super().__init__(message)
        self.step = step
        self.disconnected = disconnected
        self.volume = volume


class LargeGridError(ResourceError):
    """A mesh that was made and has more tetrahedra than the memory can solve.

    Attributes
    ----------
    step : float
        Spacing that should fit, over the one that did not.
    """

    def __init__(self, message: str, *, step: float) -> None:
        super().__init__(message)
        self.step = step


def predict_unknowns(solid_volume: float, spacing: float) -> int:
    """Predict the unknowns of quadratic tetrahedra on a grid.

    Parameters
    ----------
    solid_volume : float, mm^3
    spacing : float, mm
        Grid spacing.
    """
    return int(TETS_PER_GRID_CELL * solid_volume / spacing**3 * DOFS_PER_TET)


def fitting_spacing(solid_volume: float, memory_limit_bytes: float) -> float:
    """Smallest grid spacing whose solve fits the memory, mm; infinite where nothing fits."""
    room = memory_limit_bytes - predict_memory_bytes(0, 2)
    if room <= 0:
        return np.inf
    each = (predict_memory_bytes(10**6, 2) - predict_memory_bytes(0, 2)) / 1e6
    cells = room / (each * TETS_PER_GRID_CELL * DOFS_PER_TET)
    # A little above, so that a spacing nudged to divide the part's box still fits.
    return float(1.01 * (solid_volume / cells) ** (1 / 3))


def mesh_lattice(
    design: LatticeDesign, spacing: float, *, memory_limit_bytes: float, bodies: int = 1
) -> ExplicitMesh:
    """Mesh a design by isosurface stuffing; a grid that loses components or volume is refused.

    Parameters
    ----------
    design : LatticeDesign
    spacing : float, mm
        Grid spacing; the thinnest wall should span at least 1.25 of them.
    memory_limit_bytes : float
        Budget that the following solve must fit.
    bodies : int
        Of the part: as many components are kept.

    Raises
    ------
    ResourceError
        If the solve would not fit the memory budget.
    CoarseGridError
        If components, volume or angles are out of their gates.
    """
    box = design.domain.upper - design.domain.lower
    with stepping("volume of the lattice"):
        volume = field_volume(design, dividing_spacing(box, spacing))
    _require_memory(volume, spacing, memory_limit_bytes)
    requested, spacing = (
        spacing,
        dividing_spacing(box, spacing, fitting_spacing(volume, memory_limit_bytes)),
    )
    lower, shape = grid_for(design, spacing)
    field = lattice_field(design, band=3 * spacing)
    with stepping(f"meshing the lattice at {spacing:.3g} mm"):
        stuffed = stuff(field, lower, shape, spacing)
        report_step("sharp edges")
        raw = sharpen(stuffed, design, spacing)
        report_step("disconnected components")
        mesh, dropped, share = _main_components(raw, bodies)
        report_step("quality")
        report = tet_report(mesh)
    _require_gates(report, volume * (1 - share), spacing)
    _require_solve(report.count, spacing, memory_limit_bytes)
    log.info(
        "lattice mesh: %d tets, grid %.3g mm, dropped %d components", report.count, spacing, dropped
    )
    return ExplicitMesh(
        mesh=mesh,
        report=report,
        spacing=spacing,
        requested=requested,
        dropped_components=dropped,
        dropped_share=share,
    )


def _main_components(raw: TetMesh, bodies: int) -> tuple[TetMesh, int, float]:
    """Largest component of every body; more than fragments beside it may be the grid's fault."""
    if raw.tets.shape[1] == 0:
        raise CoarseGridError("no tetrahedron is left on this grid", step=PLAIN_STEP)
    mesh, dropped, share = largest_components(raw, keep=bodies, max_share=1.0)
    if share > DISCONNECTED_SHARE:
        raise CoarseGridError(
            f"the lattice falls apart: {dropped} disconnected components hold {share:.2%} "
            f"of its volume, at most {DISCONNECTED_SHARE:.0%} may be dropped",
            step=PLAIN_STEP,
            disconnected=share,
        )
    return mesh, dropped, share


def dividing_spacing(box: ArrayLike, spacing: float, least: float = 0.0) -> float:
    """Largest grid spacing, at most 12 % below the requested one, that divides a box best, mm.

    Faces of the part on grid planes come out flat and sharp; others are chamfered by a third of
    a spacing where they meet. ``box`` holds its edges, ``(3,)``, mm; ``least`` is the smallest
    spacing that the memory holds, mm.
    """
    size = np.asarray(box, dtype=np.float64)
    candidates = spacing * np.linspace(1.0, min(max(0.88, least / spacing), 1.0), 241)
    count = size[:, None] / candidates
    misfit = np.abs(count - np.round(count)).max(axis=0)
    good = misfit <= max(float(misfit.min()), 1e-3) * 1.0001
    return float(_exact_division(size, candidates[good][0]))


def _exact_division(size: FloatArray, spacing: float) -> float:
    """Grid spacing changed so that it divides exactly the axis it nearly divides."""
    count = size / spacing
    whole = np.maximum(np.round(count), 1)
    best = int(np.argmin(np.abs(count - whole)))
    return float(size[best] / whole[best])


def grid_for(design: LatticeDesign, spacing: float) -> tuple[FloatArray, tuple[int, int, int]]:
    """Grid that covers the design with two spacings to spare, with nodes on its lower faces."""
    lower = np.asarray(design.domain.lower) - 2 * spacing
    count = (
        np.ceil(
            (np.asarray(design.domain.upper) - np.asarray(design.domain.lower)) / spacing
        ).astype(int)
        + 4
    )
    return lower, (int(count[0]), int(count[1]), int(count[2]))


def field_volume(design: LatticeDesign, spacing: float) -> float:
    """Volume of the solid by counting points, mm^3.

    One point in a random place of every cell of a grid three times as fine as the mesh's: walls
    that lie along grid planes are counted without bias, whatever their distance from the planes.
    """
    step = spacing / VOLUME_SAMPLES
    field = lattice_field(design, band=2 * spacing)
    lower, shape = grid_for(design, spacing)
    count = [VOLUME_SAMPLES * n for n in shape]
    random = np.random.default_rng(VOLUME_SEED)
    y, z = np.meshgrid(np.arange(count[1]), np.arange(count[2]), indexing="ij")
    inside = 0
    for i in counted(range(count[0]), "layer", count[0]):
        corner = np.stack([np.full(y.shape, i), y, z]).astype(np.float64)
        points = corner + random.random(corner.shape)
        points = np.asarray(lower)[:, None, None] + step * points
        inside += int(np.count_nonzero(field(points[:, None]) < 0))
    return inside * step**3


def _require_memory(volume: float, spacing: float, limit: float) -> None:
    dofs = predict_unknowns(volume, spacing)
    need = predict_memory_bytes(dofs, 2)
    if need > limit:
        coarser = fitting_spacing(volume, limit)
        raise ResourceError(
            f"the explicit analysis needs about {dofs / 1e6:.2g} M unknowns and "
            f"{need / 1e9:.3g} GB at a grid of {spacing:.3g} mm, but [run] memory is "
            f"{limit / 1e9:.3g} GB; allow more memory, raise the lower density, or use larger "
            f"cells (a grid of {coarser:.3g} mm would fit)"
        )


def _require_solve(tets: int, spacing: float, limit: float) -> None:
    """Refuse a mesh whose solve does not fit: thin walls have more tetrahedra than predicted."""
    need = predict_memory_bytes(int(tets * DOFS_PER_TET), 2)
    if need > limit:
        raise LargeGridError(
            f"the lattice mesh of {tets} tetrahedra on a grid of {spacing:.3g} mm takes "
            f"{need / 1e9:.3g} GB to solve, but [run] memory is {limit / 1e9:.3g} GB; allow more "
            f"memory, raise the lower density, or use larger cells",
            step=1.02 * (need / limit) ** (1 / 3),
        )


def _require_gates(report: TetReport, volume: float, spacing: float) -> None:
    off = report.volume / volume - 1.0
    if abs(off) > VOLUME_TOLERANCE:
        raise CoarseGridError(
            f"the lattice mesh holds {report.volume:.6g} mm^3, the field {volume:.6g} mm^3 "
            f"({off:+.1%}, allowed {VOLUME_TOLERANCE:.0%}): the grid of {spacing:.3g} mm is too "
            f"coarse for the walls",
            step=float(
                np.clip(np.sqrt(AIM * VOLUME_TOLERANCE / abs(off)), LARGEST_STEP, LEAST_STEP)
            ),
            volume=abs(off),
        )
    if report.inverted or report.min_dihedral < LEAST_DIHEDRAL:
        raise CoarseGridError(
            f"the lattice mesh on a grid of {spacing:.3g} mm has {report.inverted} inverted "
            f"tetrahedra and a smallest dihedral angle of {report.min_dihedral:.2f} degrees, "
            f"expected none and at least {LEAST_DIHEDRAL:g}",
            step=LEAST_STEP,
        )

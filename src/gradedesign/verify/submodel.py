"""A window of the exported surface, meshed anew and driven by the explicit displacements.

Above 300 lines: cut, mesh, drive and compare are one method, and nothing else uses its parts.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.errors import MeshError
from gradedesign.fe.element_points import element_points
from gradedesign.fe.facets import facet_nodes
from gradedesign.fe.field_eval import interpolate
from gradedesign.fe.linear_solver import LinearSolver
from gradedesign.fe.multigrid_solver import MULTIGRID
from gradedesign.fe.solution import LoadVector
from gradedesign.fe.solve import solve_elastic
from gradedesign.fe.space import TetSpace, tet_space
from gradedesign.fe.stiffness import IsotropicStiffness
from gradedesign.fe.stress import element_stress, von_mises, weighted_percentile
from gradedesign.fe.supports import Supports
from gradedesign.material.material import Material
from gradedesign.mesh.meshed_surface import tetrahedralize
from gradedesign.mesh.point_location import locate
from gradedesign.mesh.quality import piece_labels
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.mesh.tet_mesh import TetMesh, boundary_facets, signed_volumes
from gradedesign.verify.explicit import ExplicitResult
from gradedesign.verify.windows import (
    Window,
    clip_surface,
    cut_facets,
    inside_cube,
    window_box,
)
from gradedesign.workspace.progress import report_step

log = logging.getLogger(__name__)

#: Boundary force and strain energy must match the driving analysis to this share.
MATCH = 0.03
#: Share of a window's cut nodes that may find no driving displacement.
MOST_UNDRIVEN = 0.05
#: The mesher's envelope as a share of the explicit mesh's cubes.
ENVELOPE = 0.06


@dataclass(frozen=True, slots=True, kw_only=True)
class SubmodelResult:
    """One window, analysed on pytetwild's mesh of the exported surface.

    Attributes
    ----------
    window : Window
    value : float, MPa
        Stress percentile in the judged cube.
    driving_value : float, MPa
        The same percentile of the driving analysis in the same cube.
    force_gap, energy_gap : float
        Relative difference of cut-face forces and strain energy from the driving analysis.
    matches : bool
        Both gaps are within 3 %.
    volume : float, mm^3
        Solid in the judged cube.
    tets : int
    mesh_size : float, mm
    attempts : tuple of str
    seconds : float
        Of the mesher.
    """

    window: Window
    value: float
    driving_value: float
    force_gap: float
    energy_gap: float
    matches: bool
    volume: float
    tets: int
    mesh_size: float
    attempts: tuple[str, ...]
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GaussField:
    """Stress and energy at the Gauss points of a mesh, flattened over elements.

    Attributes
    ----------
    points : (3, n) array, mm
    weights : (n,) array, mm^3
    stress : (3, 3, n) array, MPa
    energy : (n,) array, N/mm^2
        Strain energy per volume.
    """

    points: FloatArray
    weights: FloatArray
    stress: FloatArray
    energy: FloatArray


def analyse_window(
    surface: SurfaceMesh,
    window: Window,
    explicit: ExplicitResult,
    material: Material,
    *,
    percentile: float,
    time_limit_s: float,
    memory_limit_bytes: float,
    solver: LinearSolver = MULTIGRID,
) -> SubmodelResult:
    """Cut, mesh, drive and compare one window.

    Parameters
    ----------
    surface : SurfaceMesh
        The exported surface, read back.
    window : Window
    explicit : ExplicitResult
        Drives the window; its grid sets edge length and envelope.
    material : Material
    percentile : float
    time_limit_s : float
    memory_limit_bytes : float
    solver : LinearSolver

    Returns
    -------
    SubmodelResult
    """
    driving, cube = explicit.space, explicit.mesh_size
    displacement = next(s.displacement for s in explicit.solutions if s.name == window.load_case)
    lower, upper = window_box(window)
    report_step("clipping")
    clipped = clip_surface(surface, lower, upper)
    envelope = ENVELOPE * cube
    meshed = tetrahedralize(
        clipped,
        edge_length=1.2 * cube,
        epsilon=envelope,
        time_limit_s=time_limit_s,
        memory_limit_bytes=int(memory_limit_bytes),
    )
    report_step("driving nodes")
    mesh = _held_pieces(meshed.mesh, driving, lower, upper, 2 * envelope, cube)
    space = tet_space(mesh, 2)
    supports = _driven_supports(space, driving, displacement, lower, upper, envelope, cube)
    stiffness = _solid(space, material)
    solution = solve_elastic(
        space,
        stiffness,
        [LoadVector(name="window", supports=supports, force=np.zeros(space.nodes.shape))],
        solver=solver,
    )[0]
    report_step("comparing stress and energy")
    fine = gauss_field(space, stiffness, solution.displacement)
    coarse = _window_field(driving, displacement, material, lower, upper)
    force_gap = _force_gap(fine, coarse, lower, upper, cube)
    energy = [float((f.weights * f.energy).sum()) for f in (fine, coarse)]
    energy_gap = abs(energy[0] / energy[1] - 1.0)
    return SubmodelResult(
        window=window,
        value=_percentile(fine, window, percentile),
        driving_value=_percentile(coarse, window, percentile),
        force_gap=force_gap,
        energy_gap=energy_gap,
        matches=force_gap <= MATCH and energy_gap <= MATCH,
        volume=float(fine.weights[inside_cube(fine.points, window)].sum()),
        tets=mesh.tets.shape[1],
        mesh_size=1.2 * cube,
        attempts=meshed.attempts,
        seconds=meshed.seconds,
    )


def gauss_field(
    space: TetSpace, stiffness: IsotropicStiffness, displacement: FloatArray
) -> GaussField:
    """Stress and energy density at the four Gauss points of every element."""
    stress = element_stress(space, stiffness, displacement)
    points = element_points(space)
    weights = np.repeat(signed_volumes(space.mesh)[:, None] / 4.0, 4, axis=1)
    e, nu = stiffness.E[:, None], stiffness.nu
    trace = np.einsum("iimq->mq", stress)
    square = np.einsum("ijmq,ijmq->mq", stress, stress)
    energy = ((1 + nu) * square - nu * trace**2) / (2 * e)
    return GaussField(
        points=points.reshape(3, -1),
        weights=weights.ravel(),
        stress=stress.reshape(3, 3, -1),
        energy=energy.ravel(),
    )


def _solid(space: TetSpace, material: Material) -> IsotropicStiffness:
    return IsotropicStiffness(
        E=np.full(space.element_count, material.youngs_modulus), nu=material.poissons_ratio
    )


def _window_field(
    driving: TetSpace,
    displacement: FloatArray,
    material: Material,
    lower: FloatArray,
    upper: FloatArray,
) -> GaussField:
    """Gauss points of the driving analysis inside the window's box."""
    corners = driving.mesh.points[:, driving.mesh.tets]
    touching = np.all(
        (corners.max(axis=1) > lower[:, None]) & (corners.min(axis=1) < upper[:, None]), axis=0
    )
    chosen = np.flatnonzero(touching)
    used, local = np.unique(driving.mesh.tets[:, chosen], return_inverse=True)
    mesh = TetMesh(points=driving.mesh.points[:, used], tets=np.asarray(local).reshape(4, -1))
    nodes, inverse = np.unique(driving.elements[:, chosen], return_inverse=True)
    part = TetSpace(
        mesh=mesh,
        order=2,
        nodes=driving.nodes[:, nodes],
        elements=np.asarray(inverse, dtype=np.int32).reshape(10, -1),
    )
    field = gauss_field(part, _solid(part, material), displacement[:, nodes])
    inside = np.all((field.points >= lower[:, None]) & (field.points <= upper[:, None]), axis=0)
    return GaussField(
        points=field.points[:, inside],
        weights=field.weights[inside],
        stress=field.stress[:, :, inside],
        energy=field.energy[inside],
    )


def _held_pieces(
    mesh: TetMesh,
    driving: TetSpace,
    lower: FloatArray,
    upper: FloatArray,
    tolerance: float,
    reach: float,
) -> TetMesh:
    """Drop pieces that the driving analysis does not hold: they carry nothing."""
    labels = piece_labels(mesh)
    facets, _ = boundary_facets(mesh)
    cut, _ = cut_facets(mesh.points, facets, lower, upper, tolerance)
    vertices = np.unique(cut)
    if len(vertices) == 0:
        raise MeshError("the window's mesh reaches none of its cut planes; nothing drives it")
    _, _, distance = locate(driving.mesh, mesh.points[:, vertices])
    driven = np.zeros(mesh.points.shape[1], dtype=bool)
    driven[vertices[distance <= reach]] = True
    held = np.bincount(labels, weights=driven[mesh.tets].sum(axis=0)) >= 3
    keep = held[labels]
    if keep.all():
        return mesh
    if not keep.any():
        raise MeshError("no piece of the window's mesh meets the driving mesh on a cut plane")
    used, local = np.unique(mesh.tets[:, keep], return_inverse=True)
    return TetMesh(points=mesh.points[:, used], tets=np.asarray(local).reshape(4, -1))


def _driven_supports(
    space: TetSpace,
    driving: TetSpace,
    displacement: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    envelope: float,
    cube: float,
) -> Supports:
    """Displacements of the explicit analysis on the window's cut faces.

    Nodes farther than a cube from the driving mesh stay free: it chamfers thin rims there. They
    may be a twentieth of the cut faces' nodes.
    """
    facets, _ = boundary_facets(space.mesh)
    cut, _ = cut_facets(space.mesh.points, facets, lower, upper, 2 * envelope)
    nodes = np.unique(facet_nodes(space, cut))
    tets, barycentric, distance = locate(driving.mesh, space.nodes[:, nodes])
    near = distance <= cube
    if np.mean(near) < 1 - MOST_UNDRIVEN:
        raise MeshError(
            f"{np.mean(~near):.1%} of the cut faces' nodes lie more than a cube of {cube:.3g} mm "
            f"outside the driving mesh, up to {distance.max():.3g} mm; at most "
            f"{MOST_UNDRIVEN:.0%} may; raise [run] mesh_cubes_per_wall"
        )
    value = np.zeros(space.nodes.shape)
    value[:, nodes[near]] = interpolate(driving, displacement, tets[near], barycentric[:, near])
    fixed = np.zeros(space.nodes.shape, dtype=bool)
    fixed[:, nodes[near]] = True
    return Supports(fixed=fixed, value=value)


def _slab_force(field: GaussField, inside: BoolArray, axis: int, thickness: float) -> FloatArray:
    """Force through a plane as the mean over a slab behind it, ``(3,)``, N."""
    return field.stress[:, axis][:, inside] @ field.weights[inside] / thickness


def _force_gap(
    fine: GaussField, coarse: GaussField, lower: FloatArray, upper: FloatArray, cube: float
) -> float:
    """Difference of the forces through the six cut planes over the largest of them."""
    thickness = 2 * cube
    gaps, sizes = [], []
    for axis in range(3):
        for bound, sign in ((lower[axis], 1.0), (upper[axis], -1.0)):
            forces = []
            for field in (fine, coarse):
                depth = sign * (field.points[axis] - bound)
                forces.append(
                    _slab_force(field, (depth >= 0) & (depth <= thickness), axis, thickness)
                )
            gaps.append(float(np.linalg.norm(forces[0] - forces[1])))
            sizes.append(float(np.linalg.norm(forces[1])))
    return max(gaps) / max(sizes) if max(sizes) > 0 else float("inf")


def _percentile(field: GaussField, window: Window, percentile: float) -> float:
    inside = inside_cube(field.points, window)
    if not inside.any():
        raise MeshError(f"the window at {window.centre} mm holds no material to judge")
    return weighted_percentile(
        von_mises(field.stress[:, :, inside]), field.weights[inside], percentile
    )

"""Apparent stiffness of the piece of a voxel image inside a tetrahedron.

For pieces that do not repeat: graded cells, transitions, noise. The boundary follows a uniform
strain, so the result is an upper estimate that falls with the number of cells inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign import SolverError
from gradedesign.fields import BoolArray, FloatArray
from gradedesign.properties import (
    unit_load,
)
from gradedesign_laboratory.constrained import Block, block_nodes, padded_block, solve_held
from gradedesign_laboratory.macro_element import (
    recover_stiffness,
    shape_values,
    strain_matrix,
    unit_strain_tests,
)

#: Nodes this near to a face of the tetrahedron, in voxel edges, follow its corners: half a voxel's
#: diagonal, so that no node of a voxel cut by a face is free. With 0.5 solid comes out 2 % soft.
TOLERANCE = 0.87


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MacroTet:
    """Apparent stiffness of a tetrahedron full of voxels.

    Attributes
    ----------
    stiffness : (6, 6) array
        Over the base material's Young's modulus, Voigt order with engineering shear.
    solid : float
        Share of the cropped volume that is solid.
    residual : float
        Largest of the six tests.
    """

    stiffness: FloatArray
    solid: float
    residual: float


def face_distance(vertices: FloatArray, points: FloatArray) -> FloatArray:
    """Distance of points ``(3, ...)`` to the nearest face plane, positive inside, ``(...)``."""
    slopes, _ = strain_matrix(vertices)
    # Height over face k is the k-th shape function over the length of its slope.
    slope = np.stack([slopes[0, 0::3], slopes[1, 1::3], slopes[2, 2::3]])
    height = shape_values(vertices, points) / np.linalg.norm(slope, axis=0).reshape(
        (4,) + (1,) * (points.ndim - 1)
    )
    return np.asarray(height.min(axis=0))


def crop_to_tet(fill: FloatArray, vertices: FloatArray) -> FloatArray:
    """Set an image to void outside a tetrahedron.

    Parameters
    ----------
    fill : (nx, ny, nz) array
    vertices : (3, 4) array
        In voxel edges, voxel i between i and i + 1.

    Returns
    -------
    (nx, ny, nz) array
        The lesser of the fill and the voxel's share in the tetrahedron, so that void near a face
        stays void.
    """
    axes = [np.arange(n) + 0.5 for n in fill.shape]
    centre = np.stack(np.meshgrid(*axes, indexing="ij"))
    inside = np.clip(face_distance(vertices, centre) + 0.5, 0.0, 1.0)
    return np.minimum(fill, inside)


def macro_tet(
    fill: FloatArray,
    vertices: FloatArray,
    *,
    poissons_ratio: float = 0.3,
    rtol: float = 1e-5,
) -> MacroTet:
    """Recover the stiffness of a tetrahedron from six virtual tests on its voxels.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        Image that holds the tetrahedron.
    vertices : (3, 4) array
        In voxel edges.

    Raises
    ------
    SolverError
        If the tetrahedron is flat or reaches out of the image, or a solve does not converge.
    """
    corners = np.asarray(vertices, dtype=np.float64)
    _, volume = strain_matrix(corners)
    if (corners.min(axis=1) < -1e-9).any() or (
        corners.max(axis=1) > np.add(fill.shape, 1e-9)
    ).any():
        raise SolverError(
            f"the tetrahedron with corners {corners.T.tolist()} reaches out of an image of "
            f"{fill.shape} voxels; crop less or enlarge the image"
        )
    block = padded_block(crop_to_tet(fill, corners), poissons_ratio)
    nodes = block_nodes(block)
    on_surface = face_distance(corners, nodes) <= TOLERANCE
    free = np.broadcast_to(~on_surface, (3, *on_surface.shape))
    shapes = shape_values(corners, nodes) * on_surface
    tests = unit_strain_tests(corners)
    forces, worst = np.zeros((12, 6)), 0.0
    for case in range(6):
        reaction, residual = _reaction(block, case, free, rtol)
        forces[:, case] = np.einsum("kxyz,cxyz->kc", shapes, reaction).ravel()
        worst = max(worst, residual)
    full = float(crop_to_tet(np.ones_like(fill), corners).sum())
    # The forces are those of the cropped image's volume.
    return MacroTet(
        stiffness=recover_stiffness(corners, tests, forces) * volume / full,
        solid=float(block.operator.fill.sum() / full),
        residual=worst,
    )


def _reaction(block: Block, case: int, free: BoolArray, rtol: float) -> tuple[FloatArray, float]:
    """Nodal forces that hold the boundary in a unit strain."""
    load = unit_load(block.operator, case)
    u, _, residual = solve_held(block, load, free, rtol=rtol)
    force = np.zeros_like(load)
    block.operator.product(u, force)
    return force + load, residual

"""Solid of the part's tetrahedra with the material of blended joints."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.resolve.expected_design import expected_density, expected_design
from gradedesign.design.resolve.resolved_case import ResolvedCase
from gradedesign.geometry.lattice.joint_volume import adds_to_cells, joint_fraction
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.stiffness import UNIFORM
from gradedesign.mechanics.sizing.solid_moments import solid_fraction, solid_moments


def moments_with_joints(
    resolved: ResolvedCase, bounds: tuple[float, float], mesh: TetMesh
) -> FloatArray:
    """Moments ``(10, M)`` of the volume that sizing counts as solid, joints included.

    That of skins and passive regions, s, and of the joints, j, as they are on the lattice of the
    density rho that sizing is expected to choose: ``s + j / (1 - rho)`` of the volume, so that with
    the lattice in the rest the mass is that of all three. A fillet runs along the edge where a wall
    meets the solid, whose length hardly depends on the density. Joints are spread over the room
    that skins and passive regions leave in a tetrahedron.
    """
    solid = solid_moments(resolved.domain, mesh)
    if not adds_to_cells(resolved.domain):
        return solid
    design = expected_design(resolved.domain, resolved.cell, resolved.layout, bounds)
    void = 1.0 - expected_density(bounds)
    room = 1.0 - solid_fraction(solid)
    filled = np.minimum(joint_fraction(design, mesh) / void, room)
    share = np.divide(filled, room, out=np.zeros_like(room), where=room > 0)
    return np.asarray(solid + share * (UNIFORM[:, None] - solid))

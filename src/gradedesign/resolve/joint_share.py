"""Solid volume fractions of the part's tetrahedra with the material of blended joints."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.lattice.domain import solid_fraction
from gradedesign.lattice.joint_volume import joint_fraction
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.resolve.expected_design import expected_density, expected_design
from gradedesign.resolve.resolved_case import ResolvedCase


def solid_shares(resolved: ResolvedCase, bounds: tuple[float, float], mesh: TetMesh) -> FloatArray:
    """Share of every tetrahedron that counts as fully dense in sizing, ``(M,)``.

    That of skins and passive regions, s, and of the joints, j, as they are on the lattice of the
    density rho that sizing is expected to choose: ``s + j / (1 - rho)``, so that with the lattice
    in the rest the mass is that of all three. A fillet runs along the edge where a wall meets the
    solid, whose length hardly depends on the density.
    """
    solid = solid_fraction(resolved.domain, mesh)
    if not resolved.domain.joint_radius and not resolved.domain.nets:
        return solid
    design = expected_design(resolved.domain, resolved.cell, resolved.layout, bounds)
    void = 1.0 - expected_density(bounds)
    return np.minimum(solid + joint_fraction(design, mesh) / void, 1.0)

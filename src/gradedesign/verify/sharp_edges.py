"""Sharp edges of a stuffed lattice: those of the part, of its trim, and the creases of joints."""

from __future__ import annotations

import numpy as np

from gradedesign.lattice.lattice import LatticeDesign, body_field, joint_fields
from gradedesign.mesh.feature_edges import snap_feature_edges, snap_own_edges
from gradedesign.mesh.tet_mesh import TetMesh, boundary_facets


def sharpen(mesh: TetMesh, design: LatticeDesign, spacing: float) -> TetMesh:
    """Move vertices of a stuffed mesh onto the sharp edges of its design.

    These are the edges where the part trims the lattice, the edges of the part where it is solid,
    the creases where cells meet skins and passive regions, and the edges of those towards the
    cells. Joints with fillets have no crease.

    Parameters
    ----------
    mesh : TetMesh
        Stuffed from the field of the design.
    design : LatticeDesign
    spacing : float, mm
        Grid spacing of the stuffing.

    Returns
    -------
    TetMesh
        Same connectivity; a vertex whose move would spoil a tetrahedron stays where it was.
    """
    part, body = design.domain.distance, body_field(design)
    facets, _ = boundary_facets(mesh)
    mesh = snap_feature_edges(mesh, part, body, spacing, facets=facets)
    mesh = snap_own_edges(mesh, part, body, spacing, facets=facets)
    fields = joint_fields(design)
    if fields is None or design.domain.joint_radius > 0:
        return mesh
    cells, solids, trim = fields
    mesh = snap_feature_edges(mesh, cells, solids, spacing, inside=trim, facets=facets)
    return snap_own_edges(
        mesh,
        lambda points: -solids(points),
        lambda points: np.maximum(-cells(points), trim(points)),
        spacing,
        facets=facets,
    )

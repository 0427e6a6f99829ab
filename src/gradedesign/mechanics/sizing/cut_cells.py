"""Critical stress of cells that the part's free faces cut, over that of the periodic lattice."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.sizing.wall_kinds import wall_faces

#: Cells that two free faces cost together. Struts in a face are halves, bent at a seventh of the
#: stiffness, and joints there have no neighbour; shear vanishes at the faces. Of frames of simple
#: cubic struts, waves of eight cells along walls of 1, 2, 3, 4 and 6 cells keep 0.38, 0.62, 0.76,
#: 0.84 and 0.91 of the periodic frame's critical stress; with 1.5 it is 0.40, 0.57, 0.67, 0.73
#: and 0.80. Longer waves bend the wall as a plate: that is buckling of the part.
_LOST = 1.5


def cut_share(
    cell_map: CellMap, part: Part, domain: DesignDomain, mesh: TetMesh, lattice: BoolArray
) -> FloatArray:
    """Share of the critical stress that is left between free faces, ``(M,)``.

    ``N / (N + LOST)`` with N cells across the thinnest wall that a tetrahedron lies in, 1 where it
    lies in none.

    ``cell_map``: straight cells of equal edges. ``lattice (M,)``: tetrahedra that hold lattice.
    """
    faces, has_wall = wall_faces(cell_map, part, domain, mesh, lattice)
    across = np.where(has_wall, faces[1] - faces[0], np.inf).min(axis=0)
    return share_between_faces(across)


def share_between_faces(across: FloatArray) -> FloatArray:
    """Share that is left where so many cells lie between two free faces."""
    return np.asarray(1 / (1 + _LOST / across))

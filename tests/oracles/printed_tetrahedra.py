"""Values of limits on quadratic tetrahedra of a printed file, at two sizes.

An oracle for the finite cells that judge the file: pytetwild fills its surface, whose tetrahedra
follow every wall, and eight of half the edge take the place of each for the second size.
"""

from pathlib import Path

import numpy as np
import skfem

from gradedesign.design.loop.analysed import printed_solid
from gradedesign.design.resolve.design_model import prepare
from gradedesign.geometry.formats.write_stl import surface_of_stl
from gradedesign.geometry.tets.meshed_surface import tetrahedralize
from gradedesign.geometry.tets.mesher import PYTETWILD
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.geometry.triangles.chord_tolerance import within_chord
from gradedesign.mechanics.explicit.analysis import Discretisation
from gradedesign.mechanics.explicit.tets import solve_tets
from gradedesign.mechanics.limits.banded import banded
from gradedesign.mechanics.limits.verdict import limit_rows
from gradedesign.program.host.registry import build_registry

#: Envelope of the mesher, and half of it the chord within which triangles are joined first, mm.
ENVELOPE = 0.03
#: Orders with which displacements of quadratic tetrahedra may converge: 1 beside the re-entrant
#: edges where walls meet plates, 3 where nothing is singular.
ORDERS = (1.0, 1.5, 3.0)
MOST_BYTES = 6_000_000_000


def halved(mesh):
    """Eight tetrahedra of half the edge in the place of each."""
    points, tets = np.array(mesh.points), np.array(mesh.tets)
    fine = skfem.MeshTet(points, tets).refined()
    halves = TetMesh(points=fine.p, tets=fine.t)
    turned = np.array(fine.t)
    inverted = signed_volumes(halves) < 0.0
    turned[:2, inverted] = turned[1::-1, inverted]
    return TetMesh(points=fine.p, tets=turned)


def values_on_tetrahedra(case, stl, edge, time_limit_s=3600.0):
    """Values of the limits that converge, by key, each with the band of both sizes.

    Parameters
    ----------
    case : Case
    stl : path
        The printed file.
    edge : float, mm
        Of the larger tetrahedra.
    time_limit_s : float, s
        Of the mesher.

    Returns
    -------
    dict of LimitKey to Banded
        Its low end is the value of the smaller tetrahedra where these are softer.
    """
    model = prepare(case, build_registry())
    solid = printed_solid(model, None)
    surface = within_chord(surface_of_stl(Path(stl).read_bytes(), "file"), 0.5 * ENVELOPE)
    mesh = tetrahedralize(
        surface, edge_length=edge, epsilon=ENVELOPE, time_limit_s=time_limit_s,
        memory_limit_bytes=MOST_BYTES, mesher=PYTETWILD,
    ).mesh  # fmt: skip
    limits = [limit for limit in model.limits if limit.converges]
    found = []
    for size, tets in ((edge, mesh), (0.5 * edge, halved(mesh))):
        division = Discretisation(
            made_by="pytetwild", mesh_size=size, unknowns=0, requested=size,
        )  # fmt: skip
        solved = solve_tets(tets, solid, division, 2.0 * ENVELOPE)
        found.append((size, {row.key: row.value for row in limit_rows(limits, solved, "tets")}))
    return {
        key: banded([(size, values[key]) for size, values in found], ORDERS) for key in found[0][1]
    }

"""Free rigid motions under typical wrong supports, each with the answer one sees by eye."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import MeshTet

from gradedesign.errors import SolverError
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern, matvec
from gradedesign.mechanics.fe.free_pieces import connected_pieces, free_pieces, require_held
from gradedesign.mechanics.fe.space import TetSpace, tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.solver.rigid_modes import rigid_body_modes


def boxes(*offsets: float, order: int = 2) -> TetSpace:
    """Boxes of 4 x 2 x 2 mm, one per offset along x, not connected if apart."""
    grid = MeshTet.init_tensor(*[np.linspace(0.0, a, n + 1) for a, n in ((4, 4), (2, 2), (2, 2))])
    tets = np.array(grid.t)
    edges = grid.p[:, tets[1:]] - grid.p[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    n = grid.p.shape[1]
    points = [grid.p + np.array([[a], [0.0], [0.0]]) for a in offsets]
    cells = [tets + k * n for k in range(len(offsets))]
    return tet_space(
        TetMesh(points=np.concatenate(points, axis=1), tets=np.concatenate(cells, axis=1)), order
    )


def fix(space: TetSpace, *entries) -> np.ndarray:
    """Fixed components from pairs (condition, components)."""
    fixed = np.zeros(space.nodes.shape, dtype=bool)
    for where, components in entries:
        for c in components:
            fixed["xyz".index(c), where] = True
    return fixed


def modes(space: TetSpace, fixed: np.ndarray) -> list[str]:
    return [mode for piece in free_pieces(space, fixed) for mode in piece.modes]


def test_a_clamped_face_holds():
    space = boxes(0.0)
    assert modes(space, fix(space, (space.nodes[0] == 0.0, "xyz"))) == []


def test_rollers_on_three_faces_hold():
    space = boxes(0.0)
    x, y, z = space.nodes
    assert modes(space, fix(space, (x == 0, "x"), (y == 0, "y"), (z == 0, "z"))) == []


def test_a_roller_on_one_face_leaves_three_motions():
    space = boxes(0.0)
    found = modes(space, fix(space, (space.nodes[0] == 0.0, "x")))
    assert found == [
        "free to translate along y",
        "free to translate along z",
        "free to rotate about an axis through (0, 1, 1) mm along x",
    ]


def test_an_edge_is_a_hinge():
    space = boxes(0.0)
    x, _, z = space.nodes
    found = modes(space, fix(space, ((x == 0) & (z == 0), "xyz")))
    assert found == ["free to rotate about an axis through (0, 1, 0) mm along y"]


def test_a_point_is_a_ball_joint():
    space = boxes(0.0)
    found = modes(space, fix(space, ((space.nodes == 2.0).all(axis=0), "xyz")))
    assert found == [
        f"free to rotate about an axis through (2, 2, 2) mm along {axis}" for axis in "xyz"
    ]


def test_the_axis_of_a_rotation_is_found_away_from_the_supports():
    """x held at (0, 0, z), y held at (4, 0, z): the body turns about (4, 0), as normals meet."""
    space = boxes(0.0)
    x, y, z = space.nodes
    near, far = (x == 0) & (y == 0), (x == 4) & (y == 0)
    found = modes(space, fix(space, (near, "x"), (far, "y"), (z == 0, "z")))
    assert found == ["free to rotate about an axis through (4, 0, 0) mm along z"] or (
        len(found) == 1 and found[0].startswith("free to rotate about an axis through (4, 0, ")
    )


def test_a_slide_in_an_oblique_direction_is_given_as_a_vector():
    """All nodes held across (1, 1, 0)/sqrt 2 cannot be said by components, a ring of points can."""
    space = boxes(0.0)
    found = modes(space, fix(space, (space.nodes[2] == 0.0, "z"), (space.nodes[1] == 0.0, "y")))
    assert found == ["free to translate along x"]


def test_a_loose_piece_is_named_with_its_share_of_the_volume():
    space = boxes(0.0, 10.0)
    fixed = fix(space, (space.nodes[0] == 0.0, "xyz"))
    (piece,) = free_pieces(space, fixed)
    assert piece.modes == ("without any support",)
    assert piece.volume_share == pytest.approx(0.5)
    with pytest.raises(SolverError, match=r"'pull'.*50 % of the volume, around \(12, 1, 1\) mm"):
        require_held(space, fixed, "pull")


def test_every_piece_needs_its_own_supports():
    space = boxes(0.0, 10.0)
    assert len(np.unique(connected_pieces(space))) == 2
    held = fix(space, (space.nodes[0] == 0.0, "xyz"), (space.nodes[0] == 10.0, "xyz"))
    require_held(space, held, "both")


def test_a_small_support_far_from_the_bulk_still_holds():
    """Clamping one 1 mm facet of a long body is enough: no threshold may call it free."""
    space = boxes(0.0, order=1)
    stretched = TetSpace(
        mesh=TetMesh(
            points=space.mesh.points * np.array([[1000.0], [1.0], [1.0]]), tets=space.mesh.tets
        ),
        order=1,
        nodes=space.nodes * np.array([[1000.0], [1.0], [1.0]]),
        elements=space.elements,
    )
    x, y, z = stretched.nodes
    assert modes(stretched, fix(stretched, ((x == 0) & (y <= 1) & (z <= 1), "xyz"))) == []


def test_modes_cost_no_energy_and_are_independent():
    space = boxes(0.0)
    matrix = assemble(
        assembly_pattern(space), IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)
    )
    basis = rigid_body_modes(space.nodes)
    for k in range(6):
        assert abs(matvec(matrix, basis[:, :, k].T)).max() < 1e-13
    assert np.linalg.matrix_rank(basis.reshape(-1, 6)) == 6

"""Sharp edges come back where two smooth faces meet."""

import numpy as np
import pytest

from gradedesign.mesh.feature_edges import snap_feature_edges
from gradedesign.mesh.quality import tet_report
from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import boundary_facets

RADIUS = 3.0
CENTRE = np.array([3.5, 3.4, 3.6])
NORMAL = np.array([0.3, -0.4, 0.866])
NORMAL /= np.linalg.norm(NORMAL)


def _ball(x):
    return np.sqrt(((x - CENTRE.reshape(3, *([1] * (x.ndim - 1)))) ** 2).sum(axis=0)) - RADIUS


def _plane(x):
    """Keeps the half of the ball below its centre: a hemisphere with one circular edge."""
    return np.tensordot(NORMAL, x, axes=1) - NORMAL @ CENTRE


def _meshes(spacing=0.5):
    count = int(7.5 / spacing)
    raw = stuff(
        lambda x: np.maximum(_ball(x), _plane(x)), (-0.01, -0.02, 0.03), (count,) * 3, spacing
    )
    return raw, snap_feature_edges(raw, _ball, _plane, spacing)


def _rim(mesh):
    """Largest distance from the centre within the flat face: 3 mm at a sharp edge."""
    points = mesh.points[:, np.unique(boundary_facets(mesh)[0])]
    flat = np.abs(_plane(points)) < 0.02
    return np.linalg.norm(points[:, flat] - CENTRE[:, None], axis=0)


@pytest.mark.parametrize("spacing", [0.5, 0.3])
def test_the_chamfer_is_gone(spacing):
    """Volume of a hemisphere, 2/3 pi R^3, less what chords take from the whole ball."""
    raw, sharp = _meshes(spacing)
    count = int(7.5 / spacing)
    ball = stuff(_ball, (-0.01, -0.02, 0.03), (count,) * 3, spacing)
    chords = 1 - tet_report(ball).volume / (4 / 3 * np.pi * RADIUS**3)
    before, after = (
        1 - tet_report(m).volume / (2 / 3 * np.pi * RADIUS**3) - chords for m in (raw, sharp)
    )
    assert before > 0
    assert abs(after) < 0.45 * before


def test_the_edge_is_reached():
    """Most of the rim's vertices lie on the circle of radius 3 mm after snapping."""
    raw, sharp = _meshes()
    on_edge = [np.count_nonzero(np.abs(_rim(m) - RADIUS) < 0.02) for m in (raw, sharp)]
    assert on_edge[1] >= 20
    assert on_edge[1] > 3 * on_edge[0]


def test_tetrahedra_stay_good_and_connected():
    raw, sharp = _meshes()
    report, was = tet_report(sharp), tet_report(raw)
    assert report.inverted == 0
    assert report.pieces == was.pieces == 1
    assert report.min_dihedral >= min(9.0, was.min_dihedral)
    np.testing.assert_array_equal(raw.tets, sharp.tets)


def test_moved_vertices_lie_on_both_faces():
    raw, sharp = _meshes()
    moved = np.abs(raw.points - sharp.points).max(axis=0) > 1e-9
    assert moved.sum() >= 10
    assert np.abs(_ball(sharp.points[:, moved])).max() <= 0.0101
    assert np.abs(_plane(sharp.points[:, moved])).max() <= 0.0101


def test_a_smooth_solid_is_left_alone():
    mesh = stuff(_ball, (0.0, 0.0, 0.0), (15, 15, 15), 0.5)
    assert snap_feature_edges(mesh, _ball, lambda x: x[0] - 50.0, 0.5) is mesh


def test_an_acute_wedge_is_drawn_out_to_its_edge():
    """A prism over an isosceles triangle of 40 degrees at the tip, turned out of the grid.

    The grid loses the tip for more than its spacing: 48 % of the lost volume comes back, and 19 %
    where a vertex moves at most 0.75 spacings and what spoils a tetrahedron together is given up.
    """
    tip, spacing = np.radians(20.0), 0.25
    turn = np.linalg.qr(np.random.default_rng(79).standard_normal((3, 3)))[0]

    def local(x):
        return np.tensordot(turn, x - 4.0, axes=1)

    def upper(x):
        y = local(x)
        return -y[0] * np.sin(tip) + y[1] * np.cos(tip)

    def rest(x):
        y = local(x)
        lower = -y[0] * np.sin(tip) - y[1] * np.cos(tip)
        return np.maximum(lower, np.maximum(y[0] - 3.0, np.abs(y[2]) - 1.5))

    raw = stuff(lambda x: np.maximum(upper(x), rest(x)), (-0.1,) * 3, (34,) * 3, spacing)
    sharp = snap_feature_edges(raw, upper, rest, spacing)
    volume = 9.0 * np.tan(tip) * 3.0
    lost = [volume - tet_report(m).volume for m in (raw, sharp)]
    assert lost[1] < 0.6 * lost[0]
    assert tet_report(sharp).inverted == 0
    assert tet_report(sharp).min_dihedral >= min(9.0, tet_report(raw).min_dihedral)

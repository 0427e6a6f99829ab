"""Sharp edges come back where two smooth faces meet."""

import numpy as np
import pytest

from gradedesign.mesh.feature_edges import snap_feature_edges, snap_own_edges
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


TURN = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
HALF = np.array([1.6, 1.4, 1.9])


def _local(x):
    return np.tensordot(TURN, x - 3.0, axes=1)


def _box(x):
    """Signed distance of a turned box."""
    out = np.abs(_local(x)) - HALF.reshape(3, *([1] * (x.ndim - 1)))
    return np.linalg.norm(np.maximum(out, 0), axis=0) + np.minimum(out.max(axis=0), 0)


def _everywhere(x):
    return np.full(x.shape[1:], -9.0)


def _stuffed(field, spacing=0.25):
    return stuff(field, (0.01, -0.02, 0.03), (int(6 / spacing),) * 3, spacing)


def _volume(mesh):
    return tet_report(mesh).volume


def test_the_edges_of_a_turned_box_come_back():
    """Volume 8 a b c; twelve edges chamfered by a quarter of a spacing hold 1 % of it."""
    raw = _stuffed(_box)
    sharp = snap_own_edges(raw, _box, _everywhere, 0.25)
    lost = [1 - _volume(m) / (8 * HALF.prod()) for m in (raw, sharp)]
    assert lost[0] > 0.006
    assert abs(lost[1]) < 0.3 * lost[0]
    assert tet_report(sharp).inverted == 0
    assert tet_report(sharp).min_dihedral >= min(9.0, tet_report(raw).min_dihedral)
    moved = np.abs(raw.points - sharp.points).max(axis=0) > 1e-9
    two_nearest = np.sort(np.abs(np.abs(_local(sharp.points[:, moved])) - HALF[:, None]), axis=0)[
        :2
    ]
    assert two_nearest.max() <= 0.02 * 0.25  # on two faces: an edge of the box


def test_re_entrant_edges_come_back():
    """A void of the box's shape in a ball: its edges are re-entrant, and stuffing fills them."""

    def ball(x):
        return 0.8 * np.linalg.norm(_local(x), axis=0) - 2.85 * 0.8

    def void(x):
        return 0.8 * _box(3.0 + (x - 3.0) / 0.8)

    raw = _stuffed(lambda x: np.maximum(ball(x), -void(x)))
    sharp = snap_own_edges(raw, lambda x: -void(x), ball, 0.25)
    left = _volume(_stuffed(ball)) - 8 * (0.8 * HALF).prod()
    gained = [_volume(m) - left for m in (raw, sharp)]
    assert gained[0] > 0.006 * 8 * (0.8 * HALF).prod()
    assert abs(gained[1]) < 0.3 * gained[0]


def test_the_edge_of_a_cylinder_is_reached_on_its_circle():
    """Planes at the ends of a side miss a circle by up to 7 %, planes closer to it do not."""

    def cylinder(x):
        y = _local(x)
        a, b = np.hypot(y[0], y[1]) - 1.2, np.abs(y[2]) - 1.6
        return np.hypot(np.maximum(a, 0), np.maximum(b, 0)) + np.minimum(np.maximum(a, b), 0)

    raw = _stuffed(cylinder)
    sharp = snap_own_edges(raw, cylinder, _everywhere, 0.25)
    moved = np.abs(raw.points - sharp.points).max(axis=0) > 1e-9
    y = _local(sharp.points[:, moved])
    assert moved.sum() >= 40
    np.testing.assert_allclose(np.hypot(y[0], y[1]), 1.2, atol=0.03 * 0.25)
    np.testing.assert_allclose(np.abs(y[2]), 1.6, atol=0.03 * 0.25)


@pytest.mark.parametrize("radius", [0.5, 0.8, 1.5])
def test_round_faces_of_few_elements_have_no_edges(radius):
    """Two to six spacings across: sides turn by up to 60 degrees and none is an edge."""

    def ball(x):
        return np.linalg.norm(_local(x), axis=0) - radius

    raw = _stuffed(ball)
    np.testing.assert_array_equal(snap_own_edges(raw, ball, _everywhere, 0.25).points, raw.points)


def test_the_crease_between_a_post_and_its_plates_comes_back():
    """A post of 1 mm radius between two plates, in a box: stuffing fills its creases like welds."""

    def plates(x):
        return 0.9 - np.abs(_local(x)[2])

    def post(x):
        y = _local(x)
        return np.hypot(y[0], y[1]) - 1.0

    raw = _stuffed(lambda x: np.maximum(_box(x), np.minimum(plates(x), post(x))))
    sharp = snap_feature_edges(raw, post, plates, 0.25, inside=_box)

    def body(x):
        return np.minimum(plates(x), post(x))

    with_box = snap_feature_edges(sharp, _box, body, 0.25)
    with_box = snap_own_edges(with_box, _box, body, 0.25)
    exact = 8 * HALF[0] * HALF[1] * (HALF[2] - 0.9) + np.pi * 1.8
    weld = [_volume(m) - exact for m in (raw, sharp, with_box)]
    circumference = 2 * 2 * np.pi * 1.0
    assert weld[0] - weld[1] > 0.05 * 0.25**2 * circumference
    moved = np.abs(raw.points - sharp.points).max(axis=0) > 1e-9
    assert moved.sum() >= 30
    assert np.abs(post(sharp.points[:, moved])).max() <= 0.02 * 0.25
    assert np.abs(plates(sharp.points[:, moved])).max() <= 0.02 * 0.25
    assert (_box(sharp.points[:, moved]) < 0).all()
    assert abs(weld[2]) < 0.005 * exact  # chords of the post hold 0.3 % less
    assert tet_report(sharp).inverted == 0

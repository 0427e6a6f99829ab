"""Frames that follow principal directions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.maps.frame_field import frame_field, principal_angle

LOWER, UPPER = np.zeros(3), np.array([60.0, 40.0, 20.0])
POINTS = np.array([[10.0, 30.0, 52.0], [8.0, 20.0, 33.0], [5.0, 10.0, 15.0]])


def uniform(matrix):
    return lambda p: np.broadcast_to(
        matrix.reshape(3, 3, *[1] * (p.ndim - 1)), (3, 3, *p.shape[1:])
    )


@pytest.mark.parametrize(
    "turn", [(25, 0, 0), (0, -35, 0), (10, 20, 30), (-20, 15, 38), (0, 0, 45)], ids=lambda t: str(t)
)
def test_frames_turn_to_principal_directions(turn):
    axes = Rotation.from_euler("XYZ", turn, degrees=True).as_matrix()
    stress = axes @ np.diag([3.0, -1.0, 0.5]) @ axes.T
    frames = frame_field(uniform(stress), LOWER, UPPER, length=5.0)(POINTS)
    for k in range(3):
        np.testing.assert_allclose(frames[:, :, k] @ frames[:, :, k].T, np.eye(3), atol=1e-12)
        inside = frames[:, :, k] @ stress @ frames[:, :, k].T
        # Rows are principal directions where no shear is left, whichever row has which.
        np.testing.assert_allclose(inside, np.diag(np.diag(inside)), atol=0.02)
        assert np.linalg.det(frames[:, :, k]) == pytest.approx(1.0)


def test_one_direction_leaves_the_turn_about_it_free():
    along = np.array([np.cos(0.5), np.sin(0.5), 0.0])
    frames = frame_field(uniform(np.outer(along, along)), LOWER, UPPER, length=5.0)(POINTS)
    for k in range(3):
        assert np.abs(frames[:, :, k] @ along).max() == pytest.approx(1.0, abs=1e-4)
        np.testing.assert_allclose(frames[2, :, k], [0, 0, 1], atol=1e-5)


def about_an_axis(points):
    """Tension around the axis x = 30, y = -50: directions turn by 50 degrees over the box."""
    x, y = points[0] - 30, points[1] + 50
    r = np.hypot(x, y)
    along = np.stack([y / r, -x / r, 0 * r])
    return along[:, None] * along[None]


def test_directions_about_an_axis_are_followed():
    frames = frame_field(about_an_axis, LOWER, UPPER, length=4.0)
    rng = np.random.default_rng(2203)
    points = rng.uniform(LOWER[:, None], UPPER[:, None], (3, 500))
    axes = frames(points).transpose(1, 0, 2)
    angle, weight = principal_angle(axes, about_an_axis(points))
    # Frames end without slope at the border, so they lag there, over about the length.
    assert angle.mean() < 0.6
    inner = ((points > 8) & (points < UPPER[:, None] - 8))[:2].all(axis=0)
    assert angle[inner].max() < 1.0
    np.testing.assert_allclose(weight, 1.0)
    straight, _ = principal_angle(np.repeat(np.eye(3)[:, :, None], 500, 2), about_an_axis(points))
    assert straight.mean() > 10


def test_where_nothing_pulls_frames_pass_smoothly():
    def two_ends(points):
        turn = np.where(points[0] < 15, 0.0, np.radians(30))
        along = np.stack([np.cos(turn), np.sin(turn), 0 * turn])
        return along[:, None] * along[None] * ((points[0] < 15) | (points[0] > 45))

    frames = frame_field(two_ends, LOWER, UPPER, length=5.0)
    x = np.array([5.0, 30.0, 55.0])
    found = frames(np.stack([x, 0 * x + 20, 0 * x + 10]))
    angle = np.degrees(np.arctan2(found[0, 1], found[0, 0]))
    # By symmetry half of the turn in the middle.
    np.testing.assert_allclose(angle, [0, 15, 30], atol=1.5)


def test_impossible_fields_are_refused():
    with pytest.raises(CaseError, match="zero nearly everywhere"):
        frame_field(uniform(np.zeros((3, 3))), LOWER, UPPER, length=5.0)
    with pytest.raises(CaseError, match="not finite"):
        frame_field(uniform(np.full((3, 3), np.nan)), LOWER, UPPER, length=5.0)
    with pytest.raises(CaseError, match="expected positive lengths"):
        frame_field(uniform(np.eye(3)), LOWER, UPPER, length=0.0)
    with pytest.raises(ResourceError, match="smooth over a longer distance"):
        frame_field(uniform(np.eye(3)), LOWER, UPPER, length=0.2)

"""Distance from points inside a closed surface to its faces, along three directions."""

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.thickness import chords

AXES = Rotation.from_euler("XYZ", (20, -35, 50), degrees=True).as_matrix()


def test_chords_of_a_box_follow_from_its_faces():
    size = np.array([4.0, 3.0, 2.0])
    rng = np.random.default_rng(71)
    # Beside random places, some over the diagonals and edges of the faces' triangles.
    points = np.hstack([rng.uniform(0.05, 0.95, (3, 200)), np.full((3, 1), 0.5)])
    points = points * size[:, None]
    back, ahead = chords(box_surface(tuple(size)), points, np.eye(3))
    np.testing.assert_allclose(back, points, atol=1e-12)
    np.testing.assert_allclose(ahead, size[:, None] - points, atol=1e-12)
    # Along other directions: the first of the six planes.
    back, ahead = chords(box_surface(tuple(size)), points, AXES)
    for k in range(3):
        d = AXES[:, k][:, None]
        planes = np.where(d > 0, (size[:, None] - points) / d, -points / d)
        np.testing.assert_allclose(ahead[k], planes.min(axis=0), rtol=1e-9)
        planes = np.where(d < 0, (points - size[:, None]) / d, points / d)
        np.testing.assert_allclose(back[k], planes.min(axis=0), rtol=1e-9)


def test_chords_end_nowhere_outside():
    back, ahead = chords(box_surface((1, 1, 1)), np.array([[2.0]] * 3), np.eye(3))
    assert np.isinf([back, ahead]).all()

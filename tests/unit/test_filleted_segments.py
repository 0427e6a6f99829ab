"""Filleted struts against arcs, a slow oracle, and what a field must hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gradedesign.errors import PluginError
from gradedesign.fields import (
    graph_segments,
    periodic_distance_to_segments,
    periodic_filleted_segments,
)

#: Body-centred cubic struts, which meet at acute and obtuse angles.
BCC = graph_segments(
    [[0.0, 0.0, 0.0], [0.5, 0.5, 0.5], *np.ndindex(2, 2, 2)],
    [[1, 2 + k] for k in range(8)],
)
SC = graph_segments(
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [[0, 1], [0, 2], [0, 3]]
)
#: Fields by their fillet; without one it is the distance.
FILLETED = {f: periodic_filleted_segments(BCC, f) for f in (0.0, 0.4, 1.0, 2.0)}


def _slow(segments, points, fillet):
    """Radius by bisection, from the distances to all copies of all struts near by."""
    shifts = np.stack(np.meshgrid(*[[-2, -1, 0, 1, 2]] * 3), axis=-1).reshape(-1, 1, 1, 3)
    copies = (segments + shifts).reshape(-1, 2, 3)
    start, along = copies[:, 0], copies[:, 1] - copies[:, 0]
    away = points.T[:, None] - start
    foot = np.clip((away * along).sum(-1) / (along**2).sum(-1), 0, 1)
    distance = np.linalg.norm(away - foot[..., None] * along, axis=-1)
    high = distance.min(axis=1)
    low = high / (1 + fillet)
    for _ in range(60):
        t = 0.5 * (low + high)
        depth = np.maximum((1 + fillet) * t[:, None] - distance, 0.0)
        solid = np.sqrt((depth**2).sum(axis=1)) >= fillet * t
        low, high = np.where(solid, low, t), np.where(solid, t, high)
    return high


@pytest.mark.parametrize("segments", [SC, BCC], ids=["sc", "bcc"])
@pytest.mark.parametrize("fillet", [0.3, 1.0, 2.0])
def test_the_radius_is_that_of_the_slow_way(segments, fillet):
    points = np.random.default_rng(3).random((3, 600))
    got = periodic_filleted_segments(segments, fillet)(points)
    np.testing.assert_allclose(got, _slow(segments, points, fillet), rtol=1e-11, atol=1e-14)


def test_struts_at_a_right_angle_meet_in_an_arc():
    """Radius f t about ((1 + f) t, (1 + f) t); for f below 0.7 no third strut comes near."""
    t, f, angle = 0.1, 0.5, np.linspace(0.0, np.pi / 2, 31)
    centre = (1 + f) * t
    arc = np.stack(
        [centre - f * t * np.cos(angle), centre - f * t * np.sin(angle), np.zeros(angle.size)]
    )
    np.testing.assert_allclose(periodic_filleted_segments(SC, f)(arc), t, rtol=1e-12)


def test_away_from_joints_the_radius_is_the_distance():
    rng = np.random.default_rng(4)
    # Halfway along struts of length 1, within 0.15 of one and at least 0.35 from all others.
    points = np.stack([rng.uniform(0.4, 0.6, 500), *rng.uniform(-0.1, 0.1, (2, 500))])
    plain = periodic_distance_to_segments(SC)(points)
    np.testing.assert_allclose(periodic_filleted_segments(SC, 1.0)(points), plain, rtol=1e-13)
    # Without fillets it is the distance everywhere.
    points = rng.random((3, 2000))
    np.testing.assert_array_equal(
        periodic_filleted_segments(BCC, 0.0)(points), periodic_distance_to_segments(BCC)(points)
    )


@given(
    st.lists(st.floats(0.0, 1.0), min_size=6, max_size=6),
    st.sampled_from(sorted(FILLETED)),
)
def test_the_radius_changes_by_at_most_the_distance_moved(places, fillet):
    a, b = np.array(places).reshape(2, 3)
    values = FILLETED[fillet](np.stack([a, b], axis=1))
    assert abs(values[0] - values[1]) <= np.linalg.norm(a - b) + 1e-12
    assert values[0] <= FILLETED[0.0](a) + 1e-15


def test_single_precision_stays_single():
    points = np.random.default_rng(5).random((3, 7, 2)).astype(np.float32)
    got = periodic_filleted_segments(BCC, 0.5)(points)
    assert (got.dtype, got.shape) == (np.float32, (7, 2))
    np.testing.assert_allclose(
        got, periodic_filleted_segments(BCC, 0.5)(points.astype(np.float64)), rtol=1e-5, atol=1e-7
    )


@pytest.mark.parametrize("fillet", [-0.1, 2.1, np.nan])
def test_a_fillet_out_of_range_is_refused(fillet):
    with pytest.raises(PluginError, match="times the radius of struts"):
        periodic_filleted_segments(SC, fillet)


def test_no_struts_are_refused():
    with pytest.raises(PluginError, match="shape"):
        periodic_filleted_segments(np.zeros((0, 2, 3)), 0.5)

"""Welding, cleaning and orienting: rows 15 to 26 of the fault table."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.errors import CaseError, PartError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import (
    corner_points,
    enclosed_volume,
    open_edge_count,
)
from gradedesign.geometry.triangles.winding import winding_numbers

BOX = corner_points(box_surface((10.0, 10.0, 10.0)))
RNG = np.random.default_rng(20)


def ball(radius: float = 10.0, segments: int = 24) -> np.ndarray:
    """Corners of a facetted ball."""
    import manifold3d

    mesh = manifold3d.Manifold.sphere(radius, segments).to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts).astype(int)]


def refined(corners: np.ndarray, n: int) -> np.ndarray:
    """Corners of a closed surface with every facet cut into n x n."""
    import manifold3d

    points, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(vert_properties=points, tri_verts=faces.reshape(-1, 3).astype(np.uint64))
    )
    mesh = solid.refine(n).to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts).astype(int)]


def volume_of(corners: np.ndarray) -> float:
    """Divergence theorem, one triangle after the other."""
    return sum(float(np.dot(a, np.cross(b, c))) for a, b, c in corners) / 6.0


BALL = ball()
BALL_VOLUME = volume_of(BALL)


def check_solid(corners, volume, **options):
    """Build, and check that the result is closed and encloses a volume."""
    surface, report = build_surface(corners, **options)
    assert open_edge_count(surface) == 0
    assert enclosed_volume(surface) == pytest.approx(volume, rel=1e-9)
    assert report.facets_read == len(corners)
    assert report.facets_kept == len(surface.faces)
    return surface, report


def test_clean_input_is_untouched():
    surface, report = check_solid(BALL, BALL_VOLUME)
    assert report.warnings == ()
    np.testing.assert_array_equal(corner_points(surface), BALL)
    assert len(surface.vertices) == len(surface.faces) / 2 + 2  # Euler: V - E + F = 2


def test_row_15_facets_without_area_are_removed_and_counted():
    chosen = RNG.choice(len(BALL), len(BALL) // 5, replace=False)
    points = BALL[chosen]
    points[:, 2] = points[:, 0]
    on_line = BALL[:3].copy()
    on_line[:, 2] = 0.25 * on_line[:, 0] + 0.75 * on_line[:, 1]
    mixed = RNG.permutation(np.concatenate([BALL, points, on_line]))
    _, report = check_solid(mixed, BALL_VOLUME)
    assert report.degenerate_removed == len(points) + 3
    assert "zero area" in report.warnings[0]


def test_facet_without_area_that_closes_the_surface_is_flipped_not_torn_out():
    a, b, c = BOX[0]
    middle = 0.5 * (a + b)
    fan = np.array([[a, middle, c], [middle, b, c], [a, b, middle]])
    surface, report = check_solid(np.concatenate([fan, BOX[1:]]), 1000.0)
    assert report.degenerate_removed == 1
    corners = corner_points(surface)
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert areas.min() > 1.0


def test_row_16_duplicates_are_removed():
    _, report = check_solid(RNG.permutation(np.concatenate([BALL, BALL])), BALL_VOLUME)
    assert report.duplicates_removed == len(BALL)
    assert "duplicate" in report.warnings[0]


def test_row_17_inverted_is_flipped_and_told():
    _, report = check_solid(BALL[:, ::-1], BALL_VOLUME)
    assert report.shells_inverted == 1
    assert "inside out" in report.warnings[0]


def test_row_17_inverted_part_keeps_its_void():
    inside_out = np.concatenate([BALL[:, ::-1], 0.5 * BALL])
    _, report = check_solid(inside_out, 0.875 * BALL_VOLUME)
    assert (report.bodies, report.voids) == (1, 1)


def test_row_18_a_third_flipped():
    chosen = RNG.choice(len(BALL), len(BALL) // 3, replace=False)
    mixed = BALL.copy()
    mixed[chosen] = mixed[chosen, ::-1]
    _, report = check_solid(mixed, BALL_VOLUME)
    assert report.facets_flipped == len(chosen)
    assert "agree" in report.warnings[0]


def test_row_19_missing_facet_is_located():
    with pytest.raises(PartError) as caught:
        build_surface(BALL[1:])
    assert caught.value.exit_code == 3
    a, b, c = BALL[0]
    perimeter = sum(np.linalg.norm(p - q) for p, q in ((a, b), (b, c), (c, a)))
    for words in ("1 holes", "3 edges", f"perimeter {perimeter:.4g} mm", 'repair = "auto"'):
        assert words in str(caught.value)


@pytest.mark.parametrize("corners", [BALL, refined(BOX, 6)], ids=["ball", "box"])
@pytest.mark.parametrize("k", [0, 5])
def test_row_19_missing_facet_is_filled_on_request(corners, k):
    volume = volume_of(corners)
    _, report = check_solid(np.delete(corners, k, axis=0), volume, repair="auto")
    assert report.holes_filled == 1
    assert "1 holes filled" in report.warnings[0]


@pytest.mark.parametrize("repair", ["safe", "auto"])
def test_lost_sides_of_a_spike_are_not_closed_flat(repair):
    """A spike of 60 mm over one facet of a box: without its sides only the box would be left."""
    corners = corner_points(box_surface((20.0, 20.0, 20.0)))
    with pytest.raises(PartError, match="open" if repair == "safe" else r"too large.*0.5 %"):
        build_surface(corners[1:], repair=repair)


def test_many_small_holes_are_not_filled_if_together_they_may_hold_more():
    fine = refined(BOX, 8)
    _, report = check_solid(np.delete(fine, [0, 50], axis=0), 1000.0, repair="auto")
    assert report.holes_filled == 2
    with pytest.raises(PartError, match="too large"):
        build_surface(np.delete(fine, np.arange(0, len(fine), 22), axis=0), repair="auto")


def test_small_round_hole_is_filled_with_a_fan():
    import manifold3d

    mesh = manifold3d.Manifold.cylinder(10.0, 8.0, 0.02, 16).to_mesh64()
    spike = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts).astype(int)]
    open_top = spike[~(spike[:, :, 2] == 10.0).all(axis=1)]
    with pytest.raises(PartError, match="16 edges"):
        build_surface(open_top)
    _, report = check_solid(open_top, volume_of(spike), repair="auto")
    assert report.holes_filled == 1
    assert report.facets_kept == len(open_top) + 16


@pytest.mark.parametrize("repair", ["safe", "auto"])
def test_row_20_a_fifth_missing(repair):
    kept = RNG.choice(len(BALL), 4 * len(BALL) // 5, replace=False)
    with pytest.raises(PartError, match="holes") as caught:
        build_surface(BALL[kept], repair=repair)
    assert caught.value.exit_code == 3


def test_missing_half_is_too_large_to_fill():
    half = BALL[BALL[:, :, 2].mean(axis=1) < 0]
    with pytest.raises(PartError, match="too large to fill"):
        build_surface(half, repair="auto")


def test_row_21_noise_above_the_tolerance_is_not_welded():
    diagonal = np.linalg.norm([20.0, 20.0, 20.0])
    noisy = BALL + RNG.uniform(-1e-4, 1e-4, BALL.shape) * diagonal
    with pytest.raises(PartError, match="open"):
        build_surface(noisy)


def test_noise_below_the_tolerance_is_welded_everywhere():
    diagonal = np.linalg.norm([20.0, 20.0, 20.0])
    noisy = BALL + RNG.uniform(-1e-7, 1e-7, BALL.shape) * diagonal
    surface, report = build_surface(noisy)
    assert open_edge_count(surface) == 0
    assert enclosed_volume(surface) == pytest.approx(BALL_VOLUME, rel=1e-5)
    assert report.vertices_welded > 0


def test_row_22_overlapping_boxes_are_united():
    # Two boxes of 1000 mm^3 that share 5 x 5 x 5 = 125.
    _, report = check_solid(np.concatenate([BOX, BOX + 5.0]), 1875.0)
    assert report.shells_united == 2
    assert "2000 mm^3 counted" in report.warnings[0]
    assert "1875 mm^3 united" in report.warnings[0]


def test_row_22_crossing_bars_without_corners_in_each_other_are_united():
    bar = (BOX - 5.0) * [3.0, 1.0, 1.0]
    check_solid(np.concatenate([bar, bar[:, :, [1, 2, 0]]]), 3000.0 + 3000.0 - 1000.0)


def test_row_22_overlap_keeps_the_void_of_one_body():
    void = 0.2 * BOX[:, ::-1] + 1.0  # 2 mm wide, from 1 to 3: outside the other box
    check_solid(np.concatenate([BOX, void, BOX + 5.0]), 1875.0 - 8.0)


def test_row_23_shell_of_the_same_direction_is_ignored_and_told():
    _, report = check_solid(np.concatenate([BOX, 0.5 * BOX + 2.5]), 1000.0)
    assert report.shells_ignored == 1
    assert "reversed normals" in report.warnings[0]


def test_row_23_reversed_shell_is_a_void():
    _, report = check_solid(np.concatenate([BOX, 0.5 * BOX[:, ::-1] + 2.5]), 875.0)
    assert (report.bodies, report.voids, report.warnings) == (1, 1, ())


def test_row_24_two_bodies():
    both = np.concatenate([BOX, BOX + 20.0])
    with pytest.raises(PartError, match="2 separate solids") as caught:
        build_surface(both)
    assert caught.value.exit_code == 3
    assert 'bodies = "all"' in str(caught.value)
    _, report = check_solid(both, 2000.0, bodies="all")
    assert report.bodies == 2


def test_body_inside_a_void_is_a_second_body():
    nested = np.concatenate([BOX, 0.5 * BOX[:, ::-1] + 2.5, 0.2 * BOX + 4.0])
    with pytest.raises(PartError, match="2 separate solids"):
        build_surface(nested)


def test_row_24_fragments_are_dropped():
    _, report = check_solid(np.concatenate([BOX, 0.05 * BOX + 20.0]), 1000.0)
    assert report.fragments_dropped == 1
    assert "disconnected components dropped" in report.warnings[0]


@pytest.mark.parametrize("shift", [[10, 10, 0], [10, 10, 10]], ids=["edge", "corner"])
def test_row_25_touching_boxes_are_two_bodies(shift):
    with pytest.raises(PartError, match="2 separate solids"):
        build_surface(np.concatenate([BOX, BOX + shift]))


def test_boxes_glued_at_a_face_become_one_where_they_are_joined():
    both = np.concatenate([BOX, BOX + np.array([10.0, 0.0, 0.0])])
    with pytest.raises(
        PartError, match=r"2 solids touch along 100 mm\^2 around \(10, 5, 5\) mm"
    ) as refused:
        build_surface(both)
    # "all" alone would be refused later: every analysis would join them.
    assert 'leave a gap between them in CAD and set bodies = "all"' in str(refused.value)
    _, report = check_solid(both, 2000.0, bodies="join")
    assert (report.bodies, report.bodies_joined, report.common_area) == (1, 2, pytest.approx(100))
    assert "joined along 100 mm^2" in report.warnings[0]
    _, report = check_solid(both, 2000.0, bodies="all")
    assert (report.bodies, report.common_area) == (2, pytest.approx(100))


def test_a_body_written_from_both_sides_is_one_body():
    _, report = check_solid(np.concatenate([BALL, BALL[:, ::-1]]), BALL_VOLUME)
    assert report.shells_ignored == 1
    assert "reversed shells that lie in no solid" in report.warnings[0]


def test_facets_of_two_bodies_are_no_duplicates_beside_those_that_are():
    """Of two bodies that touch, two facets elsewhere are written twice."""
    both = np.concatenate([BOX, BOX + np.array([10.0, 0.0, 0.0]), BOX[:2]])
    surface, report = build_surface(both, bodies="join")
    assert enclosed_volume(surface) == pytest.approx(2000.0, rel=1e-9)
    assert (report.duplicates_removed, report.bodies_joined) == (2, 2)


@pytest.mark.parametrize("tilt", [False, True])
def test_row_26_flat(tilt):
    flat = BOX * [1.0, 1.0, 0.0]
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    with pytest.raises(PartError, match=r"flat.*zero volume") as caught:
        build_surface(flat @ turn if tilt else flat)
    assert caught.value.exit_code == 3


def test_moebius_strip_is_refused():
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rim = [
        np.stack(
            [
                (10 + s * np.cos(turn / 2)) * np.cos(turn),
                (10 + s * np.cos(turn / 2)) * np.sin(turn),
                s * np.sin(turn / 2),
            ],
            axis=1,
        )
        for s in (-2, 2)
    ]
    following = [np.roll(r, -1, axis=0) for r in rim]
    following[0][-1], following[1][-1] = rim[1][0], rim[0][0]
    strip = np.concatenate(
        [
            np.stack([rim[0], rim[1], following[1]], 1),
            np.stack([rim[0], following[1], following[0]], 1),
        ]
    )
    with pytest.raises(PartError, match="one-sided"):
        build_surface(strip)


def test_three_facets_at_an_edge_are_refused():
    wall = np.array([[BOX[0][0], BOX[0][1], [5.0, 5.0, 5.0]]])
    with pytest.raises(PartError, match=r"holes|non-manifold"):
        build_surface(np.concatenate([BOX, wall]))


@pytest.mark.parametrize(("scale", "word"), [(1 / 25.4, "inch"), (1000.0, "unit")])
def test_row_27_odd_size_is_told_not_scaled(scale, word):
    _, report = build_surface(BOX * scale)
    assert word in report.warnings[0]


def test_row_28_far_from_the_origin():
    surface, report = build_surface(BOX + 1e6)
    assert enclosed_volume(surface) == pytest.approx(1000.0, rel=1e-6)
    assert "origin" in report.warnings[0]


def test_nan_and_nothing_are_refused():
    spoiled = BOX.copy()
    spoiled[3, 1, 2] = np.nan
    with pytest.raises(PartError, match="facets 3"):
        build_surface(spoiled)
    with pytest.raises(PartError, match="no triangles"):
        build_surface(BOX[:0])


@pytest.mark.parametrize("option", [{"repair": "yes"}, {"bodies": "two"}])
def test_unknown_option(option):
    with pytest.raises(CaseError, match="unknown"):
        build_surface(BOX, **option)


def test_winding_number_is_one_inside_and_zero_outside():
    points = np.array([[5.0, 5.0, 5.0], [1.0, 9.0, 2.0], [11.0, 5.0, 5.0]]).T
    np.testing.assert_allclose(winding_numbers(BOX, points), [1, 1, 0], atol=1e-12)
    np.testing.assert_allclose(winding_numbers(BOX[:, ::-1], points), [-1, -1, 0], atol=1e-12)


def test_box_of_no_size():
    with pytest.raises(CaseError, match="positive"):
        box_surface((1.0, 0.0, 2.0))


def test_closed_shells_without_volume_are_dropped_and_told():
    """A pocket flattened to two coincident facets encloses nothing; the box stays 1000 mm^3."""
    box = corner_points(box_surface((10.0, 10.0, 10.0)))
    flat = np.array(
        [
            [[2.0, 2.0, 5.0], [3.0, 2.0, 5.0], [2.0, 3.0, 5.0]],
            [[3.0, 2.0, 5.0], [3.0, 3.0, 5.0], [2.0, 3.0, 5.0]],
        ]
    )
    # The same square, split along its other diagonal, so that no facet is a duplicate.
    lid = np.array(
        [
            [[2.0, 2.0, 5.0], [3.0, 3.0, 5.0], [3.0, 2.0, 5.0]],
            [[2.0, 2.0, 5.0], [2.0, 3.0, 5.0], [3.0, 3.0, 5.0]],
        ]
    )
    surface, report = build_surface(np.concatenate([box, flat, lid]))
    assert enclosed_volume(surface) == pytest.approx(1000.0, rel=1e-12)
    assert any("without volume" in w for w in report.warnings)

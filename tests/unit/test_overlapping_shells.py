"""Shells that overlap themselves or each other, holes by reversed shells, fragments and strays."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from damaged_shapes import ANNULUS, CUBE, box, ring, swept

from gradedesign.errors import PartError
from gradedesign.geometry.part import _weld
from gradedesign.geometry.part._self_crossing import require_simple
from gradedesign.geometry.part._weld import core_points, weld
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import (
    area_vectors,
    enclosed_volume,
    open_edge_count,
)


def answer(corners, **options):
    surface, report = build_surface(corners, **options)
    assert open_edge_count(surface) == 0
    return enclosed_volume(surface), report


@pytest.mark.parametrize("turns", [1.13, 1.55, 2.6])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_shell_that_sweeps_into_itself_is_united_with_itself(turns, reverse):
    corners = ring(turns)
    volume, report = answer(corners[:, ::-1] if reverse else corners)
    assert volume == pytest.approx(ANNULUS, rel=2e-3)
    assert report.shells_united == 1
    (note,) = (w for w in report.warnings if "itself" in w)
    assert f"{volume:.6g} mm^3, counted as it was" in note
    assert "around (" in note


def test_a_crossing_path_is_united_where_it_crosses():
    """A bar of 4 x 4 mm along a loop of square corners, through itself once: by its boxes."""
    path = np.array([[0, 0], [40, 0], [40, 20], [20, 20], [20, -20]], dtype=float)
    # Mitred corners: offsets of 2 mm to both sides of every leg.
    side = np.array([[0, 2], [-2, 2], [-2, -2], [2, -2], [2, 0]], dtype=float)
    stations = np.array(
        [
            [[*(p - s), 0.0], [*(p + s), 0.0], [*(p + s), 4.0], [*(p - s), 4.0]]
            for p, s in zip(path, side, strict=True)
        ]
    )
    volume, report = answer(swept(stations))
    # Axes of 40 + 20 + 20 + 40 mm with a cross-section of 16 mm^2, less 4 x 4 x 4 counted twice.
    assert volume == pytest.approx(120.0 * 16.0 - 64.0, rel=1e-9)
    assert report.shells_united == 1


def test_a_shell_partly_inside_out_is_refused():
    outline = np.array([[0.0, 0.0], [30.0, 20.0], [30.0, 0.0], [0.0, 12.0]])
    stations = np.array([np.column_stack([outline, np.full(4, z)]) for z in (0.0, 10.0)])
    with pytest.raises(PartError, match=r"passes through itself at .*around.*inside out"):
        build_surface(swept(stations))


def test_a_scratch_is_told_and_left():
    """A pocket whose floor is pulled 0.05 mm through the other side by a single corner."""
    corners = np.array([f for f in CUBE if not (f[:, 2] == 20.0).all()])
    tip, top = np.array([10.0, 10.0, -0.05]), np.array([[0, 0], [20, 0], [20, 20], [0, 20]])
    ring_points = np.column_stack([10.0 + 0.1 * (top - 10.0), np.full(4, 20.0)])
    rim = np.column_stack([top, np.full(4, 20.0)])
    lid = []
    for k in range(4):
        m = (k + 1) % 4
        lid += [[rim[k], rim[m], ring_points[m]], [rim[k], ring_points[m], ring_points[k]]]
        lid.append([ring_points[k], ring_points[m], tip])
    volume, report = answer(np.concatenate([corners, np.array(lid)]))
    assert volume == pytest.approx(8000.0 - 4.0 * 20.05 / 3.0, rel=1e-9)
    assert any("passes through itself" in w and "may be wrong" in w for w in report.warnings)


def test_a_reversed_shell_that_pokes_out_is_a_hole():
    """A bar of 4 x 4 mm through a cube of 20 mm: 8000 - 16 x 20 = 7680 mm^3, not 8320."""
    corners = np.concatenate([CUBE, box((8, 8, -5), (12, 12, 25), reverse=True)])
    volume, report = answer(corners)
    assert volume == pytest.approx(7680.0, rel=1e-12)
    assert any("reach out of the solid were taken as holes" in w for w in report.warnings)


def test_a_reversed_shell_cuts_all_bodies_that_it_crosses():
    far = CUBE + np.array([0.0, 0.0, 40.0])
    bar = box((8, 8, -5), (12, 12, 65), reverse=True)
    volume, report = answer(np.concatenate([CUBE, far, bar]), bodies="all")
    assert volume == pytest.approx(2 * 7680.0, rel=1e-12)
    assert report.bodies == 2


def test_crossing_voids_are_one_void():
    """Bars of 4 x 4 x 16 mm along x and y: 2 x 256 - 64 mm^3."""
    one = box((2, 8, 8), (18, 12, 12), reverse=True)
    other = box((8, 2, 8), (12, 18, 12), reverse=True)
    volume, _ = answer(np.concatenate([CUBE, one, other]))
    assert volume == pytest.approx(8000.0 - 448.0, rel=1e-12)


def test_a_larger_reversed_shell_across_is_unclear():
    """A file that is inside out, or a body of which the normals are wrong: both can be meant."""
    with pytest.raises(PartError, match="unclear what is solid"):
        build_surface(np.concatenate([CUBE[:, ::-1], box((8, 8, -5), (12, 12, 25))]))
    with pytest.raises(PartError, match="unclear what is solid"):
        build_surface(np.concatenate([CUBE, box((10, -20, -20), (60, 40, 40), reverse=True)]))


def test_the_void_of_one_solid_in_another_is_unclear():
    void = box((14, 8, 8), (19, 12, 12), reverse=True)
    with pytest.raises(PartError, match="the void of one solid crosses another"):
        build_surface(np.concatenate([CUBE, void, CUBE + np.array([16.0, 0.0, 0.0])]))


def test_a_part_cut_away_wholly_is_refused():
    halves = box((-1, -1, -1), (12, 21, 21), reverse=True), box((9, -1, -1), (21, 21, 21))
    with pytest.raises(PartError, match="cut away"):
        build_surface(np.concatenate([CUBE, halves[0], halves[1][:, ::-1]]))


def many_cubes(count: int, size: float) -> np.ndarray:
    one = box((0, 0, 0), (size, size, size))
    places = [np.array([40 + 3.0 * (k % 20), 3.0 * (k // 20), 0.0]) for k in range(count)]
    return np.concatenate([one + place for place in places])


def test_many_fragments_are_not_dropped():
    """300 cubes of 7.5 mm^3, each under 0.1 %, 28 % of the volume together."""
    size = 7.5 ** (1 / 3)
    corners = np.concatenate([CUBE, many_cubes(300, size)])
    with pytest.raises(PartError, match="301 separate solids"):
        build_surface(corners)
    volume, report = answer(corners, bodies="all")
    assert volume == pytest.approx(8000.0 + 300 * 7.5, rel=1e-9)
    assert report.fragments_dropped == 0


def test_overlapping_fragments_are_dropped():
    fragment = box((30, 0, 0), (30.3, 0.3, 0.3))
    volume, report = answer(np.concatenate([CUBE, fragment, fragment + 0.1]))
    assert volume == pytest.approx(8000.0, rel=1e-12)
    assert report.fragments_dropped == 2


def test_a_stray_facet_is_named_and_does_not_weld_the_rest():
    """With the tolerance of the whole box, 9 mm, the cube would be one point."""
    stray = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]) + 5e6
    fine = np.concatenate([CUBE, stray])
    with pytest.raises(PartError, match=r"1 holes.*at \(5e\+06, 5e\+06, 5e\+06\) mm"):
        build_surface(fine)
    volume, report = answer(fine, repair="auto")
    assert volume == pytest.approx(8000.0, rel=1e-6)
    assert report.weld_tolerance == pytest.approx(1e-6 * np.sqrt(3) * 20.0)


def test_a_long_thin_part_has_no_strays():
    rod = box((0, 0, 0), (1000, 1, 1)).reshape(-1, 3)
    np.testing.assert_array_equal(core_points(rod), rod)
    plate_and_pin = np.concatenate([np.tile(rod, (40, 1)), [[0, 0, 5000.0], [1, 0, 5000.0]]])
    assert len(core_points(plate_and_pin)) == len(plate_and_pin)


def test_corners_closer_than_the_tolerance_are_refused_before_memory_runs_out(monkeypatch):
    monkeypatch.setattr(_weld, "_MOST_PAIRS", 20)
    with pytest.raises(PartError, match="28 pairs of corners lie within 100 mm"):
        weld(CUBE, 100.0, "part")  # 8 corners: 28 pairs


def split_along(facet, start, shares) -> list:
    """A facet with its edge from ``start`` split, and flat facets that close it to the old edge."""
    k = int(np.flatnonzero((facet == start).all(axis=1))[0])
    a, b, c = np.roll(facet, -k, axis=0)
    chain = [a, *(a + s * (b - a) for s in shares), b]
    fan = [[p, q, c] for p, q in pairwise(chain)]
    return fan + [[a, q, p] for p, q in pairwise(chain[1:])]


@pytest.mark.parametrize("order", [1, -1])
def test_facets_made_collinear_are_no_holes(order):
    """Both sides of an edge are split at points of their own, closed by facets without area."""
    a, b, _ = CUBE[0]
    other = next(k for k in range(1, 12) if {tuple(a), tuple(b)} < set(map(tuple, CUBE[k])))
    facets = split_along(CUBE[0], a, (0.1, 0.35, 0.5)) + split_along(CUBE[other], b, (0.2, 0.6))
    corners = np.concatenate([np.delete(CUBE, [0, other], axis=0), np.array(facets)[::order]])
    volume, report = answer(corners)
    assert volume == pytest.approx(8000.0, rel=1e-12)
    assert report.degenerate_removed == 5


def test_a_seam_whose_flat_facets_were_left_out_is_no_hole():
    """Two edges of a facet, split differently on both sides, with nothing between."""
    a, b, c = CUBE[0]

    def beyond(p, q):
        return next(k for k in range(1, 12) if {tuple(p), tuple(q)} < set(map(tuple, CUBE[k])))

    facets = split_along(CUBE[0], a, (0.1, 0.35, 0.5))[:4]
    facets += split_along(CUBE[beyond(a, b)], b, (0.2, 0.6))[:3]
    facets += split_along(CUBE[beyond(b, c)], c, (0.7,))[:2]
    rest = np.delete(CUBE, [0, beyond(a, b), beyond(b, c)], axis=0)
    volume, report = answer(np.concatenate([rest, np.array(facets)]))
    assert volume == pytest.approx(8000.0, rel=1e-12)
    # By hand: 0.4 and 0.8 lie on the third and fourth piece, 0.1, 0.35 and 0.5 on two beyond;
    # the fourth piece has the edge from b to c as well.
    assert report.facets_split == 4
    assert report.warnings == ("part: 4 facets split where corners of others lie on their edges",)


def test_what_is_left_counted_twice_is_refused():
    vertices = np.concatenate([CUBE.reshape(-1, 3), CUBE.reshape(-1, 3) + 5.0])
    faces = np.arange(len(vertices)).reshape(-1, 3)
    with pytest.raises(PartError, match=r"overlap.*counted again"):
        require_simple(vertices, faces, "part")


def test_a_wall_without_thickness_between_voids_is_no_contact():
    """Facets lie on each other there, with void on both sides: nothing is joined."""
    voids = box((2, 2, 2), (10, 18, 18), reverse=True), box((10, 5, 5), (18, 15, 15), reverse=True)
    volume, report = answer(np.concatenate([CUBE, *voids]))
    assert volume == pytest.approx(8000.0 - 8 * 16 * 16 - 8 * 10 * 10, rel=1e-12)
    assert (report.changes, report.common_area, report.warnings) == ({}, 0.0, ())


def test_bodies_that_touch_and_overlap_others_are_one():
    """Two bars side by side, and a third through both: where they touch no slit is left."""
    bars = [((0, 0, 0), (10, 40, 10)), ((10, 5, 2), (20, 35, 9)), ((5, 15, 1), (30, 25, 8))]
    turn = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
    corners = np.concatenate([box(*bar) for bar in bars]) @ (turn * np.linalg.det(turn))
    surface, report = build_surface(corners.astype(np.float32).astype(float))
    cells = np.zeros((32, 42, 12), dtype=int)
    for low, high in bars:
        cells[tuple(slice(a + 1, b + 1) for a, b in zip(low, high, strict=True))] = 1
    assert enclosed_volume(surface) == pytest.approx(cells.sum(), rel=1e-6)
    area = np.linalg.norm(area_vectors(surface), axis=1).sum()
    assert area == pytest.approx(sum(np.abs(np.diff(cells, axis=k)).sum() for k in range(3)))
    assert (report.bodies, report.shells_united) == (1, 3)

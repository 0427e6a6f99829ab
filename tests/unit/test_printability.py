"""Islands, voids, throats, growth and support of shapes whose answers are known by hand."""

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from gradedesign.design.printing.feather_edges import feather_edges
from gradedesign.design.printing.layer_islands import layer_islands
from gradedesign.design.printing.overhang import overhang
from gradedesign.design.printing.print_schema import PrintLimitsSpec, PrintSpec
from gradedesign.design.printing.printability import grid_step, measure_printability
from gradedesign.design.printing.voids import measure_voids
from gradedesign.design.printing.wall_thickness import wall_thickness
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.grid_classifier import grid_around, solid_voxels
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

UP = np.array([0.0, 0.0, 1.0])
Z = np.eye(3)


def boxes(*pairs):
    """The union of boxes ``(lower, edges)``."""
    whole = sum((Manifold.cube(edges).translate(low) for low, edges in pairs), Manifold())
    mesh = whole.to_mesh64()
    return SurfaceMesh(
        vertices=np.asarray(mesh.vert_properties)[:, :3],
        faces=np.asarray(mesh.tri_verts).astype(np.int64),
    )


def box_at(low, edges):
    box = box_surface(edges)
    return SurfaceMesh(vertices=box.vertices + np.array(low), faces=box.faces)


def shell(hole):
    """A ball of radius 5 mm with a void of radius 4 mm and a hole of a diameter along z."""

    def field(p):
        r = np.sqrt((p**2).sum(axis=0))
        bored = np.minimum(0.5 * hole - np.hypot(p[0], p[1]), p[2])
        solid = np.maximum(r - 5.0, 4.0 - r)
        return np.maximum(solid, bored) if hole else solid

    return extract_surface(field, [-5.5] * 3, [5.5] * 3, 0.2)


BALL = extract_surface(lambda p: np.sqrt((p**2).sum(axis=0)) - 5.0, [-5.5] * 3, [5.5] * 3, 0.2)


def voids(surface, outline, step, min_throat):
    grid = grid_around(outline, Z, step, 12)
    return measure_voids(
        surface, solid_voxels(surface, grid), solid_voxels(outline, grid), grid, min_throat
    )


def test_voxels_hold_the_volume_and_its_overlaps_once():
    one = box_surface((3.0, 2.0, 1.0))
    both = SurfaceMesh(
        vertices=np.concatenate([one.vertices, one.vertices + np.array([1.0, 0, 0])]),
        faces=np.concatenate([one.faces, one.faces + len(one.vertices)]),
    )
    for frame in (Z, Z[[1, 2, 0]]):
        grid = grid_around(both, frame, 0.1, 2)
        solid = solid_voxels(both, grid)
        assert np.count_nonzero(solid) * 1e-3 == pytest.approx(8.0, rel=1e-12)
        first = grid.place(np.argwhere(solid)[0])
        np.testing.assert_allclose(first, (0.05, 0.05, 0.05), atol=1e-12)


def test_a_ball_overhangs_by_the_law_of_its_caps():
    found = overhang(BALL, UP, 40.0).share_by_angle
    for angle in (20, 40, 60, 90):
        cap = (1 - np.cos(np.radians(angle))) / 2
        assert found[str(angle)] == pytest.approx(cap, abs=4e-3)


def test_support_of_a_bridge_fills_the_room_below_its_deck():
    """Pillars 2 mm wide at both ends of a deck of 10 x 4 mm, 5 mm up: 6 x 4 x 5 mm by hand."""
    bridge = boxes(
        ((0, 0, 0), (2.0, 4.0, 5.0)), ((8, 0, 0), (2.0, 4.0, 5.0)), ((0, 0, 5), (10.0, 4.0, 1.0))
    )
    assert overhang(bridge, UP, 45.0).support_volume == pytest.approx(120.0, rel=0.01)


def test_a_hanging_peg_of_a_t_is_one_island():
    """Stem and bar stand; a peg below the bar begins 3 mm above the plate, 1.5 mm under the bar."""
    tee = boxes(
        ((4, 0, 0), (2.0, 2.0, 4.5)), ((0, 0, 4.5), (10.0, 2.0, 1.0)), ((0, 0, 3), (1.0, 2.0, 1.5))
    )
    grid = grid_around(tee, Z, 0.1, 2)
    found = layer_islands(solid_voxels(tee, grid), grid)
    assert found.count == 1
    assert found.worst.area_mm2 == pytest.approx(2.0)
    assert found.worst.volume_mm3 == pytest.approx(3.0)
    assert found.worst.height_mm == pytest.approx(1.5)
    np.testing.assert_allclose(found.worst.at_mm, (0.5, 1.0, 3.05), atol=1e-9)
    # Upside down the bar lies on the plate and holds both.
    frame = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])
    grid = grid_around(tee, frame, 0.1, 2)
    assert layer_islands(solid_voxels(tee, grid), grid).count == 0


def test_two_islands_that_meet_before_they_are_held_count_twice_and_weigh_together():
    fork = boxes(
        ((0, 0, 0), (1.0, 1.0, 5.0)),
        ((2, 0, 1), (1.0, 1.0, 3.0)),
        ((4, 0, 2), (1.0, 1.0, 2.0)),
        ((2, 0, 3), (3.0, 1.0, 1.0)),
        ((0, 0, 4), (5.0, 1.0, 1.0)),
    )
    grid = grid_around(fork, Z, 0.1, 2)
    found = layer_islands(solid_voxels(fork, grid), grid)
    assert found.count == 2
    # 1 x 1 x 2 and 1 x 1 x 1 mm below the beam of 3 x 1 x 1 mm that joins them.
    assert found.worst.volume_mm3 == pytest.approx(6.0)


def test_powder_in_a_hollow_ball_is_trapped_until_a_hole_is_wide_enough():
    room = 4 / 3 * np.pi * 4.0**3
    sealed = voids(shell(0.0), BALL, 0.2, None)
    assert sealed.closed == 1
    assert sealed.trapped_volume_mm3 == pytest.approx(room, rel=0.01)
    assert sealed.trapped[0].throat_mm is None
    np.testing.assert_allclose(sealed.trapped[0].at_mm, (0, 0, 0), atol=0.4)
    bored = shell(1.6)
    assert voids(bored, BALL, 0.2, None).trapped_volume_mm3 == 0
    assert voids(bored, BALL, 0.2, 1.2).trapped_volume_mm3 == 0
    narrow = voids(bored, BALL, 0.2, 2.4)
    assert narrow.closed == 0
    # All but what lies within a throat's width of the hole.
    assert 0.8 * room < narrow.trapped_volume_mm3 < room
    worst = narrow.trapped[0]
    assert worst.way_mm == pytest.approx(1.6, abs=0.25)
    assert 3.5 < worst.throat_mm[2] < 5.2
    assert np.hypot(*worst.throat_mm[:2]) < 0.3


def test_throats_of_a_bored_block_are_its_bores():
    """Bores of 2 and 4 mm: the first holds a fifth of the voids, the second the rest."""

    def field(p):
        return np.maximum(2.0 - np.hypot(p[0] - 4, p[1]), 1.0 - np.hypot(p[0] + 4, p[1]))

    block = extract_surface(field, [-8, -4, 0], [8, 4, 6], 0.2)
    outline = box_at((-8.0, -4.0, 0.0), (16.0, 8.0, 6.0))
    found = voids(block, outline, 0.2, None)
    assert found.volume_mm3 == pytest.approx(np.pi * (4 + 1) * 6, rel=0.02)
    assert found.pore_throat_percentiles_mm["5"] == pytest.approx(2.0, abs=0.3)
    assert found.pore_throat_percentiles_mm["50"] == pytest.approx(4.0, abs=0.3)


def test_corners_of_a_free_void_trap_nothing():
    """A square channel of 3 mm: a ball of 2 mm leaves its corners, powder does not stay there."""

    def field(p):
        return 1.5 - np.maximum(np.abs(p[0]), np.abs(p[1]))

    block = extract_surface(field, [-3, -3, 0], [3, 3, 12], 0.2)
    outline = box_at((-3.0, -3.0, 0.0), (6.0, 6.0, 12.0))
    assert voids(block, outline, 0.2, 2.0).trapped_volume_mm3 == 0
    assert voids(block, outline, 0.2, 3.6).trapped_volume_mm3 > 0


def test_thickness_of_a_slab_is_its_own():
    found = wall_thickness(box_surface((20.0, 20.0, 0.8)), rays=20_000).percentiles_mm
    for percentile in ("0.1", "1", "5"):
        assert found[percentile] == pytest.approx(0.8)


def wedge(angle_deg):
    """A prism of 6 mm whose base of 10 mm and slanted face enclose an angle."""
    height = 10.0 * np.tan(np.radians(angle_deg))
    section = CrossSection([[(0.0, 0.0), (10.0, 0.0), (10.0, height)]])
    made = Manifold.extrude(section, 6.0).to_mesh64()
    return SurfaceMesh(
        vertices=np.asarray(made.vert_properties)[:, :3],
        faces=np.asarray(made.tri_verts).astype(np.int64),
    )


def test_feather_edges_are_rims_of_flat_angles():
    sharp = wedge(20.0)
    found = feather_edges(sharp, 0.5)
    # By hand: rays straight through leave within 0.5 mm over 0.5 / tan(20 deg) from the rim, seen
    # from the base and from the slanted face. 1 / sqrt(rays) is the error of a counted share.
    area = 2 * 6.0 * 0.5 / np.tan(np.radians(20.0))
    assert found.area_mm2 == pytest.approx(area, rel=0.01)
    height = 10.0 * np.tan(np.radians(20.0))
    whole = 60.0 + 60.0 / np.cos(np.radians(20.0)) + (6.0 + 10.0) * height
    assert found.share == pytest.approx(area / whole, rel=0.01)
    assert found.at_mm[0] < 0.5 / np.tan(np.radians(20.0))
    # Rims of 40 degrees are none, and thinner walls have fewer.
    assert feather_edges(wedge(40.0), 0.5).share == 0.0
    assert feather_edges(wedge(40.0), 0.5).at_mm is None
    assert feather_edges(sharp, 0.25).area_mm2 == pytest.approx(area / 2, rel=0.02)
    spec = PrintSpec(min_wall="0.5 mm")
    solid = wall_thickness(sharp, rays=1000)
    assert measure_printability(sharp, sharp, spec, solid).feathers.share == found.share
    assert measure_printability(sharp, sharp, PrintSpec(), solid).feathers is None


def test_everything_is_measured_in_the_build_direction():
    tee = boxes(((4, 0, 0), (2.0, 2.0, 4.5)), ((0, 0, 4.5), (10.0, 2.0, 1.0)))
    solid = wall_thickness(tee, rays=1000)
    spec = PrintSpec()
    up = measure_printability(tee, tee, spec, solid)
    down = measure_printability(tee, tee, spec.model_copy(update={"build_direction": "-z"}), solid)
    assert up.overhang.support_volume == pytest.approx(8 * 2 * 4.5, rel=0.02)
    assert down.overhang.support_volume == pytest.approx(0, abs=1e-6)
    assert up.voids.volume_mm3 == 0
    assert enclosed_volume(tee) == pytest.approx(38)


def test_the_grid_resolves_the_throat_that_is_stated():
    extent = np.array([100.0, 100.0, 100.0])
    coarse, _, _ = grid_step(PrintSpec(), extent)
    fine, margin, need = grid_step(PrintSpec(min_throat="1.2 mm"), extent)
    assert coarse == pytest.approx(100 / 2e6 ** (1 / 3))
    assert fine == pytest.approx(0.15)
    assert margin * fine > 0.6
    assert need > 500**3 * 20
    wide, _, _ = grid_step(PrintSpec(limits=PrintLimitsSpec(pore_throat="0.6 mm")), extent)
    assert wide == pytest.approx(0.075)

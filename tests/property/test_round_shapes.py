"""Countersinks, cones, half bores and slots are found with the sizes of their construction."""

import manifold3d
import numpy as np
import pytest
from remeshed_prism import arc, prism

from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.round_shapes import round_shapes
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

SOLID, OUTLINE = manifold3d.Manifold, manifold3d.CrossSection
#: Rounding to single precision, as a binary STL file holds it, beside sizes of some mm.
ROUNDED = 2e-5


def surface_of(solid, rng) -> SurfaceMesh:
    """A solid turned and moved by chance, rounded as an STL file would."""
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    points = (points @ turn.T + rng.uniform(-30.0, 30.0, 3)).astype(np.float32).astype(float)
    return build_surface(points[np.asarray(mesh.tri_verts).astype(int)])[0], turn[:, 2]


def shapes_of(surface):
    """Round shapes by their kind, one group of each."""
    groups = round_shapes(surface, segment_faces(surface))
    by_kind = {group.kind: group for group in groups}
    assert len(by_kind) == len(groups)
    return by_kind


def along(group, axis):
    """Sine of the angle between the axes."""
    return float(np.linalg.norm(np.cross(group.axis, axis)))


@pytest.mark.parametrize("segments", [16, 24, 60])
@pytest.mark.parametrize("half_angle", [20.0, 30.0, 41.0, 45.0, 60.0, 75.0])
def test_countersunk_bores(half_angle, segments):
    """Two bores of 6 mm, widened to 12 mm at that angle: one hole and one cone of each."""
    rng = np.random.default_rng(int(100 * half_angle) + segments)
    depth = 3.0 / np.tan(np.radians(half_angle))
    tool = SOLID.cylinder(30.0, 3.0, 3.0, segments).translate((0, 0, -5))
    tool += SOLID.cylinder(depth, 3.0, 6.0, segments).translate((0, 0, 20.0 - depth))
    body = SOLID.cube((60, 30, 20)) - tool.translate((15, 15, 0)) - tool.translate((45, 15, 0))
    surface, axis = surface_of(body, rng)
    shapes = shapes_of(surface)
    hole, cone = shapes.pop("hole"), shapes.pop("countersink or inner cone")
    assert not shapes
    assert (hole.count, cone.count) == (2, 2)
    assert hole.diameter == pytest.approx(6.0, rel=ROUNDED)
    # Of a cone of 3 mm across, single precision turns the side by some 1e-5.
    assert cone.half_angle == pytest.approx(half_angle, abs=1e-2)
    assert cone.diameter == pytest.approx(12.0, rel=1e-4)
    assert max(along(hole, axis), along(cone, axis)) < 1e-4
    # A frustum with so many sides: perimeters of the polygons over the height of a side.
    side = np.hypot(depth, 3.0 * np.cos(np.pi / segments))
    polygon = 2.0 * segments * np.sin(np.pi / segments)
    assert cone.area == pytest.approx(2 * polygon * 0.5 * (3.0 + 6.0) * side, rel=1e-4)


@pytest.mark.parametrize("segments", [16, 32])
def test_outer_cones_and_tips_of_drilled_holes(segments):
    rng = np.random.default_rng(900 + segments)
    pin = SOLID.cylinder(20.0, 10.0, 4.0, segments)
    cone = shapes_of(surface_of(pin, rng)[0]).pop("outer cone")
    assert cone.half_angle == pytest.approx(np.degrees(np.arctan(6.0 / 20.0)), abs=1e-2)
    assert cone.diameter == pytest.approx(20.0, rel=1e-4)
    tip = 3.0 / np.tan(np.radians(59.0))
    drill = SOLID.cylinder(20.0, 3.0, 3.0, segments) + SOLID.cylinder(
        tip, 0.0, 3.0, segments
    ).translate((0, 0, -tip))
    block = SOLID.cube((30, 30, 20)) - drill.translate((15, 15, 8))
    shapes = shapes_of(surface_of(block, rng)[0])
    assert set(shapes) == {"hole", "countersink or inner cone"}
    assert shapes["countersink or inner cone"].half_angle == pytest.approx(59.0, abs=1e-2)
    assert shapes["hole"].diameter == pytest.approx(6.0, rel=ROUNDED)


def ball(segments):
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, segments // 2 + 1)
    return OUTLINE([10.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)]).revolve(segments)


def ring(segments):
    turn = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    return OUTLINE([np.stack([20 + 5 * np.cos(turn), 5 * np.sin(turn)], axis=1)]).revolve(segments)


def rounded_rim(segments):
    turn = np.linspace(0.0, 0.5 * np.pi, segments // 4 + 1)
    rim = np.stack([8.0 - 3.0 * np.sin(turn), 3.0 - 3.0 * np.cos(turn)], axis=1)
    outline = np.concatenate([[[0, -1], [8, -1]], rim, [[5, 21], [0, 21]]])
    return SOLID.cube((40, 40, 20)).translate((-20, -20, 0)) - OUTLINE([outline]).revolve(segments)


@pytest.mark.parametrize("segments", [16, 24])
def test_rows_of_facets_of_balls_rings_and_rounded_rims_are_no_cones(segments):
    """Each row of them is a cone exactly."""
    rng = np.random.default_rng(1300 + segments)
    assert not shapes_of(surface_of(ball(segments), rng)[0])
    assert not shapes_of(surface_of(ring(segments), rng)[0])
    shapes = shapes_of(surface_of(rounded_rim(segments), rng)[0])
    assert list(shapes) == ["hole"]
    assert shapes["hole"].diameter == pytest.approx(10.0, rel=1e-4)


BOX = np.array([[-20.0, -15.0], [20.0, -15.0], [20.0, 15.0], [-20.0, 15.0]])


def slotted(radius, half_length, facets):
    ends = [arc((half_length, 0), radius, 90, -90, facets)]
    ends += [arc((-half_length, 0), radius, -90, -270, facets)]
    return [BOX, np.concatenate(ends)]


def half_bored(radius, facets):
    wall = arc((0.0, 15.0), radius, 0, -180, facets)
    return [np.concatenate([BOX[:3], wall, BOX[3:]])]


def chord_loss(facets):
    """Share of a radius by which the corners of a remeshed wall may lie inside of it."""
    return 1.2 * np.pi**2 / (2.0 * facets**2) + 1e-3


@pytest.mark.parametrize("facets", [24, 48, 96])
@pytest.mark.parametrize("radius", [2.5, 6.0])
def test_slots_and_half_bores_plain_and_remeshed(facets, radius):
    """A slot of a width of 2 radii over 12 mm more, and half a bore on the edge of a block."""
    height, half_length = 12.0, 6.0
    for loops, kind in (
        (slotted(radius, half_length, facets), "slot"),
        (half_bored(radius, facets), "half bore"),
    ):
        rng = np.random.default_rng(round(97 * radius) + facets)
        plain = SOLID.extrude(OUTLINE(loops, manifold3d.FillRule.EvenOdd), height)
        remeshed, turned = prism(loops, height, 2.0 * np.pi * radius / 24.0, 61 + facets)
        for (surface, axis), loss in (
            (surface_of(plain, rng), 1e-4),
            ((build_surface(remeshed)[0], turned), chord_loss(facets)),
        ):
            shapes = shapes_of(surface)
            assert list(shapes) == [kind]
            found = shapes[kind]
            assert along(found, axis) < 2e-3
            assert -loss < found.diameter / (2.0 * radius) - 1.0 < 1e-4
            wall = np.pi * radius * height
            if kind == "slot":
                assert -loss < found.length / (2.0 * (half_length + radius)) - 1.0 < 1e-4
                wall = 2.0 * wall + 2.0 * 2.0 * half_length * height
            else:
                assert found.count == 1
            # Remeshed walls have chords of 24 edges around.
            assert found.area == pytest.approx(wall, rel=chord_loss(24))

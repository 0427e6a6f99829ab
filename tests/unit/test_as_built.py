"""The as-built surface: struts against their table, edges, waviness, scatter, compensation."""

from functools import cache

import numpy as np
import pytest

from gradedesign.design.printing.as_built import as_built_surface, building_on, compensated_surface
from gradedesign.design.printing.process import Process, Waviness
from gradedesign.design.printing.process_schema import builtin_processes
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.printed_field import printed_field
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

UP = np.array([0.0, 0.0, 1.0])
SHIPPED = {process.name: process for process in builtin_processes()}
RADIUS, HALF, STEP = 0.5, 2.5, 0.1


@cache
def strut(inclination):
    """A strut of 1 mm, its axis inclined to the plate by degrees, and that axis."""
    angle = np.radians(inclination)
    axis = np.array([np.cos(angle), 0.0, np.sin(angle)])

    def field(p):
        along = np.tensordot(axis, p, axes=1)
        off = np.sqrt(np.maximum((p**2).sum(axis=0) - along**2, 0.0))
        return np.maximum(off - RADIUS, np.abs(along) - HALF)

    # An odd corner: no plane of the grid meets the axis.
    return extract_surface(field, [-3.013, -0.913, -3.013], [3.0, 0.9, 3.0], STEP), axis


def width(surface, axis):
    """Mean width of a strut across its axis: by rays from the axis, in the signed distance."""
    field = printed_field(surface, 0.5)
    side = np.cross(axis, [0.3, 1.0, 0.2])
    side /= np.linalg.norm(side)
    around = (np.arange(360) + 0.5) * 2 * np.pi / 360
    ray = np.outer(side, np.cos(around)) + np.outer(np.cross(axis, side), np.sin(around))
    found = []
    for along in np.linspace(-1.5, 1.5, 7):
        inner, outer = np.full(360, 0.2), np.full(360, 0.8)
        for _ in range(20):
            middle = 0.5 * (inner + outer)
            inside = field(along * axis[:, None] + ray * middle) < 0
            inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
        found.append(2.0 * inner.mean())
    return float(np.mean(found))


def building(process, surface, held=None, strut=2.0):
    held = np.zeros(len(surface.faces), dtype=bool) if held is None else held
    return building_on(surface, process, UP, held, strut)


@pytest.mark.parametrize("inclination", [0.0, 45.0, 90.0])
@pytest.mark.parametrize("name", ["lpbf-ti64-struts", "lpbf-ti64-diamond", "lpbf-ti21s-gyroid"])
def test_a_strut_of_1_mm_is_built_as_the_table_says(name, inclination):
    process = SHIPPED[name]
    surface, axis = strut(inclination)
    built = as_built_surface(surface, building(process, surface), 7)
    grown = width(built, axis) - width(surface, axis)
    # Normals of facets of a tenth of the strut are off by a degree or two either way.
    assert grown == pytest.approx(process.strut_size_at(inclination), abs=1e-3)


def test_planes_move_by_their_offsets_and_meet_at_edges():
    slab = box_surface((10.0, 4.0, 1.0))
    process = Process(name="p", offset=((0.0, 0.2), (90.0, 0.05), (180.0, -0.01)))
    built = as_built_surface(slab, building(process, slab), 7)
    assert built.vertices.min(axis=0) == pytest.approx([-0.05, -0.05, -0.2])
    assert built.vertices.max(axis=0) == pytest.approx([10.05, 4.05, 0.99])
    assert enclosed_volume(built) == pytest.approx(10.1 * 4.1 * 1.19)


def test_held_faces_keep_their_place():
    slab = box_surface((10.0, 4.0, 1.0))
    held = (slab.vertices[slab.faces][:, :, 0] == 10.0).all(axis=1)
    process = Process(name="p", offset=((0.0, 0.1),), waviness=Waviness(amplitude=0.01, length=1.0))
    built = as_built_surface(slab, building(process, slab, held), 7)
    assert built.vertices[:, 0].max() == pytest.approx(10.0, abs=1e-12)
    assert built.vertices[:, 0].min() == pytest.approx(-0.1, abs=0.05)


def beside(one, other, height):
    """Two surfaces as one, the second that much higher."""
    moved = other.vertices + np.array([0.0, 0.0, height])
    return SurfaceMesh(
        vertices=np.concatenate([one.vertices, moved]),
        faces=np.concatenate([one.faces, other.faces + len(one.vertices)]),
    )


def test_walls_that_shrink_to_nothing_vanish_and_gaps_that_close_are_joined():
    process = Process(name="p", offset=((0.0, -0.3),))
    thin = beside(box_surface((4.0, 4.0, 0.5)), box_surface((4.0, 4.0, 2.0)), 1.0)
    left = printed_field(as_built_surface(thin, building(process, thin), 7), 0.5)
    points = np.random.default_rng(31).uniform(-1.0, 5.0, (3, 2000))
    points[2] = 0.8 * (points[2] + 1.0) / 6.0 - 0.2
    assert (left(points) > 0).all()
    assert left(np.array([[2.0], [2.0], [2.5]]))[0] < 0
    grows = Process(name="p", offset=((0.0, 0.3),))
    one, gap = box_surface((4.0, 4.0, 1.0)), 0.4
    pair = beside(one, one, 1.0 + gap)
    joined = printed_field(as_built_surface(pair, building(grows, pair), 7), 0.5)
    assert joined(np.array([[2.0], [2.0], [1.0 + gap / 2]]))[0] < 0


def test_waviness_has_its_amplitude_and_length_and_follows_its_seed():
    amplitude, length = 0.02, 0.5
    plate = extract_surface(lambda p: np.abs(p[2]) - 0.3, [0, 0, -1], [16, 16, 1], 0.2)
    wavy = Process(name="p", waviness=Waviness(amplitude=amplitude, length=length))
    build = building(wavy, plate)
    built = as_built_surface(plate, build, 7)
    inside = ((plate.vertices[:, :2] > 1) & (plate.vertices[:, :2] < 15)).all(axis=1)
    top = inside & (plate.vertices[:, 2] > 0.29)
    height = built.vertices[top, 2] - 0.3
    # About (14 / 0.5)^2 / 2 pi = 125 independent patches: the deviation is known to 1 / sqrt(250).
    assert height.std() == pytest.approx(amplitude, rel=4 / np.sqrt(250))
    place = plate.vertices[top, :2]
    apart = np.linalg.norm(place[:, None] - place[None, ::7], axis=2)
    product = height[:, None] * height[None, ::7] / amplitude**2
    near = np.abs(apart - 0.4) < 0.01  # two steps of the grid
    assert product[near].mean() == pytest.approx(np.exp(-0.5 * (0.4 / length) ** 2), abs=0.15)
    assert (as_built_surface(plate, build, 7).vertices == built.vertices).all()
    assert not np.allclose(as_built_surface(plate, build, 8).vertices, built.vertices)


def test_scatter_is_of_the_width_and_only_in_variants():
    surface, axis = strut(90.0)
    process = Process(name="p", strut_size=((0.0, 0.04),), scatter=0.05)
    build = building(process, surface, strut=50.0)
    plain = width(surface, axis)
    assert width(as_built_surface(surface, build, 7), axis) - plain == pytest.approx(0.04, abs=1e-3)
    widths = [
        width(as_built_surface(surface, build, seed, scattered=True), axis) - plain
        for seed in range(20, 36)
    ]
    # Of 16 samples the mean is known to 0.05 / sqrt(16), the deviation to 1 / sqrt(32).
    assert np.mean(widths) == pytest.approx(0.04, abs=3 * 0.05 / np.sqrt(16))
    assert np.std(widths) == pytest.approx(0.05, rel=3 / np.sqrt(32))


@pytest.mark.parametrize("inclination", [0.0, 45.0, 90.0])
def test_what_is_built_of_a_compensated_strut_is_the_designed_one(inclination):
    process = SHIPPED["lpbf-ti64-struts"]
    surface, axis = strut(inclination)
    build = building(process, surface)
    found = compensated_surface(surface, build)
    designed, made = width(surface, axis), width(found.surface, axis)
    # It is thinner by about what it will grow, and the rest of the growth follows its own shape.
    assert designed - made > 0.5 * process.strut_size_at(inclination)
    built = width(as_built_surface(found.surface, build, 7), axis)
    # What is left at single vertices is of both signs: its mean is below its root mean square.
    assert built == pytest.approx(designed, abs=found.rms_mm)
    assert found.rms_mm < 0.012

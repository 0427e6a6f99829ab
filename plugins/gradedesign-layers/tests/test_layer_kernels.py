"""Runs, components and contours of layers beside slow versions of the same."""

import numpy as np
import pytest
from scipy import ndimage

from gradedesign_layers import _contour_kernels as kernels
from gradedesign_layers.contours import Tracer, enclosed_areas, signed_area
from gradedesign_layers.layer_stack import Layers
from gradedesign_layers.layers import _connected, _layer

#: Directed segments of a square by its solid corners, see `_contour_kernels`.
SEGMENTS = {
    1: ((0, 3),), 2: ((1, 0),), 4: ((2, 1),), 8: ((3, 2),),
    3: ((1, 3),), 6: ((2, 0),), 12: ((3, 1),), 9: ((0, 2),),
    14: ((3, 0),), 13: ((0, 1),), 11: ((1, 2),), 7: ((2, 3),),
    5: ((0, 3), (2, 1)), 10: ((1, 0), (3, 2)),
}  # fmt: skip


def slow_contours(values):
    """Contours by lists of segments between numbered edges, followed one by one."""
    nx, ny = values.shape

    def edge(side, i, j):
        along_y = side in (1, 3)
        return along_y * nx * ny + (i + (side == 1)) * ny + j + (side == 2)

    following = {}
    for i in range(nx - 1):
        for j in range(ny - 1):
            corners = (values[i, j], values[i + 1, j], values[i + 1, j + 1], values[i, j + 1])
            code = sum(2**n for n, v in enumerate(corners) if v < 0)
            for begun, ended in SEGMENTS.get(code, ()):
                following[edge(begun, i, j)] = edge(ended, i, j)

    def place(number):
        along_y, at = divmod(number, nx * ny)
        i, j = divmod(at, ny)
        here, there = values[i, j], values[i + 1 - along_y, j + along_y]
        share = here / (here - there)
        return (i, j + share) if along_y else (i + share, j)

    polygons, seen = [], set()
    for first in sorted(following):
        cycle, now = [], first
        while now not in seen:
            seen.add(now)
            cycle.append(place(now))
            now = following[now]
        if cycle:
            points = np.array(cycle)
            chord = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
            to = points - np.roll(points, 1, axis=0)
            off = np.abs(chord[:, 0] * to[:, 1] - chord[:, 1] * to[:, 0])
            bent = off > kernels.STRAIGHT * np.maximum(np.hypot(*chord.T), 1e-12)
            polygons.append(points[bent] if bent.sum() >= 3 else points)
    return polygons


def contours(values):
    """Closed polygons ``(n, 2)`` around what is negative in a layer ``(nx, ny)``."""
    places, first = Tracer(values.shape).polygons(values)
    return np.split(places, first[1:-1]) if len(first) > 1 else []


def noise(random, shape, smooth):
    values = ndimage.gaussian_filter(random.normal(size=shape), smooth)
    values[[0, -1]] = values[:, [0, -1]] = 1.0
    return np.where(values == 0, 1.0, values)


@pytest.mark.parametrize("smooth", [0.0, 1.0, 3.0])
def test_contours_equal_those_of_single_segments(smooth):
    random = np.random.default_rng(77)
    tracer = Tracer((40, 31))
    for _ in range(4):
        values = noise(random, (40, 31), smooth)
        places, first = tracer.polygons(values)
        slow = slow_contours(values)
        assert len(first) - 1 == len(slow) > 0
        for low, high, meant in zip(first, first[1:], slow, strict=False):
            np.testing.assert_allclose(places[low:high], meant, atol=1e-12)
        np.testing.assert_allclose(enclosed_areas(places, first), [signed_area(p) for p in slow])
    assert contours(np.ones((5, 5))) == []


@pytest.mark.parametrize("bodies", [1, 3])
def test_components_equal_those_of_labelled_voxels(bodies):
    random = np.random.default_rng(9)
    values = np.stack([noise(random, (30, 26), 0.0) for _ in range(12)])
    values = ndimage.gaussian_filter(values, 0.8) - 0.05
    values[:, [0, -1]] = values[:, :, [0, -1]] = 1.0
    empty = Layers(
        frame=np.eye(3), lower=np.zeros(3), shape=(30, 26), pixel=0.5, height=0.25, layers=()
    )
    layers = _connected(empty, map(_layer, values), bodies)
    label, count = ndimage.label(values < 0)
    size = np.bincount(label.ravel())[1:]
    assert count > 5
    kept = 1 + np.argsort(-size, kind="stable")[:bodies]
    meant = np.isin(label, kept)
    assert layers.dropped == count - bodies
    assert layers.dropped_share == pytest.approx(1 - size[kept - 1].sum() / size.sum())
    for number, solid in enumerate(meant):
        np.testing.assert_array_equal(layers.solid(number), solid)
        near = np.zeros_like(solid)
        for axis in range(2):
            change = np.diff(solid, axis=axis)
            near |= np.pad(change, [(0, 1), (0, 0)] if axis == 0 else [(0, 0), (0, 1)])
            near |= np.pad(change, [(1, 0), (0, 0)] if axis == 0 else [(0, 0), (1, 0)])
        beside = values[number][near].astype(np.float32)
        np.testing.assert_array_equal(layers.layers[number].beside, beside)
    for axis, (middles, volumes) in enumerate(layers.axis_volumes()):
        counts = meant.transpose(1, 2, 0).sum(axis=tuple({0, 1, 2} - {axis}))
        np.testing.assert_allclose(volumes, counts * 0.5**2 * 0.25)
        steps = (0.5, 0.5, 0.25)[axis]
        np.testing.assert_allclose(np.diff(middles), steps)


def test_contours_go_around_solid_with_the_solid_on_the_left():
    x, y = np.meshgrid(np.arange(41) / 10 - 2, np.arange(41) / 10 - 2, indexing="ij")
    ring = np.abs(np.hypot(x, y) - 1.25) - 0.5 + 1e-9
    loops = contours(ring)
    areas = sorted(signed_area(p) / 100 for p in loops)
    np.testing.assert_allclose(areas, [-np.pi * 0.75**2, np.pi * 1.75**2], rtol=5e-3)
    # Two pixels that touch at a corner are two solids.
    two = np.ones((4, 4))
    two[1, 1] = two[2, 2] = -1.0
    assert [signed_area(p) for p in contours(two)] == [0.5, 0.5]

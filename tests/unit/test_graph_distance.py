"""Periodic graphs; expected numbers are lengths, angles and volumes of elementary geometry."""

from itertools import product

import numpy as np
import pytest

from gradedesign import PluginError
from gradedesign.fields import (
    bond_graph,
    graph_segments,
    near_segments,
    periodic_distance_to_graph,
    periodic_distance_to_segments,
    segment_symmetry,
)

CORNER = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
CUBES = [[0, 1], [0, 2], [0, 3]]
FCC = [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]]
POINTS = np.random.default_rng(523).uniform(-2.5, 2.5, (3, 700))


def lengths(segments):
    return np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)


def slow_distance(segments, points, thickness, normals):
    """Least over every segment and every copy in reach: the plain meaning."""
    inside = points - np.floor(points)
    least = np.full(points.shape[1], np.inf)
    for (start, end), relative, sides in zip(segments, thickness, normals, strict=True):
        length = np.linalg.norm(end - start)
        axis = (end - start) / length if length else np.zeros(3)
        middle = np.floor(0.5 * (start + end))
        for shift in product(range(-2, 3), repeat=3):
            away = inside - (start - middle + shift)[:, None]
            along = axis @ away
            if len(sides):
                value = np.maximum(np.maximum(0, -along), along - length)
                value = np.maximum(value, (sides @ away).max(axis=0))
            else:
                value = np.linalg.norm(away - np.clip(along, 0, length) * axis[:, None], axis=0)
            least = np.minimum(least, value / relative)
    return least


def prisms(segments, sides):
    """Normals about each segment, turned by its number so that none is special."""
    rows = []
    for i, (start, end) in enumerate(segments):
        axis = (end - start) / np.linalg.norm(end - start)
        first = np.cross(axis, [0.31, 0.62, -0.72])
        first /= np.linalg.norm(first)
        angle = i + 2 * np.pi * np.arange(sides)[:, None] / sides
        rows.append(np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))
    return np.array(rows)


def random_segments(count=5):
    rng = np.random.default_rng(77)
    start = rng.uniform(-1, 1, (count, 3))
    return np.stack([start, start + rng.uniform(-0.9, 0.9, (count, 3))], axis=1)


@pytest.mark.parametrize("sides", [0, 3, 4, 6])
@pytest.mark.parametrize(
    "segments",
    [graph_segments(*bond_graph(FCC, 0.5**0.5)), random_segments()],
    ids=["octet", "random"],
)
@pytest.mark.parametrize("uneven", [False, True])
def test_distance_is_that_of_the_slow_loop(segments, sides, uneven):
    thickness = np.linspace(1.0, 3.0 if uneven else 1.0, len(segments))
    normals = prisms(segments, sides) if sides else np.zeros((len(segments), 0, 3))
    field = periodic_distance_to_segments(segments, thickness=thickness, normals=normals)
    expected = slow_distance(segments, POINTS, thickness, normals)
    np.testing.assert_allclose(field(POINTS), expected, rtol=0, atol=1e-14)


def test_points_are_segments_of_no_length():
    field = periodic_distance_to_segments([[[0.2, 0.0, 0.9]] * 2])
    away = POINTS - np.array([[0.2], [0.0], [0.9]])
    expected = np.linalg.norm(away - np.round(away), axis=0)
    np.testing.assert_allclose(field(POINTS), expected, atol=1e-14)


def test_segments_of_a_long_period_repeat_after_it():
    segments = 3.0 * random_segments(9)
    field = periodic_distance_to_segments(segments, period=3)
    expected = 3.0 * slow_distance(segments / 3.0, POINTS / 3.0, np.ones(9), np.zeros((9, 0, 3)))
    np.testing.assert_allclose(field(POINTS), expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(field(POINTS + 3.0), expected, rtol=0, atol=1e-13)


def test_output_follows_shape_and_float_type():
    field = periodic_distance_to_graph(CORNER, CUBES)
    grid = POINTS[:, :60].reshape(3, 3, 4, 5)
    before = grid.copy()
    np.testing.assert_array_equal(field(grid).ravel(), field(POINTS[:, :60]))
    np.testing.assert_array_equal(grid, before)
    single = field(grid.astype(np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, field(grid), atol=1e-6)
    assert field(np.array([-1e-20, 0.3, 0.2])) == pytest.approx(0.2)


def test_a_bond_graph_finds_every_strut_once():
    # Nearest neighbours of the face-centred lattice: 12 at each of 4 sites, each strut shared.
    nodes, edges = bond_graph(FCC, 0.5**0.5)
    segments = graph_segments(nodes, edges)
    assert len(edges) == len(segments) == 24
    np.testing.assert_allclose(lengths(segments), 0.5**0.5, rtol=1e-12)
    both = bond_graph([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]], [0.75**0.5, 1.0])
    assert len(graph_segments(*both)) == 8 + 6


def test_copies_of_a_strut_count_once():
    # All twelve edges of the cube are three struts of the cell, each shared by four cubes.
    corners = np.array(list(product((0.0, 1.0), repeat=3)))
    edges = [
        (i, j) for i in range(8) for j in range(i) if np.abs(corners[i] - corners[j]).sum() == 1
    ]
    assert len(edges) == 12
    assert len(graph_segments(corners, edges)) == 3


@pytest.mark.parametrize(
    ("nodes", "edges", "message"),
    [
        ([*CORNER, [0.5, 0.5, 0.25]], CUBES, r"node 4 \(0.5, 0.5, 0.25\) is isolated"),
        ([*CORNER, [0.9, 0, 0]], [*CUBES, [0, 4]], r"only one strut ends at node 4 \(0.9, 0, 0\)"),
        (CORNER, [*CUBES, [2, 2]], r"strut 3 from node 2 \(0, 1, 0\) to node 2 .* length zero"),
        (CORNER, [*CUBES, [2, 7]], "strut 3 joins nodes 2 and 7, but the graph has nodes 0 to 3"),
        ([*CORNER, [np.nan, 0, 0]], CUBES, r"node 4 \(nan, 0, 0\).*not finite"),
        (CORNER, [[0.0, 1.0]], "whole numbers"),
        (CORNER, [], "expected"),
        ([[0.0, 0.0]], CUBES, r"shape \(1, 2\)"),
    ],
)
def test_broken_graphs_are_named(nodes, edges, message):
    with pytest.raises(PluginError, match=message):
        graph_segments(nodes, edges)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bond_graph([[0, 0, 0]], 0.4), "the nearest are 1 cells apart"),
        (lambda: bond_graph([[0, 0, 0]], 1.4), "at most 1"),
        (lambda: periodic_distance_to_segments(np.zeros((0, 2, 3))), "shape"),
        (lambda: periodic_distance_to_segments(np.zeros((1, 2, 3)), thickness=0.0), "thickness"),
        (lambda: periodic_distance_to_segments(np.full((1, 2, 3), np.inf)), "finite"),
        (
            lambda: periodic_distance_to_segments(np.zeros((1, 2, 3)), normals=np.ones((1, 2, 3))),
            "3 or more",
        ),
        (lambda: near_segments(np.zeros((1, 2, 3)), 5.0), "reach of 5 cells"),
    ],
)
def test_impossible_arguments_are_refused(call, message):
    with pytest.raises(PluginError, match=message):
        call()


def test_near_segments_holds_every_copy_in_reach():
    segments, reach = random_segments(), 0.7
    near = near_segments(segments, reach, bins=4)
    inside = POINTS - np.floor(POINTS)
    place = np.ravel_multi_index(tuple(np.floor(4 * inside).astype(int)), (4, 4, 4))
    for i in range(20):
        rows = near.member[near.first[place[i]] : near.first[place[i] + 1]]
        away = inside[:, i] - near.start[rows]
        foot = np.clip((away * near.axis[rows]).sum(axis=1), 0, near.length[rows])
        distance = np.linalg.norm(away - foot[:, None] * near.axis[rows], axis=1)
        count = 0
        for (start, end), shift in product(segments, product(range(-3, 4), repeat=3)):
            beside = inside[:, i] - start - np.array(shift)
            axis = (end - start) / np.linalg.norm(end - start)
            along = np.clip(beside @ axis, 0, np.linalg.norm(end - start))
            count += np.linalg.norm(beside - along * axis) <= reach
        assert np.count_nonzero(distance <= reach) == count


@pytest.mark.parametrize(
    ("segments", "thickness", "symmetry"),
    [
        (graph_segments(CORNER, CUBES), 1.0, "cubic"),
        (graph_segments(*bond_graph(FCC, 0.5**0.5)), 1.0, "cubic"),
        (graph_segments(*bond_graph([*FCC, *(np.array(FCC) + 0.25)], 0.1875**0.5)), 1.0, "cubic"),
        (graph_segments(CORNER, CUBES), [1.0, 1.0, 1.5], "tetragonal"),
        (graph_segments(CORNER, CUBES), [1.5, 1.0, 1.0], "orthotropic"),
        (graph_segments(CORNER, CUBES), [1.5, 1.0, 2.0], "orthotropic"),
        (random_segments(), 1.0, "none"),
    ],
)
def test_symmetry_is_that_of_the_struts(segments, thickness, symmetry):
    # Where the cell begins makes no difference.
    for shift in (0.0, [0.137, 0.291, 0.853]):
        assert segment_symmetry(segments + np.array(shift), thickness=thickness) == symmetry


def test_symmetry_sees_the_sections():
    segments = graph_segments(CORNER, CUBES)
    square = np.array(
        [[axis for j in range(3) if j != i for axis in (np.eye(3)[j], -np.eye(3)[j])]
         for i in range(3)]
    )  # fmt: skip
    assert segment_symmetry(segments, normals=square) == "cubic"
    turn = np.array([[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    turned = square.copy()
    turned[2] = square[2] @ turn
    assert segment_symmetry(segments, normals=turned) == "none"

"""Closest points, signed distances and winding numbers beside libigl, in one run.

A bumpy sphere and points all over its box; the least of three processor times each, after
compilation. Start it with NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1.
"""

import time

import igl
import numpy as np

from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_features
from gradedesign.geometry.triangles.winding import winding_numbers

POINTS = 20_000
#: Both read all triangles for each point, so fewer of either.
WINDING_POINTS = 200


def bumpy_sphere(n):
    """Closed surface of 4 n^2 triangles, about 100 mm across."""
    theta = np.pi * np.arange(1, n) / n
    phi = 2 * np.pi * np.arange(2 * n) / (2 * n)
    t, p = (x.ravel() for x in np.meshgrid(theta, phi, indexing="ij"))
    r = 50 * (1 + 0.1 * np.cos(5 * t) * np.sin(7 * p))
    ring = r * np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    vertices = np.concatenate([ring.T, [[0, 0, 45.0], [0, 0, -55.0]]])
    north, south = len(vertices) - 2, len(vertices) - 1
    faces = []
    for j in range(2 * n):
        k = (j + 1) % (2 * n)
        faces += [(north, j, k), (south, (n - 2) * 2 * n + k, (n - 2) * 2 * n + j)]
        for i in range(n - 2):
            a, b = i * 2 * n, (i + 1) * 2 * n
            faces += [(a + j, b + j, b + k), (a + j, b + k, a + k)]
    return SurfaceMesh(vertices=vertices, faces=np.array(faces, dtype=np.int64))


def least(function):
    """Least processor time of three calls after one, s, and the last answer."""
    answer, times = function(), []
    for _ in range(3):
        start = time.process_time()
        answer = function()
        times.append(time.process_time() - start)
    return min(times), answer


def compare(surface):
    """Print a line for each comparison on one surface."""
    points = np.random.default_rng(20261122).uniform(-60, 60, (3, POINTS))
    vertices, faces = np.ascontiguousarray(surface.vertices), surface.faces
    rows = np.ascontiguousarray(points.T)
    few = rows[:WINDING_POINTS].copy()
    corners = corner_points(surface)
    tree, field = build_triangle_tree(corners), surface_distance(surface)
    box = igl.AABB()
    box.init(vertices, faces)
    signed = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    pairs = {
        "closest points, tree ready": (
            lambda: closest_features(tree, points).distance,
            lambda: np.sqrt(box.squared_distance(vertices, faces, rows)[0]),
        ),
        "signed distance": (
            lambda: field(points),
            lambda: igl.signed_distance(rows, vertices, faces, sign_type=signed)[0],
        ),
        "winding numbers": (
            lambda: winding_numbers(corners, few.T),
            lambda: igl.winding_number(vertices, faces, few),
        ),
        "the same, libigl's fast ones": (
            lambda: winding_numbers(corners, few.T),
            lambda: igl.fast_winding_number(vertices, faces, few),
        ),
    }
    for what, (ours, theirs) in pairs.items():
        mine, a = least(ours)
        other, b = least(theirs)
        apart = np.abs(a - b).max()
        print(
            f"{len(faces):9d} {what:30} {mine:8.4f} {other:8.4f} {other / mine:6.1f} {apart:9.1e}"
        )


if __name__ == "__main__":
    print(f"{'triangles':>9} {'what':30} {'ours s':>8} {'libigl s':>8} {'ratio':>6} {'apart':>9}")
    for n in (50, 160):
        compare(bumpy_sphere(n))

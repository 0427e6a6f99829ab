"""Signed distance in a band of a grid beside libigl's at its nodes, closed and as a soup.

102,400 triangles of a bumpy sphere on 512^3 nodes (or as many along an axis as the first argument
says), in processor time after compilation. libigl is asked at random nodes of the whole grid, its
time taken for as many as the grid has; its signs are those of its fast winding numbers. Errors are
in grid spacings against the exact distance. The soup misses 1 % of its triangles, 5 % are turned
around and 1 % doubled; its signs are compared with those of the closed surface at all nodes. Start
it with NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1.
What was measured: ``bench_distance_grid.md``.
"""

import resource
import sys
import time

import igl
import numpy as np
from bench_closest import bumpy_sphere

from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.distance_grid import distance_grid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

ASKED, HALF, BAND = 50_000, 60.0, 3.0


def soup_of(surface, rng):
    """The surface with missing, turned and doubled triangles."""
    faces = surface.faces[rng.random(len(surface.faces)) > 0.01].copy()
    turned = rng.random(len(faces)) < 0.05
    faces[turned] = faces[turned][:, ::-1]
    doubled = faces[rng.random(len(faces)) < 0.01]
    return SurfaceMesh(vertices=surface.vertices, faces=np.concatenate([faces, doubled]))


def timed(function, *arguments):
    """Answer, processor time and wall clock time, s."""
    start, clock = time.process_time(), time.perf_counter()
    answer = function(*arguments)
    return answer, time.process_time() - start, time.perf_counter() - clock


def main(n):
    """Print times, errors and shares of wrong signs."""
    rng = np.random.default_rng(20261123)
    surface, lower, spacing = bumpy_sphere(160), np.full(3, -HALF), 2 * HALF / (n - 1)
    soup = soup_of(surface, rng)
    for some in (surface, soup):  # compilation
        distance_grid(some, lower, 2 * HALF / 31, (32, 32, 32))
    index = rng.integers(0, n, (ASKED, 3))
    rows = lower + spacing * index
    signed = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    # libigl scales its distance by the inexact winding number: the exact one is ours.
    exact = surface_distance(surface)(rows.T)
    their, theirs, _ = timed(
        lambda: igl.signed_distance(rows, surface.vertices, surface.faces, sign_type=signed)[0]
    )
    theirs *= n**3 / ASKED
    closed = None
    print(f"{n}^3 nodes, libigl {theirs:.0f} s of processor time")
    for what, some in (("closed", surface), ("soup", soup)):
        found, cost, wall = timed(distance_grid, some, lower, spacing, (n, n, n))
        print(
            f"{what:7} {cost:6.1f} s of processor time, {wall:6.1f} s; libigl {theirs / cost:.0f}x"
        )
        if closed is None:
            closed = found < 0
            off = np.abs(np.abs(found[tuple(index.T)]) - np.abs(exact)) / spacing
            near = np.abs(exact) < BAND * spacing
            print(
                f"        off in the band {off[near].max():.1e}; signs unlike libigl's "
                f"{np.mean((their < 0) != closed[tuple(index.T)]):.2e}"
            )
        else:
            print(f"        wrong signs {np.mean((found < 0) != closed):.2e}")
        del found
    print(f"peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 512)

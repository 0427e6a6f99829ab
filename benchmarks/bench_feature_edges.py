"""Volume that the stuffed mesh loses at edges between lattice and part, with its angles.

    python benchmarks/bench_feature_edges.py

A gyroid network of 1 mm cells, trimmed by a box, a turned box and a cylinder with flat ends of
about 2 mm, at 8, 12 and 20 elements per cell. The exact volume is a jittered count of 160^3 points.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.mesh.feature_edges import snap_feature_edges
from gradedesign.mesh.quality import tet_report
from gradedesign.mesh.stuffing import stuff

LOWEST, WIDTH, POINTS = -1.9, 3.8, 160


def network(p: np.ndarray) -> np.ndarray:
    """A gyroid network, in about mm."""
    x, y, z = 2 * np.pi * p
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return (f + 0.3) / (2 * np.pi * 1.2)


def box(turn: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """A box of 2.06 x 2.02 x 1.96 mm, turned."""

    def field(p: np.ndarray) -> np.ndarray:
        q = np.abs(np.einsum("ji,j...->i...", turn, p))
        return np.maximum(np.maximum(q[0] - 1.03, q[1] - 1.01), q[2] - 0.98)

    return field


def cylinder(p: np.ndarray) -> np.ndarray:
    """A cylinder of 2.1 mm along z, 2.04 mm long."""
    return np.maximum(np.hypot(p[0], p[1]) - 1.05, np.abs(p[2]) - 1.02)


def exact_volume(field: Callable[[np.ndarray], np.ndarray]) -> float:
    """Volume by counting jittered points, mm^3."""
    rng = np.random.default_rng(5)
    step = WIDTH / POINTS
    grid = LOWEST + step * (np.arange(POINTS) + 0.5)
    count = 0
    for x in grid:
        points = np.stack(np.meshgrid([x], grid, grid, indexing="ij"))
        points += step * (rng.random((3, 1, POINTS, POINTS)) - 0.5)
        count += int((field(points) < 0.0).sum())
    return count * step**3


def main() -> None:
    """Print one line per part and grid."""
    turned = Rotation.from_euler("xyz", [20, 33, 47], degrees=True).as_matrix()
    for name, part in (
        ("box", box(np.eye(3))),
        ("turned box", box(turned)),
        ("cylinder", cylinder),
    ):

        def field(p: np.ndarray, part: Callable[[np.ndarray], np.ndarray] = part) -> np.ndarray:
            return np.maximum(part(p), network(p))

        exact = exact_volume(field)
        for per_cell in (8, 12, 20):
            spacing = 1.0 / per_cell
            raw = stuff(field, np.full(3, LOWEST), (int(WIDTH / spacing),) * 3, spacing)
            begin = time.process_time()
            sharp = snap_feature_edges(raw, part, network, spacing)
            seconds = time.process_time() - begin
            report = tet_report(sharp)
            error, was = (100 * (v / exact - 1) for v in (report.volume, tet_report(raw).volume))
            print(
                f"{name:11s} {per_cell:2d} per cell: volume {was:+.2f} % stuffed, {error:+.2f} % "
                f"snapped, least angle {report.min_dihedral:.1f}, {seconds:.2f} s"
            )


if __name__ == "__main__":
    main()

"""Volume that the stuffed mesh loses at sharp edges and gains in creases, with its angles.

    python benchmarks/bench_feature_edges.py

A gyroid network of 1 mm cells, trimmed by a box, a turned box and a cylinder with flat ends of
about 2 mm, without and with a skin of 0.21 mm, at 8, 12 and 20 elements per cell: errors of the
volume as stuffed, with the edges between part and lattice, those of the part itself, the creases
between lattice and skin, and the inner edges of the skin. The exact volume is a jittered count of
160^3 points.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.mesh.feature_edges import snap_feature_edges, snap_own_edges
from gradedesign.mesh.quality import tet_report
from gradedesign.mesh.stuffing import stuff

LOWEST, WIDTH, POINTS = -1.9, 3.8, 160
SKIN = 0.21

Field = Callable[[np.ndarray], np.ndarray]


def network(p: np.ndarray) -> np.ndarray:
    """A gyroid network, in about mm."""
    x, y, z = 2 * np.pi * p
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return (f + 0.3) / (2 * np.pi * 1.2)


def box(turn: np.ndarray) -> Field:
    """A box of 2.06 x 2.02 x 1.96 mm, turned."""

    def field(p: np.ndarray) -> np.ndarray:
        q = np.abs(np.einsum("ji,j...->i...", turn, p))
        return np.maximum(np.maximum(q[0] - 1.03, q[1] - 1.01), q[2] - 0.98)

    return field


def cylinder(p: np.ndarray) -> np.ndarray:
    """A cylinder of 2.1 mm along z, 2.04 mm long."""
    return np.maximum(np.hypot(p[0], p[1]) - 1.05, np.abs(p[2]) - 1.02)


def exact_volume(field: Field) -> float:
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


def stages(part: Field, skin: Field | None, spacing: float) -> tuple[list[float], float, float]:
    """Volumes after every stage, mm^3, the least angle, degrees, and seconds of snapping."""

    def body(p: np.ndarray) -> np.ndarray:
        return network(p) if skin is None else np.minimum(network(p), skin(p))

    mesh = stuff(
        lambda p: np.maximum(part(p), body(p)),
        np.full(3, LOWEST),
        (int(WIDTH / spacing),) * 3,
        spacing,
    )
    meshes = [mesh]
    begin = time.process_time()
    meshes.append(snap_feature_edges(meshes[-1], part, body, spacing))
    meshes.append(snap_own_edges(meshes[-1], part, body, spacing))
    if skin is not None:
        meshes.append(snap_feature_edges(meshes[-1], network, skin, spacing, inside=part))
        meshes.append(
            snap_own_edges(
                meshes[-1],
                lambda p: -skin(p),
                lambda p: np.maximum(-network(p), part(p)),
                spacing,
            )
        )
    seconds = time.process_time() - begin
    reports = [tet_report(m) for m in meshes]
    return [r.volume for r in reports], reports[-1].min_dihedral, seconds


def main() -> None:
    """Print one line per part and grid."""
    turned = Rotation.from_euler("xyz", [20, 33, 47], degrees=True).as_matrix()
    parts = {"box": box(np.eye(3)), "turned box": box(turned), "cylinder": cylinder}
    for name, part in parts.items():
        for skin in (None, lambda p, part=part: -part(p) - SKIN):

            def solid(p: np.ndarray, part: Field = part, skin: Field | None = skin) -> np.ndarray:
                body = network(p) if skin is None else np.minimum(network(p), skin(p))
                return np.maximum(part(p), body)

            exact = exact_volume(solid)
            for per_cell in (8, 12, 20):
                volumes, angle, seconds = stages(part, skin, 1.0 / per_cell)
                errors = " ".join(f"{100 * (v / exact - 1):+.2f}" for v in volumes)
                print(
                    f"{name:11s}{' skin' if skin else '     '} {per_cell:2d} per cell: {errors} %, "
                    f"least angle {angle:.1f}, {seconds:.2f} s"
                )


if __name__ == "__main__":
    main()

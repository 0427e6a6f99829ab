"""Make knot.stl: a trefoil knot of round section.

Run ``python make_part.py`` in this folder; needs numpy. Lengths in mm. The knot winds twice around
the axis z and three times through itself; strands keep apart where they cross.
"""

import struct
from pathlib import Path

import numpy as np

SCALE, RADIUS = 6.5, 4.2
ALONG, AROUND = 90, 18


def axis(t: np.ndarray) -> np.ndarray:
    """Centre line of a trefoil, (3, n)."""
    return SCALE * np.array(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -1.5 * np.sin(3 * t)]
    )


def knot() -> np.ndarray:
    """Corners of the triangles, (n, 3, 3)."""
    t = 2 * np.pi * np.arange(ALONG) / ALONG
    centre = axis(t)
    along = axis(t + 1e-5) - axis(t - 1e-5)
    along /= np.linalg.norm(along, axis=0)
    side = np.cross(along.T, [0.0, 0.0, 1.0]).T  # the line is nowhere upright
    side /= np.linalg.norm(side, axis=0)
    up = np.cross(side.T, along.T).T
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    points = (
        centre[:, :, None]
        + RADIUS * side[:, :, None] * np.cos(turn)
        + RADIUS * up[:, :, None] * np.sin(turn)
    )
    points = np.moveaxis(points, 0, -1)
    after, beside = np.roll(points, -1, axis=0), np.roll(points, -1, axis=1)
    both = np.roll(after, -1, axis=1)
    quads = [np.stack(three, axis=2) for three in ((points, after, both), (points, both, beside))]
    return np.concatenate([q.reshape(-1, 3, 3) for q in quads])


def volume_of(corners: np.ndarray) -> float:
    """What the triangles enclose, positive where they face outwards."""
    return float(np.linalg.det(corners).sum() / 6)


def write_binary_stl(path: Path, corners: np.ndarray) -> None:
    """Write triangles with their normals."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    record = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")]
    )
    record["normal"], record["corners"] = normals, corners
    header = b"trefoil knot, mm".ljust(80, b" ")
    path.write_bytes(header + struct.pack("<I", len(record)) + record.tobytes())


if __name__ == "__main__":
    triangles = knot()
    if volume_of(triangles) < 0:
        triangles = triangles[:, ::-1]
    write_binary_stl(Path(__file__).with_name("knot.stl"), triangles)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    gap = np.linalg.norm(
        (points := axis(np.linspace(0, 2 * np.pi, 721)[:-1]))[:, :, None] - points[:, None, :],
        axis=0,
    )
    number = np.arange(720)
    apart = np.abs(number[:, None] - number)
    apart = np.minimum(apart, 720 - apart)
    print(f"{len(triangles)} triangles, {volume_of(triangles):.1f} mm^3, {low} to {high}")
    print(f"strands come as near as {gap[apart > 120].min() - 2 * RADIUS:.2f} mm")

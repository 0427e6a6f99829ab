"""Make defect.nrrd: grey values of a scanned piece of bone to be replaced, smooth as a scan's.

Run ``python make_part.py`` in this folder; needs numpy. The piece is an irregular oval around the
axis z, wider at the bottom, between two saw cuts at the ends of the volume. Grey values fall from
200 to 20 across the surface, over two voxels, with some noise of the scanner.
"""

import gzip
from pathlib import Path

import numpy as np

EDGE = 0.8  #: of a voxel, mm
SHAPE = (24, 21, 19)


def grey_values() -> np.ndarray:
    """Values of 0 to 255, (nx, ny, nz)."""
    x, y, z = np.meshgrid(*[(np.arange(n) + 0.5) * EDGE for n in SHAPE], indexing="ij")
    up = z / (SHAPE[2] * EDGE)
    x, y = x - SHAPE[0] * EDGE / 2 - 0.8 * np.sin(2.0 * up), y - SHAPE[1] * EDGE / 2
    angle = np.arctan2(y, x)
    radius = 7.2 - 0.8 * up + 0.7 * np.cos(2 * angle) + 0.4 * np.sin(3 * angle + 1.5 * up)
    depth = radius - np.hypot(x, y)
    noise = np.random.default_rng(7).normal(0.0, 4.0, SHAPE)
    grey = 110.0 + 90.0 * np.tanh(depth / EDGE) + noise
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def write_nrrd(path: Path, values: np.ndarray) -> None:
    """Write a volume with the edges of its voxels; NRRD runs fastest along x."""
    header = (
        "NRRD0004\ntype: uint8\ndimension: 3\n"
        f"sizes: {' '.join(map(str, values.shape))}\n"
        f"spacings: {EDGE} {EDGE} {EDGE}\n"
        'space units: "mm" "mm" "mm"\nspace dimension: 3\nencoding: gzip\n\n'
    )
    data = gzip.compress(values.tobytes(order="F"), mtime=0)
    path.write_bytes(header.encode("ascii") + data)


if __name__ == "__main__":
    volume = grey_values()
    write_nrrd(Path(__file__).with_name("defect.nrrd"), volume)
    print(f"{volume.shape} voxels, {(volume > 110).sum() * EDGE**3:.1f} mm^3 above 110")

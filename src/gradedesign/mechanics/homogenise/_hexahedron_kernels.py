"""Matrix-free product with the stiffness of trilinear hexahedra on a periodic grid.

The displacement of a voxel is taken apart into its eight products of 1, s_x, s_y, s_z with
s = 2 xi - 1. In these modes the integrals over the cube are those of Legendre polynomials, so the
24 by 24 stiffness of an isotropic voxel has 21 diagonal and 12 pairs of coupling entries, exactly.

Modes are numbered by their factors: x counts 4, y counts 2, z counts 1. So are the corners.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.arrays import FloatArray, IntArray

#: Slots of a buffer that is worked on at once, and its row length, a multiple of the lanes of
#: vector instructions. Chosen, not measured.
SLOTS = 136
ROW = 144
#: Starts of the rows of a buffer. Unsigned: a signed index may count from the end of an array,
#: which keeps a loop from becoming vector instructions.
R = tuple(np.uint64(k * ROW) for k in range(24))
#: Slabs of planes. Fixed, so that sums do not depend on the number of threads. Chosen, not
#: measured.
SLABS = 16
#: No reordering of sums: there are none to reorder, and results stay reproducible.
FAST = {"contract"}


@njit(cache=True, nogil=True)
def _forward(a0, a1, a2, a3, a4, a5, a6, a7):  # type: ignore[no-untyped-def]
    """Corner values to eight times the mode amplitudes."""
    b0, b1, b2, b3 = a0 + a1, a1 - a0, a2 + a3, a3 - a2
    b4, b5, b6, b7 = a4 + a5, a5 - a4, a6 + a7, a7 - a6
    c0, c2, c1, c3 = b0 + b2, b2 - b0, b1 + b3, b3 - b1
    c4, c6, c5, c7 = b4 + b6, b6 - b4, b5 + b7, b7 - b5
    return c1 + c5, c2 + c6, c3 + c7, c4 - c0, c5 - c1, c6 - c2, c7 - c3


@njit(cache=True, nogil=True)
def _backward(c1, c2, c3, c4, c5, c6, c7):  # type: ignore[no-untyped-def]
    """Transpose of `_forward`: mode forces to corner forces."""
    a0, a4 = -c4, c4
    a1, a5 = c1 - c5, c1 + c5
    a2, a6 = c2 - c6, c2 + c6
    a3, a7 = c3 - c7, c3 + c7
    b0, b2, b1, b3 = a0 - a2, a0 + a2, a1 - a3, a1 + a3
    b4, b6, b5, b7 = a4 - a6, a4 + a6, a5 - a7, a5 + a7
    return b0 - b1, b0 + b1, b2 - b3, b2 + b3, b4 - b5, b4 + b5, b6 - b7, b6 + b7


@njit(cache=True, fastmath=FAST, nogil=True)
def _forces(load: FloatArray, fill: FloatArray, lam: float, mu: float, out: FloatArray):  # type: ignore[no-untyped-def]
    """Corner forces of a row of voxels.

    Parameters
    ----------
    load : (12 * ROW,) array
        Displacements of the four rows of nodes around, component by component.
    fill : (ROW,) array
    lam, mu : float
        Lame's constants at unit Young's modulus.
    out : (24 * ROW,) array, overwritten
        Forces of the eight corners, component by component.
    """
    a, l1, m1 = (lam + 2 * mu) / 16, lam / 16, mu / 16
    l3, m3 = l1 / 3, m1 / 3
    b, c = (a + m1) / 3, (a + 2 * m1) / 9
    # All slots, used or not: with a constant length the compiler can use vector instructions.
    for i in range(np.uint64(SLOTS)):
        j = i + np.uint64(1)
        x1, x2, x3, x4, x5, x6, x7 = _forward(
            load[R[0] + i], load[R[0] + j], load[R[1] + i], load[R[1] + j],
            load[R[2] + i], load[R[2] + j], load[R[3] + i], load[R[3] + j],
        )  # fmt: skip
        y1, y2, y3, y4, y5, y6, y7 = _forward(
            load[R[4] + i], load[R[4] + j], load[R[5] + i], load[R[5] + j],
            load[R[6] + i], load[R[6] + j], load[R[7] + i], load[R[7] + j],
        )  # fmt: skip
        z1, z2, z3, z4, z5, z6, z7 = _forward(
            load[R[8] + i], load[R[8] + j], load[R[9] + i], load[R[9] + j],
            load[R[10] + i], load[R[10] + j], load[R[11] + i], load[R[11] + j],
        )  # fmt: skip
        e = fill[i]
        yz, xz, xy = m1 * (y1 + z2), m1 * (x1 + z4), m1 * (x2 + y4)
        twist = m3 * (x3 + y5 + z6)
        f0, f1, f2, f3, f4, f5, f6, f7 = _backward(
            e * xz, e * xy, e * (m3 * x3 + twist), e * (a * x4 + l1 * (y2 + z1)),
            e * (b * x5 + l3 * y3), e * (b * x6 + l3 * z3), e * (c * x7),
        )  # fmt: skip
        out[R[0] + i], out[R[1] + i], out[R[2] + i], out[R[3] + i] = f0, f1, f2, f3
        out[R[4] + i], out[R[5] + i], out[R[6] + i], out[R[7] + i] = f4, f5, f6, f7
        f0, f1, f2, f3, f4, f5, f6, f7 = _backward(
            e * yz, e * (a * y2 + l1 * (x4 + z1)), e * (b * y3 + l3 * x5), e * xy,
            e * (m3 * y5 + twist), e * (b * y6 + l3 * z5), e * (c * y7),
        )  # fmt: skip
        out[R[8] + i], out[R[9] + i], out[R[10] + i], out[R[11] + i] = f0, f1, f2, f3
        out[R[12] + i], out[R[13] + i], out[R[14] + i], out[R[15] + i] = f4, f5, f6, f7
        f0, f1, f2, f3, f4, f5, f6, f7 = _backward(
            e * (a * z1 + l1 * (x4 + y2)), e * yz, e * (b * z3 + l3 * x6), e * xz,
            e * (b * z5 + l3 * y6), e * (m3 * z6 + twist), e * (c * z7),
        )  # fmt: skip
        out[R[16] + i], out[R[17] + i], out[R[18] + i], out[R[19] + i] = f0, f1, f2, f3
        out[R[20] + i], out[R[21] + i], out[R[22] + i], out[R[23] + i] = f4, f5, f6, f7


@njit(cache=True, nogil=True)
def _gather(u: FloatArray, ix: int, jx: int, iy: int, iz: int, n: int, at: int, load: FloatArray):  # type: ignore[no-untyped-def]
    """Copy the ``n + 1`` nodes along z of the four rows around a run of voxels."""
    ny, nz = u.shape[2], u.shape[3]
    jy = iy + 1 if iy + 1 < ny else 0
    last = iz + n if iz + n < nz else 0
    begin = np.uint64(iz)
    length = np.uint64(n)
    for c in range(3):
        for k in range(4):
            row = u[c, jx if k > 1 else ix, jy if k % 2 else iy]
            start = np.uint64((4 * c + k) * ROW + at)
            for i in range(length):
                load[start + i] = row[begin + i]
            load[start + length] = row[last]


@njit(cache=True, nogil=True)
def _scatter(out: FloatArray, at: int, n: int, plane: FloatArray, side: int, iy: int, iz: int):  # type: ignore[no-untyped-def]
    """Add the corner forces of a run of voxels to the plane ``(3, ny, nz)`` on one side of it."""
    ny, nz = plane.shape[1], plane.shape[2]
    jy = iy + 1 if iy + 1 < ny else 0
    last = iz + n if iz + n < nz else 0
    begin = np.uint64(iz + 1)
    inner = np.uint64(n - 1)
    for c in range(3):
        for k in range(2):
            row = plane[c, jy if k else iy]
            near = (8 * c + 4 * side + 2 * k) * ROW + at
            far, following = np.uint64(near + ROW), np.uint64(near + 1)
            row[iz] += out[near]
            for i in range(inner):
                row[begin + i] += out[following + i] + out[far + i]
            row[last] += out[far + inner]


@njit(cache=True, nogil=True)
def stiffness_product(
    low: int,
    high: int,
    u: FloatArray,
    fill: FloatArray,
    first: IntArray,
    runs: IntArray,
    lam: float,
    mu: float,
    y: FloatArray,
    seam: FloatArray,
) -> None:
    """Set ``y = K u`` for voxels of edge 1 and Young's modulus ``fill``, in a range of slabs.

    Parameters
    ----------
    u : (3, nx, ny, nz) array
        Displacement of the nodes, periodic.
    fill : (nx, ny, nz) array
    first : (nx * ny + 1,) int64 array
        Where the runs of a row of voxels start in `runs`.
    runs : (k, 2) int64 array
        First voxel and length of each run of solid voxels along z, at most SLOTS long.
    lam, mu : float
        Lame's constants at unit Young's modulus.
    y : (3, nx, ny, nz) array, overwritten
    seam : (SLABS, 3, ny, nz) array, overwritten
        Forces on the first plane of the next slab, not yet added there.
    """
    nx, ny, nz = fill.shape
    load = np.zeros(12 * ROW)
    out = np.zeros(24 * ROW)
    modulus = np.zeros(ROW)
    place = np.zeros((SLOTS, 4), dtype=np.int64)
    lower = np.zeros((3, ny, nz))
    upper = np.zeros((3, ny, nz))
    for t in range(low, high):
        for ix in range(t * nx // SLABS, (t + 1) * nx // SLABS):
            jx = ix + 1 if ix + 1 < nx else 0
            q, end, pieces = first[ix * ny], first[(ix + 1) * ny], 0
            iy: Any = np.int64(0)
            while q < end:
                used: Any = np.int64(0)
                pieces = 0
                for i in range(ROW):
                    modulus[i] = 0.0
                while q < end and used + runs[q, 1] <= SLOTS:
                    while q >= first[ix * ny + iy + 1]:
                        iy += 1
                    iz, n = runs[q, 0], runs[q, 1]
                    _gather(u, ix, jx, iy, iz, n, used, load)
                    for i in range(n):
                        modulus[used + i] = fill[ix, iy, iz + i]
                    # The slot after a run joins nodes that are no neighbours; its modulus stays
                    # zero.
                    place[pieces, 0], place[pieces, 1] = used, n
                    place[pieces, 2], place[pieces, 3] = iy, iz
                    used += n + 1
                    pieces += 1
                    q += 1
                _forces(load, modulus, lam, mu, out)
                for s in range(pieces):
                    at, n, row, iz = place[s, 0], place[s, 1], place[s, 2], place[s, 3]
                    for side in range(2):
                        _scatter(out, at, n, lower if side == 0 else upper, side, row, iz)
            for c in range(3):
                for iy in range(ny):
                    for iz in range(nz):
                        y[c, ix, iy, iz] = lower[c, iy, iz]
                        lower[c, iy, iz] = 0.0
            lower, upper = upper, lower
        for c in range(3):
            for iy in range(ny):
                for iz in range(nz):
                    seam[t, c, iy, iz] = lower[c, iy, iz]
                    lower[c, iy, iz] = 0.0


@njit(cache=True, nogil=True)
def solid_runs(fill: FloatArray, first: IntArray, runs: IntArray) -> int:
    """Runs of solid voxels along z, cut to SLOTS; fills `first` and, where long enough, `runs`."""
    nx, ny, nz = fill.shape
    count = 0
    for ix in range(nx):
        for iy in range(ny):
            first[ix * ny + iy] = count
            iz = 0
            while iz < nz:
                if fill[ix, iy, iz] <= 0.0:
                    iz += 1
                    continue
                n = 0
                while iz + n < nz and n < SLOTS and fill[ix, iy, iz + n] > 0.0:
                    n += 1
                if count < runs.shape[0]:
                    runs[count, 0], runs[count, 1] = iz, n
                count += 1
                iz += n
    first[nx * ny] = count
    return count


@njit(cache=True, nogil=True)
def centre_strain(
    low: int, high: int, u: FloatArray, voxel: IntArray, macro: FloatArray, strain: FloatArray
) -> None:
    """Strain at the centres of voxels: macroscopic plus that of the periodic displacement.

    Parameters
    ----------
    low, high : int
        Range of `voxel`.
    u : (3, nx, ny, nz) array
    voxel : (n,) int64 array
        Flat numbers of the voxels.
    macro : (6,) array
        Voigt order xx, yy, zz, yz, xz, xy with engineering shear.
    strain : (6, n) array, overwritten
    """
    nx, ny, nz = u.shape[1], u.shape[2], u.shape[3]
    gradient = np.zeros((3, 3))
    for i in range(low, high):
        ix, iy, iz = voxel[i] // (ny * nz), (voxel[i] // nz) % ny, voxel[i] % nz
        jx, jy, jz = (ix + 1) % nx, (iy + 1) % ny, (iz + 1) % nz
        for c in range(3):
            z1, y1, _, x1, _, _, _ = _forward(
                u[c, ix, iy, iz], u[c, ix, iy, jz], u[c, ix, jy, iz], u[c, ix, jy, jz],
                u[c, jx, iy, iz], u[c, jx, iy, jz], u[c, jx, jy, iz], u[c, jx, jy, jz],
            )  # fmt: skip
            gradient[c, 0], gradient[c, 1], gradient[c, 2] = x1 / 4, y1 / 4, z1 / 4
        for c in range(3):
            strain[c, i] = macro[c] + gradient[c, c]
        strain[3, i] = macro[3] + gradient[1, 2] + gradient[2, 1]
        strain[4, i] = macro[4] + gradient[0, 2] + gradient[2, 0]
        strain[5, i] = macro[5] + gradient[0, 1] + gradient[1, 0]

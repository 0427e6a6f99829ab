"""Compiled runs of solid pixels, their connected components, and contours of layers.

More than 300 lines: all kernels work on the same runs, and each calls the ones before it.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: A point within this distance of the line between its neighbours is left out, steps.
STRAIGHT = 1e-4
#: Commands of binary CLI: a layer and a polyline, both of long numbers.
LAYER, POLYLINE = 127, 130
#: Bytes of a polyline's head: command, number of the model, direction, number of points.
_HEAD = 14

#: Side of a square on which a contour leaves it, by its solid corners (bits: lower left, lower
#: right, upper right, upper left) and the side on which it enters; sides: 0 below, 1 right, 2
#: above, 3 left; the solid is on the left. Solid corners that touch across a square are apart.
_LEAVES = np.full((16, 4), -1, dtype=np.int8)
for _code, _from, _to in (
    (1, 0, 3), (2, 1, 0), (4, 2, 1), (8, 3, 2), (3, 1, 3), (6, 2, 0), (12, 3, 1), (9, 0, 2),
    (14, 3, 0), (13, 0, 1), (11, 1, 2), (7, 2, 3), (5, 0, 3), (5, 2, 1), (10, 1, 0), (10, 3, 2),
):  # fmt: skip
    _LEAVES[_code, _from] = _to


@njit(cache=True)
def _changes(solid, i, j):
    """Whether a pixel has a neighbour that is not as it is."""
    nx, ny = solid.shape
    here = solid[i, j]
    return (
        (i > 0 and solid[i - 1, j] != here)
        or (i + 1 < nx and solid[i + 1, j] != here)
        or (j > 0 and solid[i, j - 1] != here)
        or (j + 1 < ny and solid[i, j + 1] != here)
    )


@njit(cache=True, nogil=True)
def tile_points(chosen, side, shape, pixel, points):
    """Fill x and y of the pixels of chosen tiles from the first pixel on, mm; how many.

    Tiles have ``side`` pixels along both axes; ``points`` is (3, n).
    """
    found = 0
    for a in range(chosen.shape[0]):
        for b in range(chosen.shape[1]):
            if not chosen[a, b]:
                continue
            for i in range(side * a, min(side * (a + 1), shape[0])):
                for j in range(side * b, min(side * (b + 1), shape[1])):
                    points[0, found] = i * pixel
                    points[1, found] = j * pixel
                    found += 1
    return found


@njit(cache=True, nogil=True)
def place_tiles(chosen, side, values, layer):
    """Write values in the order of `tile_points` into a layer."""
    found = 0
    for a in range(chosen.shape[0]):
        for b in range(chosen.shape[1]):
            if not chosen[a, b]:
                continue
            for i in range(side * a, min(side * (a + 1), layer.shape[0])):
                for j in range(side * b, min(side * (b + 1), layer.shape[1])):
                    layer[i, j] = values[found]
                    found += 1


@njit(cache=True, nogil=True)
def spread_values(solid, beside, clear, far, values):
    """Values of a layer for its contours: those of ``beside`` where pixels change, else ``far``.

    Of size ``clear`` at least, and negative where the pixel is solid.
    """
    nx, ny = solid.shape
    found = 0
    for i in range(nx):
        for j in range(ny):
            value = far
            if _changes(solid, i, j):
                value = max(abs(float(beside[found])), clear)
                found += 1
            values[i, j] = -value if solid[i, j] else value


@njit(cache=True, nogil=True)
def row_runs(solid, first, ends):
    """Runs of solid pixels along y, row by row.

    Parameters
    ----------
    solid : (nx, ny) bool array
    first : (nx + 1,) int array
        Filled: number of the first run of every row.
    ends : (k, 2) int32 array
        Filled where it has room: first pixel of a run, and the one behind its last.
    """
    nx, ny = solid.shape
    found = 0
    for i in range(nx):
        first[i] = found
        before = False
        for j in range(ny):
            here = solid[i, j]
            if here != before:
                if here:
                    if found < len(ends):
                        ends[found, 0] = j
                elif found < len(ends):
                    ends[found, 1] = j
                if not here:
                    found += 1
                before = here
        if before:
            if found < len(ends):
                ends[found, 1] = ny
            found += 1
    first[nx] = found
    return found


@njit(cache=True, nogil=True)
def fill_runs(first, ends, solid):
    """Set the pixels of runs in an empty layer."""
    for i in range(len(first) - 1):
        for r in range(first[i], first[i + 1]):
            solid[i, ends[r, 0] : ends[r, 1]] = True


@njit(cache=True, nogil=True)
def count_along(first, ends, by_row, by_pixel):
    """Add the number of solid pixels of every row, and of every place along the rows."""
    for i in range(len(first) - 1):
        for r in range(first[i], first[i + 1]):
            by_row[i] += ends[r, 1] - ends[r, 0]
            for j in range(ends[r, 0], ends[r, 1]):
                by_pixel[j] += 1


@njit(cache=True)
def root_of(parent, k):
    """First run of the component of a run; paths are halved."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@njit(cache=True)
def _join_rows(parent, a, a_end, ends_a, base_a, b, b_end, ends_b, base_b):
    """Join the runs of two rows that share a pixel."""
    while a < a_end and b < b_end:
        if ends_a[a, 0] < ends_b[b, 1] and ends_b[b, 0] < ends_a[a, 1]:
            p, q = root_of(parent, base_a + a), root_of(parent, base_b + b)
            if p < q:
                parent[q] = p
            elif q < p:
                parent[p] = q
        if ends_a[a, 1] < ends_b[b, 1]:
            a += 1
        else:
            b += 1


@njit(cache=True, nogil=True)
def join_runs(parent, first, ends, base, below_first, below_ends, below_base):
    """Join the runs of a layer with each other and with those of the layer below it.

    ``parent`` is that of all runs, ``base`` the number of the first of the layer. Without a layer
    below ``below_first`` is empty.
    """
    for i in range(len(first) - 1):
        if i > 0:
            _join_rows(parent, first[i - 1], first[i], ends, base,
                       first[i], first[i + 1], ends, base)  # fmt: skip
        if len(below_first):
            _join_rows(parent, below_first[i], below_first[i + 1], below_ends, below_base,
                       first[i], first[i + 1], ends, base)  # fmt: skip


@njit(cache=True, nogil=True)
def flatten(parent):
    """Replace the parent of every run by the first run of its component."""
    for k in range(len(parent)):
        parent[k] = parent[parent[k]]


@njit(cache=True, nogil=True)
def beside_change(solid, near):
    """Mark the pixels with a neighbour that is not as they are; how many."""
    nx, ny = solid.shape
    found = 0
    for i in range(nx):
        for j in range(ny):
            near[i, j] = _changes(solid, i, j)
            found += near[i, j]
    return found


@njit(cache=True, nogil=True)
def trace(values, stamp, number, places, first, scratch):
    """Closed contours of a layer, without the points on lines between their neighbours.

    Parameters
    ----------
    values : (nx, ny) array
        Negative in the solid, positive along the border, nowhere 0.
    stamp : (nx, ny) int32 array
        Layer that the contour through the edge along x behind a pixel was traced for last.
    number : int
        Of this layer.
    places : (k, 2) array
        Filled: points, in steps of the grid.
    first : (m,) int array
        Filled: where each polygon begins; the number of points follows the last.
    scratch : (k, 2) array

    Returns
    -------
    int
        Number of polygons; -1 where the arrays have no room.
    """
    nx, ny = values.shape
    found, filled = 0, 0
    for i in range(nx - 1):
        for j in range(ny):
            if stamp[i, j] == number or (values[i, j] < 0.0) == (values[i + 1, j] < 0.0):
                continue
            # Solid on the left: upwards into the square above, or down into the one below.
            a, b, side = (i, j, 0) if values[i, j] < 0.0 else (i, j - 1, 2)
            count = 0
            while True:
                along_y = side == 1 or side == 3
                p, q = a + (side == 1), b + (side == 2)
                if not along_y:
                    if stamp[p, q] == number:
                        break
                    stamp[p, q] = number
                if count >= len(scratch):
                    return -1
                here = values[p, q]
                there = values[p, q + 1] if along_y else values[p + 1, q]
                share = here / (here - there)
                scratch[count, 0] = p if along_y else p + share
                scratch[count, 1] = q + share if along_y else q
                count += 1
                code = (
                    (values[a, b] < 0.0)
                    + 2 * (values[a + 1, b] < 0.0)
                    + 4 * (values[a + 1, b + 1] < 0.0)
                    + 8 * (values[a, b + 1] < 0.0)
                )
                leaves = _LEAVES[code, side]
                a += (leaves == 1) - (leaves == 3)
                b += (leaves == 2) - (leaves == 0)
                side = (leaves + 2) % 4
            if found + 1 >= len(first) or filled + count > len(places):
                return -1
            first[found] = filled
            filled += _bent(scratch, count, places, filled)
            found += 1
    first[found] = filled
    return found


@njit(cache=True)
def _bent(polygon, count, places, filled):
    """Copy the points of a polygon off the lines between their neighbours; all if fewer than 3."""
    kept = 0
    for n in range(count):
        before, after = (n - 1) % count, (n + 1) % count
        cx, cy = polygon[after, 0] - polygon[before, 0], polygon[after, 1] - polygon[before, 1]
        dx, dy = polygon[n, 0] - polygon[before, 0], polygon[n, 1] - polygon[before, 1]
        if abs(cx * dy - cy * dx) > STRAIGHT * max(np.hypot(cx, cy), 1e-12):
            places[filled + kept] = polygon[n]
            kept += 1
    if kept >= 3:
        return kept
    places[filled : filled + count] = polygon[:count]
    return count


@njit(cache=True, nogil=True)
def polygon_areas(places, first, areas):
    """Fill the areas enclosed by polygons, negative where they run clockwise."""
    for n in range(len(areas)):
        low, high = first[n], first[n + 1]
        x0, y0 = places[low]
        twice = 0.0
        for m in range(low, high):
            after = m + 1 if m + 1 < high else low
            twice += (places[m, 0] - x0) * (places[after, 1] - y0)
            twice -= (places[m, 1] - y0) * (places[after, 0] - x0)
        areas[n] = 0.5 * twice


@njit(cache=True)
def _put(out, at, value, size):
    for n in range(size):
        out[at + n] = (value >> (8 * n)) & 255
    return at + size


@njit(cache=True, nogil=True)
def pack_polygons(bits, first, areas, out):
    """Write polygons as binary CLI, their first point once more at the end; the number of bytes.

    ``bits`` (k, 2) are the coordinates as float32, seen as uint32.
    """
    at = 0
    for n in range(len(areas)):
        low, high = first[n], first[n + 1]
        at = _put(out, at, POLYLINE, 2)
        at = _put(out, at, 1, 4)
        at = _put(out, at, 1 if areas[n] > 0.0 else 0, 4)
        at = _put(out, at, high - low + 1, 4)
        for m in range(low, high + 1):
            k = m if m < high else low
            at = _put(out, at, np.int64(bits[k, 0]), 4)
            at = _put(out, at, np.int64(bits[k, 1]), 4)
    return at


@njit(cache=True)
def _get(data, at, size):
    value = np.int64(0)
    for n in range(size):
        value |= np.int64(data[at + n]) << (8 * n)
    return value


@njit(cache=True, nogil=True)
def scan_binary(data, at, tops):
    """Read binary CLI from a place on.

    Returns
    -------
    layers, wrong, area : int, int, float
        Number of layers, whose upper sides are filled in while there is room; number of polylines
        that do not close or run the wrong way round, one more where the file ends too early; and
        the area that all enclose.
    """
    word = np.zeros(1, dtype=np.uint32)
    number = word.view(np.float32)
    layers, wrong, total = 0, 0, 0.0
    while at + 6 <= len(data):
        command = _get(data, at, 2)
        if command == LAYER:
            word[0] = _get(data, at + 2, 4)
            if layers < len(tops):
                tops[layers] = number[0]
            layers += 1
            at += 6
            continue
        if command != POLYLINE or at + _HEAD > len(data):
            return layers, wrong + 1, total
        direction, count = _get(data, at + 6, 4), _get(data, at + 10, 4)
        at += _HEAD
        if count < 1 or at + 8 * count > len(data):
            return layers, wrong + 1, total
        twice, x0, y0, px, py = 0.0, 0.0, 0.0, 0.0, 0.0
        for n in range(count):
            word[0] = _get(data, at, 4)
            x = float(number[0])
            word[0] = _get(data, at + 4, 4)
            y = float(number[0])
            at += 8
            if n == 0:
                x0, y0 = x, y
            else:
                twice += (px - x0) * (y - y0) - (py - y0) * (x - x0)
            px, py = x, y
        wrong += px != x0 or py != y0 or (twice > 0.0) != (direction != 0)
        total += 0.5 * twice
    return layers, wrong + (at != len(data)), total

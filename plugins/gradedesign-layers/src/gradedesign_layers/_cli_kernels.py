"""Compiled writing and reading of polygons in binary Common Layer Interface (CLI) files."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Commands of binary CLI: a layer and a polyline, both of long numbers.
LAYER, POLYLINE = 127, 130
#: Bytes of a polyline's head: command, number of the model, direction, number of points.
_HEAD = 14


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

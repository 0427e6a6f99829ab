"""Marching cubes one cube at a time, vertices named by their grid edge: slow, an oracle."""

from __future__ import annotations

from collections import Counter

import numpy as np

from gradedesign.geometry.contour._marching_table import EDGES, corner_number, marching_table


def triangles_by_cube(values):
    """Triangles of node values as cycles of grid edges, each an axis and its lower node."""
    triangles, counts = marching_table()
    found = Counter()
    for cube in np.ndindex(*(n - 1 for n in values.shape)):
        case = 0
        for corner in np.ndindex(2, 2, 2):
            inside = values[tuple(np.add(cube, corner))] < 0
            case |= int(inside) << corner_number(corner)
        for t in triangles[case, : counts[case]]:
            cycle = [(EDGES[e][0], *np.add(cube, EDGES[e][1]).tolist()) for e in t]
            turn = cycle.index(min(cycle))
            found[tuple(cycle[turn:] + cycle[:turn])] += 1
    return found


def triangles_by_place(vertices, faces, origin, h):
    """The same from a surface: every vertex lies on the inside of one grid edge."""
    steps = (vertices - origin) / h
    axis = np.abs(steps - np.round(steps)).argmax(axis=1)
    node = np.round(steps).astype(int)
    rows = np.arange(len(steps))
    node[rows, axis] = np.floor(steps[rows, axis])
    found = Counter()
    for face in faces:
        cycle = [(int(axis[v]), *node[v].tolist()) for v in face]
        turn = cycle.index(min(cycle))
        found[tuple(cycle[turn:] + cycle[:turn])] += 1
    return found

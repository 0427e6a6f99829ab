"""Compiled tree of boxes around triangles: build, and the leaves that meet a box."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Triangles per leaf, points per unit of threaded work (fixed, so that results do not depend on
#: the number of threads), and depth of the traversal stack (a balanced tree of 2**31 leaves).
LEAF, CHUNK, DEPTH = 4, 256, 64


@njit(cache=True, nogil=True)
def _select(centre, order, axis, first, last, middle):
    """Sort triangles from first to last so that the least along an axis come before middle."""
    last -= 1
    while first < last:
        pivot = centre[axis, (first + last) // 2]
        i, j = first, last
        while i <= j:
            while centre[axis, i] < pivot:
                i += 1
            while centre[axis, j] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                for a in range(3):
                    centre[a, i], centre[a, j] = centre[a, j], centre[a, i]
                i += 1
                j -= 1
        if middle <= j:
            last = j
        elif middle >= i:
            first = i
        else:
            return


@njit(cache=True, nogil=True)
def _widest(centre, begin, end):
    """Axis along which centres lie farthest apart."""
    spread, axis = -1.0, 0
    for a in range(3):
        least, most = np.inf, -np.inf
        for s in range(begin, end):
            least, most = min(least, centre[a, s]), max(most, centre[a, s])
        if most - least > spread:
            spread, axis = most - least, a
    return axis


@njit(cache=True, nogil=True)
def number_nodes(triangles, right, first, count):
    """Fill a balanced tree of so many triangles, left child after its parent; its nodes.

    ``right`` is the right child, -1 in a leaf; ``first`` and ``count`` are ranges of triangles.
    """
    stack = np.zeros((DEPTH, 3), dtype=np.int64)
    stack[0] = np.array([-1, 0, triangles])
    depth, nodes = 1, 0
    while depth > 0:
        depth -= 1
        parent, begin, end = stack[depth]
        if parent >= 0:
            right[parent] = nodes
        while True:
            first[nodes], count[nodes], right[nodes] = begin, end - begin, -1
            nodes += 1
            if end - begin <= LEAF:
                break
            middle = (begin + end) // 2
            stack[depth, 0], stack[depth, 1], stack[depth, 2] = nodes - 1, middle, end
            depth += 1
            end = middle
    return nodes


@njit(cache=True, nogil=True)
def halve_nodes(low, high, nodes, first, count, centre, order):
    """Sort the triangles of nodes, by their centres (3, m), into two halves along an axis each."""
    for n in range(low, high):
        begin, end = first[nodes[n]], first[nodes[n]] + count[nodes[n]]
        axis = _widest(centre, begin, end)
        _select(centre, order, axis, begin, end, (begin + end) // 2)


@njit(cache=True, nogil=True)
def store_triangles(low, high, corners, order, thin, tri, flat):
    """Fill first corners and edge vectors, (m, 9), in sorted order, and which have no area.

    Those are ``flat`` whose double area is at most ``thin`` times their longest side squared.
    """
    for s in range(low, high):
        t = order[s]
        bb, bc, cc = 0.0, 0.0, 0.0
        for a in range(3):
            p = corners[t, 0, a]
            b, c = corners[t, 1, a] - p, corners[t, 2, a] - p
            tri[s, a], tri[s, 3 + a], tri[s, 6 + a] = p, b, c
            bb, bc, cc = bb + b * b, bc + b * c, cc + c * c
        b, c = tri[s, 3:6], tri[s, 6:9]
        x, y, z = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
        longest = max(bb, cc, bb + cc - 2.0 * bc)
        flat[s] = np.sqrt(x * x + y * y + z * z) <= thin * longest


@njit(cache=True, nogil=True)
def fill_boxes(corners, order, right, first, count, box):
    """Fill the lower and upper corner of every node's box, (k, 6), from the leaves up."""
    for node in range(len(box) - 1, -1, -1):
        for a in range(3):
            if right[node] >= 0:
                box[node, a] = min(box[node + 1, a], box[right[node], a])
                box[node, 3 + a] = max(box[node + 1, 3 + a], box[right[node], 3 + a])
                continue
            low, high = np.inf, -np.inf
            for s in range(first[node], first[node] + count[node]):
                for c in range(3):
                    low = min(low, corners[order[s], c, a])
                    high = max(high, corners[order[s], c, a])
            box[node, a], box[node, 3 + a] = low, high


@njit(cache=True, nogil=True)
def next_leaf(box, right, low, high, stack, depth):
    """The next leaf whose box meets that from ``low`` to ``high``, and the depth of the stack.

    The stack begins with the root; the leaf is -1 after the last.
    """
    while depth > 0:
        depth -= 1
        node = stack[depth]
        apart = False
        for a in range(3):
            apart |= box[node, a] > high[a] or box[node, 3 + a] < low[a]
        if apart:
            continue
        if right[node] < 0:
            return node, depth
        stack[depth], stack[depth + 1] = right[node], node + 1
        depth += 2
    return -1, 0

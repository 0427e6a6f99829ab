"""Compiled runs of solid pixels of layers, and their connected components."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

from numba import njit


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


@njit(cache=True, nogil=True)
def beside_change(solid, near):
    """Mark the pixels with a neighbour that is not as they are; how many."""
    nx, ny = solid.shape
    found = 0
    for i in range(nx):
        here, marked = solid[i], near[i]
        before, after = solid[max(i - 1, 0)], solid[min(i + 1, nx - 1)]
        marked[0] = (
            (here[0] != before[0]) | (here[0] != after[0]) | (here[0] != here[min(1, ny - 1)])
        )
        for j in range(1, ny - 1):
            marked[j] = (
                (here[j] != here[j - 1])
                | (here[j] != here[j + 1])
                | (here[j] != before[j])
                | (here[j] != after[j])
            )
        if ny > 1:
            j = ny - 1
            marked[j] = (here[j] != here[j - 1]) | (here[j] != before[j]) | (here[j] != after[j])
        for j in range(ny):
            found += marked[j]
    return found


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

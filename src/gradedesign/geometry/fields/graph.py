"""Graphs of period 1: nodes and struts, checked, each strut once."""

from __future__ import annotations

from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PluginError

#: Places closer than this, in cell units, are the same place. Chosen, not measured.
SAME = 1e-6

#: Keeps round coordinates away from the limits between keys. The fraction of the square root
#: of 5, which is near no short fraction.
_OFF = 0.2360679774997896


def bond_graph(sites: ArrayLike, lengths: ArrayLike) -> tuple[FloatArray, IntArray]:
    """Join all pairs of periodic sites that are one of the given lengths apart.

    Parameters
    ----------
    sites : (n, 3) array_like, cell units
        One of each set of copies.
    lengths : float or (k,) array_like, cell units
        Above 0, at most 1.

    Returns
    -------
    nodes : (p, 3) array, cell units
        The sites, then copies of them in neighbouring cells.
    edges : (m, 2) int array
        Ends of the struts; each strut of the cell once.

    Raises
    ------
    PluginError
        If no pair is that far apart, or a length is out of range.

    Examples
    --------
    >>> nodes, edges = bond_graph([[0, 0, 0]], 1.0)
    >>> len(nodes), len(edges)
    (4, 3)
    """
    own = np.mod(np.array(sites, dtype=np.float64).reshape(-1, 3), 1.0)
    wanted = np.atleast_1d(np.asarray(lengths, dtype=np.float64))
    if not ((wanted > 0) & (wanted <= 1)).all():
        raise PluginError(f"strut lengths {wanted.tolist()} must be above 0 and at most 1 cell")
    shifts = np.array([(0, 0, 0), *(s for s in product((-1, 0, 1), repeat=3) if any(s))])
    nodes = (own[None] + shifts[:, None]).reshape(-1, 3)
    apart = np.linalg.norm(own[:, None] - nodes[None], axis=2)
    fits = (np.abs(apart[:, :, None] - wanted) < SAME).any(axis=2)
    edges = np.argwhere(fits)
    if len(edges) == 0:
        raise PluginError(
            f"no two of the {len(own)} sites are {wanted.tolist()} cells apart; the nearest are "
            f"{apart[apart > SAME].min():.6g} cells apart"
        )
    edges = edges[_first_of_each(nodes[edges])]
    used = np.unique(np.concatenate([np.arange(len(own)), edges.ravel()]))
    return nodes[used], np.searchsorted(used, edges)


def graph_segments(nodes: ArrayLike, edges: ArrayLike) -> FloatArray:
    """Struts of one cell of a periodic graph, each once.

    Parameters
    ----------
    nodes : (n, 3) array_like, cell units
        Anywhere: nodes a whole number of cells apart along each axis are copies of one node, so
        a strut into the next cell ends at a node beyond the face.
    edges : (m, 2) int array_like
        Pairs of nodes. Struts that are copies of each other count once.

    Returns
    -------
    (k, 2, 3) array, cell units
        Both ends of every strut.

    Raises
    ------
    PluginError
        Naming the node or the strut: coordinates that are not finite, a node that does not exist,
        a strut of length zero, an isolated node, a node where a strut ends that nothing continues.

    Examples
    --------
    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> graph_segments(corner, [[0, 1], [0, 2], [0, 3]]).shape
    (3, 2, 3)
    """
    places = np.array(nodes, dtype=np.float64)
    pairs = np.array(edges)
    _check_arrays(places, pairs)
    segments = places[pairs]
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    for i in np.flatnonzero(length < SAME)[:1]:
        raise PluginError(
            f"strut {i} from {_node(places, pairs[i, 0])} to {_node(places, pairs[i, 1])} has "
            f"length zero; remove it"
        )
    segments = segments[_first_of_each(segments)]
    _check_degrees(places, segments)
    return segments


def periodic_keys(places: FloatArray) -> IntArray:
    """Whole numbers that are equal for copies of a place, ``(..., 3)``."""
    cells = round(1 / SAME)
    return np.asarray(np.floor(places * cells + _OFF), dtype=np.int64) % cells


def direction_keys(vectors: FloatArray) -> IntArray:
    """Whole numbers that are equal for a vector and its reverse, ``(..., 3)``."""
    steps = np.asarray(np.rint(vectors / SAME), dtype=np.int64)
    leading = np.where(steps[..., 0] != 0, steps[..., 0], steps[..., 1])
    leading = np.where(leading != 0, leading, steps[..., 2])
    return steps * np.sign(leading)[..., None]


def _first_of_each(segments: FloatArray) -> IntArray:
    """Index of the first of every set of copies, in order."""
    keys = np.concatenate(
        [
            periodic_keys(segments.mean(axis=1)),
            direction_keys(segments[:, 1] - segments[:, 0]),
        ],
        axis=1,
    )
    index: IntArray = np.unique(keys, axis=0, return_index=True)[1]
    return np.sort(index)


def _node(places: FloatArray, index: int) -> str:
    """Name a node in a message."""
    return f"node {index} ({', '.join(f'{c:.6g}' for c in places[index])})"


def _check_arrays(places: FloatArray, pairs: IntArray) -> None:
    """Refuse arrays that are no graph."""
    if places.ndim != 2 or places.shape[1:] != (3,) or len(places) == 0:
        raise PluginError(f"graph nodes have shape {places.shape}, expected (n, 3) with n above 0")
    if pairs.ndim != 2 or pairs.shape[1:] != (2,) or pairs.dtype.kind not in "iu":
        raise PluginError(
            f"graph edges have shape {pairs.shape} of {pairs.dtype}, expected (m, 2) whole numbers"
        )
    for i in np.flatnonzero(~np.isfinite(places).all(axis=1))[:1]:
        raise PluginError(f"{_node(places, i)} of the graph is not finite")
    for i in np.flatnonzero(((pairs < 0) | (pairs >= len(places))).any(axis=1))[:1]:
        raise PluginError(
            f"strut {i} joins nodes {pairs[i, 0]} and {pairs[i, 1]}, but the graph has nodes 0 to "
            f"{len(places) - 1}"
        )


def _check_degrees(places: FloatArray, segments: FloatArray) -> None:
    """Refuse nodes with fewer than two ends of struts, copies counted together."""
    keys = periodic_keys(np.concatenate([places, segments.reshape(-1, 3)]))
    _, label = np.unique(keys, axis=0, return_inverse=True)
    label = label.ravel()
    degree = np.bincount(label[len(places) :], minlength=label.max() + 1)[label[: len(places)]]
    for i in np.flatnonzero(degree == 0)[:1]:
        raise PluginError(f"{_node(places, i)} is isolated: no strut ends there; join or remove it")
    for i in np.flatnonzero(degree == 1)[:1]:
        raise PluginError(
            f"only one strut ends at {_node(places, i)}: it continues neither there nor at a copy "
            f"a whole number of cells away; the graph is not periodic, or a strut dangles"
        )


_MIRROR_X = np.diag([-1.0, 1.0, 1.0])
_MIRROR_Y = np.diag([1.0, -1.0, 1.0])
_SWAP_XY = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_CYCLE = np.roll(np.eye(3), 1, axis=0)


def segment_symmetry(
    segments: ArrayLike, *, thickness: ArrayLike = 1.0, normals: ArrayLike | None = None
) -> Literal["cubic", "tetragonal", "orthotropic", "none"]:
    """Symmetry of the stiffness of struts, for `CellFamily`, from their geometry.

    An operation counts when it, or its product with the inversion, takes the struts to a shifted
    copy of themselves: a stiffness sees neither shifts nor the inversion.

    Parameters
    ----------
    segments, thickness, normals
        As in `periodic_distance_to_segments`.

    Examples
    --------
    >>> axes = [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, 1]]]
    >>> segment_symmetry(axes)
    'cubic'
    >>> segment_symmetry(axes, thickness=[1, 1, 2])
    'tetragonal'
    """
    ends = np.array(segments, dtype=np.float64)
    sides = np.zeros((len(ends), 0, 3)) if normals is None else np.array(normals, dtype=np.float64)
    relative = np.array(np.broadcast_to(np.asarray(thickness, dtype=np.float64), (len(ends),)))

    def holds(operation: FloatArray) -> bool:
        return any(_maps(ends, relative, sides, sign * operation) for sign in (1.0, -1.0))

    if not (holds(_MIRROR_X) and holds(_MIRROR_Y)):
        return "none"
    if holds(_CYCLE):
        return "cubic"
    return "tetragonal" if holds(_SWAP_XY) else "orthotropic"


def _maps(
    ends: FloatArray, thickness: FloatArray, sides: FloatArray, operation: FloatArray
) -> bool:
    """Whether an operation, followed by some shift, maps the struts onto themselves."""
    middle, kind = ends.mean(axis=1), _kinds(ends, thickness, sides)
    moved, moved_kind = (
        middle @ operation.T,
        _kinds(ends @ operation.T, thickness, sides @ operation.T),
    )
    target = _sorted_rows(np.concatenate([periodic_keys(middle), kind], axis=1))
    # The first moved strut must land on one like it; that fixes the shift.
    for image in np.flatnonzero((kind == moved_kind[0]).all(axis=1)):
        shifted = moved + (middle[image] - moved[0])
        moved_rows = _sorted_rows(np.concatenate([periodic_keys(shifted), moved_kind], axis=1))
        if np.array_equal(moved_rows, target):
            return True
    return False


def _kinds(ends: FloatArray, thickness: FloatArray, sides: FloatArray) -> IntArray:
    """Integers that are equal for struts that differ in their position only, ``(m, ...)``."""
    steps = np.asarray(np.rint(sides * 1e6), dtype=np.int64)
    for column in (2, 1, 0):
        order = np.argsort(steps[:, :, column], axis=1, kind="stable")
        steps = np.take_along_axis(steps, order[:, :, None], axis=1)
    return np.concatenate(
        [
            direction_keys(ends[:, 1] - ends[:, 0]),
            np.rint(thickness * 1e6).astype(np.int64)[:, None],
            steps.reshape(len(ends), -1),
        ],
        axis=1,
    )


def _sorted_rows(keys: IntArray) -> IntArray:
    """Rows in lexicographic order."""
    return keys[np.lexsort(keys.T[::-1])]

"""Active elements of a grid cut by a field: whole ones, and cut ones with fitted weights.

A brick whose solid consists of several connected components becomes as many elements: parts on
either side of a gap move independently of each other, however narrow the gap is (duplicated
elements of Hansbo and Hansbo, Comput. Methods Appl. Mech. Eng. 193, 2004, p. 3523). Above 300
lines: components and weights share their arrays.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import ndimage

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import DisconnectedError, LatticeError
from gradedesign.mechanics.finite_cell._fraction_kernels import solid_fractions
from gradedesign.mechanics.finite_cell._sample_kernels import EDGES, face_masks, label_components
from gradedesign.mechanics.finite_cell._weight_kernels import RULE, fitted_weights
from gradedesign.mechanics.finite_cell.basis import CUT_POINTS, gauss_weights, lagrange_tables
from gradedesign.mechanics.finite_cell.grid import Grid
from gradedesign.mechanics.finite_cell.samples import classify

log = logging.getLogger(__name__)

#: Sub-cells along the edge of an element, in whose tetrahedra the field is taken as linear: a
#: multiple of `BLOCKS`, at most six for the bits of `Elements.faces`.
SUBCELLS = 4
#: Elements with a smaller share of solid are left out: their solid carries nothing. Chosen, not
#: measured.
LEAST_SHARE = 1e-8
#: Share that may miss in an element that counts as whole. Above the rounding of the quadrature.
_WHOLE = 1e-9
#: Share of the volume that disconnected components may hold. Chosen, not measured.
DISCONNECTED_SHARE = 0.01
#: Cut elements per call of the quadrature. Chosen, not measured.
CHUNK = 4096
#: Parts along the edge of an element whose stress is reported. Chosen, not measured.
BLOCKS = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Elements:
    """Active elements: whole ones first, then cut ones, each by colour.

    Elements of one colour share no node: there are eight colours for every size, and as many more
    for every further element that a brick holds.
    """

    grid: Grid  #: Of the smallest elements.
    #: ``(n, 3)`` int32. Place of each element's lower corner in the grid.
    position: NDArray[np.int32]
    #: ``(n,)`` int8. Edge of each element in bricks of the grid: 1, or 2 for those of a locally
    #: refined grid that stay coarse; their positions are even.
    size: NDArray[np.int8]
    whole: int  #: Number of whole elements.
    copy: NDArray[np.int8]  #: ``(n,)`` int8. Number of each element among those of its brick.
    #: ``(n, 6)`` int64. Where the solid reaches the faces 2 axis + side: a bit for every corner of
    #: a sub-cell. Neighbours share the nodes of their face where they have a bit in common.
    faces: IntArray
    #: ``(2, c + 1)``. First element of each colour, of whole and of cut elements.
    colours: IntArray
    #: ``(n - whole, 125)``. Of the solid at the Gauss points of cut elements, over the element's
    #: volume.
    weights: FloatArray
    #: ``(n - whole, 64)`` float32. Solid volume of each sub-cell of cut elements, over the
    #: element's volume.
    share: NDArray[np.float32]
    #: ``(n - whole, 64, 3)`` float16. Its centroid, reference coordinates; rounded to 1/4096 of the
    #: element's edge at most.
    centre: NDArray[np.float16]
    dropped: int  #: Disconnected components left out.
    dropped_share: float  #: Their share of the volume.


def solid_fraction(elements: Elements) -> FloatArray:
    """Share of solid of every element, ``(n,)``."""
    return np.concatenate([np.ones(elements.whole), elements.weights.sum(axis=1)])


def solid_volume(elements: Elements) -> float:
    """Volume of the solid, mm^3."""
    return float((element_volumes(elements) * solid_fraction(elements)).sum())


def element_volumes(elements: Elements) -> FloatArray:
    """Volume of every element with its void, ``(n,)``, mm^3."""
    return np.asarray(np.prod(elements.grid.edges) * elements.size.astype(np.float64) ** 3)


def refined_elements(field: Field, grid: Grid, coarse: BoolArray) -> Elements:
    """Elements of a locally refined grid, disconnected components among them.

    Raises `LatticeError` if nothing is solid, or the field is not finite.

    ``field``: as for `cut_elements`. ``grid``: of the small elements, of even shape.
    ``coarse (nx / 2, ny / 2, nz / 2)``: blocks of eight bricks that are one element each.
    """
    half = Grid(
        lower=grid.lower,
        edges=2.0 * grid.edges,
        shape=(coarse.shape[0], coarse.shape[1], coarse.shape[2]),
    )
    report_step("finite cells of the field")
    fine = np.repeat(np.repeat(np.repeat(~coarse, 2, axis=0), 2, axis=1), 2, axis=2)
    small, large = classify(field, grid, SUBCELLS, fine), classify(field, half, SUBCELLS, coarse)
    result = _collect(grid, [(1, *small[1:]), (2, *large[1:])], 0, 0.0)
    log.info(
        "%d whole and %d cut elements, %d of them of twice the edge",
        result.whole, len(result.weights), np.count_nonzero(result.size > 1),
    )  # fmt: skip
    return result


def cut_elements(field: Field, grid: Grid, *, bodies: int = 1) -> Elements:
    """Find the elements that hold solid, and integrate over the solid of the cut ones.

    The solid ends at the limits of the grid. Raises `LatticeError` if nothing is solid, the field
    is not finite, or disconnected components hold more than 1 %.

    ``field``: points ``(3, ...)`` in mm to values ``(...)``, negative inside. ``bodies``: connected
    components to keep, the largest first.
    """
    subcells = SUBCELLS
    start = time.perf_counter()
    report_step("finite cells of the field")
    solid, whole, cut, samples = classify(field, grid, subcells)
    sampled = time.perf_counter()
    dropped, dropped_share = 0, 0.0
    report_step("disconnected components of the finite cells")
    labels, count = ndimage.label(solid, structure=_neighbours())
    if count > bodies:
        disconnected, dropped, dropped_share = _disconnected(labels, bodies)
        whole = whole[~_holds_disconnected(disconnected, whole, subcells)]
        for k in np.flatnonzero(_holds_disconnected(disconnected, cut, subcells)):
            z, y, x = subcells * cut[k, ::-1]
            near = disconnected[z : z + subcells + 1, y : y + subcells + 1, x : x + subcells + 1]
            samples[k][near] = np.abs(samples[k][near])
    del labels, solid
    result = _collect(grid, [(1, whole, cut, samples)], dropped, dropped_share)
    log.info(
        "%d whole and %d cut elements, %d disconnected components dropped: field %.2f s, "
        "weights %.2f s",
        result.whole, len(result.weights), dropped, sampled - start,
        time.perf_counter() - sampled,
    )  # fmt: skip
    return result


def _collect(
    grid: Grid,
    sizes: Sequence[tuple[int, NDArray[np.int32], NDArray[np.int32], FloatArray]],
    dropped: int,
    dropped_share: float,
) -> Elements:
    """Elements of one or two sizes, from their edges, whole and cut places, and samples."""
    parts = [_integrated(whole, cut, samples) for _, whole, cut, samples in sizes]
    position = [np.concatenate([edge * p[k] for (edge, *_), p in zip(sizes, parts, strict=True)])
                for k in range(2)]  # fmt: skip
    size = [
        np.concatenate(
            [np.full(len(p[k]), edge, np.int8) for (edge, *_), p in zip(sizes, parts, strict=True)]
        )
        for k in range(2)
    ]
    copy, samples, weights = (np.concatenate([p[k] for p in parts]) for k in (2, 3, 4))
    if not len(position[0]) + len(position[1]):
        raise LatticeError(
            "no finite cell holds solid; the field is negative nowhere in the box, or the solid "
            "is thinner than a quarter of the spacing"
        )
    copies = 1 + int(copy.max(initial=0))
    colours = 8 * copies * len(sizes)
    whole_order, whole_start = _by_colour(
        position[0], size[0], np.zeros(len(position[0]), np.int8), copies, colours
    )
    cut_order, cut_start = _by_colour(position[1], size[1], copy, copies, colours)
    samples, weights = samples[cut_order], weights[cut_order]
    share = np.zeros((len(cut_order), BLOCKS**3), np.float32)
    centre = np.zeros((len(cut_order), BLOCKS**3, 3), np.float32)
    report_step("solid volume of cut elements")
    in_ranges(solid_fractions, range(len(samples)), samples, BLOCKS, share, centre)
    whole = len(whole_order)
    faces = np.full((whole + len(cut_order), 6), (1 << samples.shape[1] ** 2) - 1)
    in_ranges(face_masks, range(len(samples)), samples, faces[whole:])
    return Elements(
        grid=grid,
        position=np.ascontiguousarray(
            np.concatenate([position[0][whole_order], position[1][cut_order]])
        ),
        size=np.concatenate([size[0][whole_order], size[1][cut_order]]),
        whole=whole,
        copy=np.concatenate([np.zeros(whole, np.int8), copy[cut_order]]),
        faces=faces,
        colours=np.stack([whole_start, whole + cut_start]),
        weights=weights,
        share=share,
        centre=centre.astype(np.float16),
        dropped=dropped,
        dropped_share=dropped_share,
    )


def _integrated(
    whole: NDArray[np.int32], cut: NDArray[np.int32], samples: FloatArray
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int8], FloatArray, FloatArray]:
    """Places of whole elements; places, copies, samples and weights of cut ones.

    Cut bricks are parted into components; those that are full after all count as whole.
    """
    report_step("connected components of cut elements")
    cut, copy, samples = _by_component(cut, samples)
    weights = np.zeros((len(cut), CUT_POINTS**3))
    values, integrals = (np.ascontiguousarray(t.T) for t in lagrange_tables(CUT_POINTS))
    for first in range(0, len(cut), CHUNK):
        report_step(f"quadrature of {len(cut)} cut elements", first / len(cut))
        part = slice(first, first + CHUNK)
        own = samples[part]
        in_ranges(fitted_weights, range(len(own)), own, RULE, values, integrals, weights[part])
    fill = weights.sum(axis=1)
    full = fill >= 1.0 - _WHOLE
    whole = np.concatenate([whole, cut[full]])
    solid = np.flatnonzero((fill > LEAST_SHARE) & ~full)
    return whole, cut[solid], copy[solid], samples[solid], weights[solid]


def selected(elements: Elements, keep: BoolArray) -> Elements:
    """Only some elements, ``(n,)``, in their order."""
    before = np.concatenate([[0], np.cumsum(keep)])
    cut = keep[elements.whole :]
    return replace(
        elements,
        position=elements.position[keep],
        size=elements.size[keep],
        whole=int(before[elements.whole]),
        copy=elements.copy[keep],
        faces=elements.faces[keep],
        colours=before[elements.colours],
        weights=elements.weights[cut],
        share=elements.share[cut],
        centre=elements.centre[cut],
    )


def _by_component(
    cut: NDArray[np.int32], samples: FloatArray
) -> tuple[NDArray[np.int32], NDArray[np.int8], FloatArray]:
    """Places, numbers within a brick and samples of elements of one component each."""
    labels = np.zeros(samples.shape, np.int8)
    count = np.zeros(len(cut), np.int64)
    in_ranges(label_components, range(len(cut)), samples, EDGES, labels, count)
    several = np.flatnonzero(count > 1)
    parts, numbers = [], []
    for k in range(1, int(count.max(initial=1))):
        of = several[count[several] > k]
        part = samples[of]
        part[(labels[of] != k) & (part < 0.0)] *= -1.0
        parts.append(part)
        numbers.append(np.full(len(of), k, np.int8))
        cut = np.concatenate([cut, cut[of]])
    first = samples[several]
    first[(labels[several] != 0) & (first < 0.0)] *= -1.0
    samples[several] = first
    copy = np.concatenate([np.zeros(len(samples), np.int8), *numbers])
    return cut, copy, np.concatenate([samples, *parts])


def _neighbours() -> BoolArray:
    """Corners joined by an edge of the tetrahedra that divide a sub-cell."""
    joined = np.zeros((3, 3, 3), dtype=bool)
    ahead = np.argwhere(np.ones((2, 2, 2)))
    joined[tuple((1 + ahead).T)] = joined[tuple((1 - ahead).T)] = True
    return joined


def _disconnected(labels: NDArray[np.int32], bodies: int) -> tuple[BoolArray, int, float]:
    """Corners of all but the largest components, their number and share."""
    size = np.bincount(labels.ravel())[1:]
    largest = 1 + np.argsort(-size, kind="stable")[:bodies]
    share = 1.0 - float(size[largest - 1].sum() / size.sum())
    if share > DISCONNECTED_SHARE:
        refuse_disconnected(len(size) - bodies, share)
    disconnected = np.ones(len(size) + 1, dtype=bool)
    disconnected[0] = False
    disconnected[largest] = False
    return disconnected[labels], len(size) - bodies, share


def refuse_disconnected(count: int, share: float) -> None:
    """Raise `DisconnectedError` for so many components with a share of the volume."""
    raise DisconnectedError(
        f"the solid falls apart: {count} disconnected components hold {100 * share:.3g} % of its "
        f"volume, at most {100 * DISCONNECTED_SHARE:g} % may be left out; raise the density, "
        f"enlarge the cells or use finer finite cells",
        share=share,
    )


def _holds_disconnected(
    disconnected: BoolArray, places: NDArray[np.int32], subcells: int
) -> BoolArray:
    """Whether elements hold a corner of a disconnected component, ``(k,)``."""
    window = sliding_window_view(disconnected, (subcells + 1,) * 3)[
        ::subcells, ::subcells, ::subcells
    ]
    x, y, z = places.T
    return np.asarray(window.any(axis=(3, 4, 5)))[z, y, x]


def _by_colour(
    places: NDArray[np.int32],
    size: NDArray[np.int8],
    copy: NDArray[np.int8],
    copies: int,
    colours: int,
) -> tuple[IntArray, IntArray]:
    """Order by colour, then place, and the first of each colour."""
    x, y, z = places.T
    colour = _colour(places, size, copy, copies)
    order = np.lexsort((x, y, z, colour))
    return order, np.concatenate([[0], np.cumsum(np.bincount(colour, minlength=colours))])


def _colour(
    places: NDArray[np.int32], size: NDArray[np.int8], copy: NDArray[np.int8], copies: int
) -> IntArray:
    """Colours: small elements first, by copy, by the parity of their places."""
    x, y, z = places.T // size
    further = copies * (size.astype(np.int64) - 1) + copy
    colour: IntArray = (x & 1) + 2 * (y & 1) + 4 * (z & 1) + 8 * further
    return colour


def sorted_by_colour(elements: Elements, chosen: IntArray) -> tuple[IntArray, IntArray]:
    """Some elements by colour, and the first of each colour."""
    count = elements.colours.shape[1] - 1
    copies = 1 + int(elements.copy.max(initial=0))
    colour = _colour(
        elements.position[chosen], elements.size[chosen], elements.copy[chosen], copies
    )
    start = np.concatenate([[0], np.cumsum(np.bincount(colour, minlength=count))])
    return chosen[np.argsort(colour, kind="stable")], start


def soft_weights(elements: Elements, softness: float) -> FloatArray:
    """Weights of cut elements with a void of this share of the solid's stiffness, ``(k, 125)``."""
    full = gauss_weights(CUT_POINTS)
    return (1.0 - softness) * elements.weights + softness * full

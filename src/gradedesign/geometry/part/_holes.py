"""Holes in a surface: finding their rims, describing them, closing the small ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import face_edges

#: A rim of at most this many edges comes from one or two missing facets.
_FEW_EDGES = 4
#: Rims shorter than this share of the part's diagonal are small. Chosen, not measured.
_SMALL_RIM = 0.01
#: Largest change of volume that closing a hole may mean, as a share of the part's. Chosen, not
#: measured.
_VOLUME_SHARE = 0.005
#: Missing facets beyond this share of those present are no accident. Chosen, not measured.
_MISSING_SHARE = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rim:
    """The edges around one hole."""

    #: Vertices in the order in which a facet that fills the hole runs; empty if the rim is not a
    #: simple loop.
    loop: tuple[int, ...]
    size: int  #: Number of edges.
    perimeter: float  #: mm.
    centroid: FloatArray  #: ``(3,)``, mm.


def find_rims(vertices: FloatArray, faces: IntArray) -> tuple[Rim, ...]:
    """Group the open edges of a consistently oriented surface into rims, longest first."""
    edges = face_edges(faces)
    open_side = edges.count[edges.edge_of] == 1
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])[open_side]
    following: dict[int, list[int]] = {}
    for start, end in sides.tolist():
        following.setdefault(end, []).append(start)  # a filling facet runs the other way
    rims = []
    while following:
        rims.append(_rim(vertices, _take_chain(following)))
    return tuple(sorted(rims, key=lambda rim: -rim.perimeter))


def _take_chain(following: dict[int, list[int]]) -> list[int]:
    """Walk along open edges from any vertex until the walk closes or ends; uses edges up."""
    chain = [next(iter(following))]
    while chain[-1] in following:
        options = following[chain[-1]]
        chain.append(options.pop())
        if not options:
            del following[chain[-2]]
        if chain[-1] == chain[0]:
            break
    return chain


def _rim(vertices: FloatArray, chain: list[int]) -> Rim:
    points = vertices[chain]
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    middle = 0.5 * (points[1:] + points[:-1])
    simple = chain[0] == chain[-1] and len(set(chain)) == len(chain) - 1
    return Rim(
        loop=tuple(chain[:-1]) if simple else (),
        size=len(chain) - 1,
        perimeter=float(lengths.sum()),
        centroid=np.average(middle, axis=0, weights=lengths),
    )


def describe_rims(rims: Sequence[Rim], most: int = 5) -> str:
    """List holes with size and place."""
    parts = [
        f"{rim.size} edges, perimeter {rim.perimeter:.4g} mm, at ({rim.centroid[0]:.4g}, "
        f"{rim.centroid[1]:.4g}, {rim.centroid[2]:.4g}) mm"
        for rim in rims[:most]
    ]
    return "; ".join(parts) + (f"; and {len(rims) - most} more" if len(rims) > most else "")


def fill_rims(
    vertices: FloatArray,
    faces: IntArray,
    rims: Sequence[Rim],
    *,
    diagonal: float,
    volume: float,
    source: str,
) -> tuple[FloatArray, IntArray]:
    """Close every hole if each is small beyond doubt.

    A hole is small if its rim has at most four edges, or is shorter than 1 % of the diagonal,
    and half balls over all of them are below 0.5 % of the part's volume: a flat filling of a
    larger hole could cut off what stood on it.

    Raises PartError if a hole is too large, or the holes together are too many to be accidents.
    """
    large = [rim for rim in rims if not _is_small(rim, diagonal, volume)]
    if not large and sum(map(doubt, rims)) > _VOLUME_SHARE * abs(volume):
        large = list(rims)
    if large:
        raise PartError(
            f"{source}: {len(large)} of {len(rims)} holes are too large to fill, since what is "
            f"missing may hold more than {100 * _VOLUME_SHARE:g} % of the volume: "
            f"{describe_rims(large)}; close the part in CAD"
        )
    added = [_patch(vertices, rim, len(vertices) + k) for k, rim in enumerate(rims)]
    wide = [rim for rim in rims if rim.perimeter >= _SMALL_RIM * diagonal]
    missing = sum(rim.size - 2 for rim in wide)
    if missing > max(_FEW_EDGES, _MISSING_SHARE * len(faces)):
        raise PartError(
            f"{source}: about {missing} facets are missing beside the {len(faces)} there are, "
            f"too many to be an accident: {len(rims)} holes: {describe_rims(rims)}; "
            "export the part again"
        )
    centres = np.array([rim.centroid for rim in rims])
    return np.concatenate([vertices, centres]), np.concatenate([faces, *added])


def _is_small(rim: Rim, diagonal: float, volume: float) -> bool:
    """Whether the missing volume over a rim, up to half a ball, hardly changes the part's."""
    if not rim.loop or (rim.size > _FEW_EDGES and rim.perimeter >= _SMALL_RIM * diagonal):
        return False
    return doubt(rim) < _VOLUME_SHARE * abs(volume)


def doubt(rim: Rim) -> float:
    """Half a ball over a round rim of this perimeter, mm^3."""
    return float(rim.perimeter**3 / (12.0 * np.pi**2))


def _patch(vertices: FloatArray, rim: Rim, centre: int) -> IntArray:
    """Facets that close a rim; long rims get a fan around their centroid."""
    loop = rim.loop
    if len(loop) == 3:
        return np.array([loop], dtype=np.int64)
    if len(loop) == 4:
        a, b, c, d = vertices[list(loop)]
        if np.linalg.norm(a - c) > np.linalg.norm(b - d):
            loop = loop[1:] + loop[:1]
        return np.array([loop[:3], (loop[0], *loop[2:])], dtype=np.int64)
    ring = np.array(loop, dtype=np.int64)
    return np.stack([ring, np.roll(ring, -1), np.full_like(ring, centre)], axis=1)

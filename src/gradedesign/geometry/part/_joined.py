"""Bodies with common faces: joined into one, or set apart by a hair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import face_edges, linked_sets, shell_labels, split_by
from gradedesign.geometry.part._nesting import flat_shells, manifold_of, mesh_of, shell_volume
from gradedesign.geometry.part._self_crossing import pieces_of
from gradedesign.geometry.part._touching import Touches, find_touches
from gradedesign.geometry.triangles.short_edges import used_only, without_short_edges

#: Joined, faces in contact reach this many times as far into each other as they are apart, and
#: this share of the diagonal beyond: a hundred times the rounding of the Boolean kernel, 1e-12.
_DEEPER, _DEPTH_SHARE = 3.0, 1e-10
#: Set apart, faces are twice as far apart as they are off each other, and this share of the
#: diagonal beyond: the nearest of two is told by 1e-13 of it, and the volume changes by 1e-9.
_FARTHER, _GAP_SHARE = 2.0, 1e-10
#: Singular values below this share are left out where a corner moves out of several faces: it
#: moves no more than twenty times as far as each of them.
_LEAST_SINGULAR = 0.05
#: Pairs of solids that a message lists. Chosen, not measured.
_LISTED = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Settled:
    """Shells after what touched was joined or set apart."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    parts: tuple[IntArray, ...]  #: Each ``(k, 3)``.
    area: float = 0.0  #: mm^2. Of the common faces of different solids.
    joined: int = 0  #: Solids that were joined with others, or with themselves.
    words: str = ""  #: Which solids touch, for a message; empty where none do any more.
    notes: tuple[str, ...] = ()


def settle_touches(
    shells: Settled, owner: IntArray, touches: Touches, *, bodies: str, margin: float, source: str
) -> Settled:
    """Join bodies that touch, or set them apart; a body that touches itself is always joined.

    Raises PartError if bodies that touch cannot be joined.

    - ``shells``: as they are; outward, voids reversed, without common vertices
    - ``owner (s,)``: shell of the solid that each shell bounds
    - ``bodies``: "one", "join" or "all" with ``one`` those of different solids are left, and named
    - ``margin``, mm: edges shorter than this are none
    """
    if len(touches.area) == 0:
        return shells
    across = owner[touches.shells[0]] != owner[touches.shells[1]]
    area = float(touches.area[across].sum())
    words = _words(touches.chosen(across), owner)
    apart = touches.chosen(across if bodies == "all" else np.zeros_like(across))
    joining = touches.chosen(across | ~across if bodies == "join" else ~across)
    moved, deep = overlapping(shells, joining)
    diagonal = float(np.linalg.norm(np.ptp(shells.vertices, axis=0)))
    wide = _FARTHER * float(apart.distance.max(initial=0.0)) + _GAP_SHARE * diagonal
    vertices = moved.vertices - _moves(shells, apart, wide)
    moved = Settled(vertices=vertices, parts=shells.parts)
    made, joined, notes = _joined(moved, owner, joining, (margin, deep), source)
    if len(apart.area):
        notes.append(f'{source}: {words}; they are kept apart (bodies = "all")')
    return Settled(
        vertices=made.vertices,
        parts=made.parts,
        area=area,
        joined=joined,
        words="" if bodies == "join" else words,
        notes=tuple(notes),
    )


def overlapping(shells: Settled, touches: Touches) -> tuple[Settled, float]:
    """Move facets in contact into each other, and how deep, mm."""
    diagonal = float(np.linalg.norm(np.ptp(shells.vertices, axis=0)))
    depth = _DEEPER * float(touches.distance.max(initial=0.0)) + _DEPTH_SHARE * diagonal
    moved = shells.vertices + _moves(shells, touches, depth)
    return Settled(vertices=moved, parts=shells.parts), depth


def _words(touches: Touches, owner: IntArray) -> str:
    """Pairs of solids that touch, with areas and places."""
    pair = np.sort(owner[touches.shells], axis=0)
    solids, index = np.unique(pair, axis=1, return_inverse=True)
    listed = []
    for k in range(min(solids.shape[1], _LISTED)):
        own = index.ravel() == k
        p = np.average(touches.middle[own], axis=0, weights=touches.area[own])
        listed.append(
            f"{touches.area[own].sum():.5g} mm^2 around ({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g}) mm"
        )
    more = solids.shape[1] - len(listed)
    end = f" and in {more} more places" if more else ""
    return f"{len(np.unique(solids))} solids touch along {', '.join(listed)}{end}" if listed else ""


def _moves(shells: Settled, touches: Touches, depth: float) -> FloatArray:
    """Displacements ``(n, 3)``, mm, that move facets in contact outwards by a depth.

    Of two facets on each other one moves, and its corners move with all their facets in contact.
    """
    moves = np.zeros_like(shells.vertices)
    shell, number = touches.movers
    if len(shell) == 0:
        return moves
    found = [shells.parts[s][f] for s, f in zip(shell.tolist(), number.tolist(), strict=True)]
    facets = np.unique(np.array(found), axis=0)
    a, b, c = np.moveaxis(shells.vertices[facets], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    order = np.argsort(facets.ravel(), kind="stable")
    corner, start = np.unique(facets.ravel()[order], return_index=True)
    for vertex, own in zip(corner.tolist(), np.split(order // 3, start[1:]), strict=True):
        moves[vertex] = np.linalg.lstsq(
            normal[own], np.full(len(own), depth), rcond=_LEAST_SINGULAR
        )[0]
    return moves


def _joined(
    shells: Settled,
    owner: IntArray,
    touches: Touches,
    lengths: tuple[float, float],
    source: str,
) -> tuple[Settled, int, list[str]]:
    """Unite shells that now overlap where they touched; how many solids, and remarks.

    ``lengths`` are the margin and the depth of the overlap, mm.
    """
    if len(touches.area) == 0:
        return shells, 0, []
    count = len(shells.parts)
    cluster = linked_sets(owner[touches.shells], count)[owner]
    touched = np.unique(cluster[touches.shells])
    points, parts, notes, start, solids = [], [], [], 0, 0
    for number in range(int(cluster.max()) + 1):
        own = np.flatnonzero(cluster == number)
        if number not in touched:
            new, made = shells.vertices, [shells.parts[k] for k in own]
        else:
            inner = touches.chosen(cluster[touches.shells[0]] == number)
            new, made = _whole(shells, own, owner, inner, lengths, source)
            several = np.unique(owner[own])
            solids += len(several)
            notes.append(_note(new, made, several, inner, owner, source))
            _require_same(shells, own, (new, made), inner, lengths, source)
        points.append(new)
        parts += [part + start for part in made]
        start += len(new)
    return Settled(vertices=np.concatenate(points), parts=tuple(parts)), solids, notes


def _whole(
    shells: Settled,
    own: IntArray,
    owner: IntArray,
    touches: Touches,
    lengths: tuple[float, float],
    source: str,
) -> tuple[FloatArray, list[IntArray]]:
    """The union of some shells, each solid with its own voids taken out first."""
    import manifold3d

    margin, depth = lengths
    folded = np.unique(touches.shells[0][touches.shells[0] == touches.shells[1]])
    solids: dict[int, list[Any] | None] = {}
    for k in own.tolist():
        solid = manifold_of(shells.vertices, shells.parts[k], 1.0 if owner[k] == k else -1.0)
        solids[k] = None if solid is None else [solid]
        if solid is not None and k in folded:
            solids[k] = pieces_of(solid, 0.1 * depth)
    if any(not pieces for pieces in solids.values()):
        raise PartError(
            f"{source}: bodies that touch could not be joined, since their surfaces touch or cross "
            "themselves; unite them in CAD"
        )
    add, subtract = manifold3d.OpType.Add, manifold3d.OpType.Subtract
    united = {k: manifold3d.Manifold.batch_boolean(v or [], add) for k, v in solids.items()}
    wholes = [
        manifold3d.Manifold.batch_boolean(
            [united[k], *(united[v] for v in own.tolist() if owner[v] == k != v)], subtract
        )
        for k in own.tolist()
        if owner[k] == k
    ]
    return united_shells(*mesh_of(manifold3d.Manifold.batch_boolean(wholes, add)), margin)


def united_shells(
    vertices: FloatArray, faces: IntArray, margin: float
) -> tuple[FloatArray, list[IntArray]]:
    """Shells of a union, without slivers where faces nearly met.

    That are edges shorter than the margin, which join corners of both, and shells without volume.
    """
    surface = used_only(vertices, without_short_edges(vertices, faces, margin))
    label = shell_labels(face_edges(surface.faces), len(surface.faces))
    parts = split_by(label, surface.faces)
    flat = flat_shells(surface.vertices, parts, margin)
    return surface.vertices, [part for part, gone in zip(parts, flat, strict=True) if not gone]


def _note(
    vertices: FloatArray,
    parts: Sequence[IntArray],
    solids: IntArray,
    touches: Touches,
    owner: IntArray,
    source: str,
) -> str:
    volume = sum(shell_volume(vertices, part) for part in parts)
    if len(solids) == 1:
        return (
            f"{source}: a body touches itself along {touches.area.sum():.5g} mm^2; joined there, "
            f"{volume:.6g} mm^3"
        )
    across = owner[touches.shells[0]] != owner[touches.shells[1]]
    return (
        f"{source}: {len(solids)} solids that touch were joined along "
        f"{touches.area[across].sum():.5g} mm^2 of common faces to {volume:.6g} mm^3 "
        '(bodies = "join")'
    )


def _require_same(
    shells: Settled,
    own: IntArray,
    made: tuple[FloatArray, list[IntArray]],
    touches: Touches,
    lengths: tuple[float, float],
    source: str,
) -> None:
    """Refuse a union that has lost volume, or still touches itself.

    Its volume is that of the solids, less what overlaps: the depth times the area.
    """
    margin, depth = lengths
    vertices, parts = made
    before = sum(shell_volume(shells.vertices, shells.parts[k]) for k in own.tolist())
    after = sum(shell_volume(vertices, part) for part in parts)
    overlap = 2.0 * depth * float(touches.area.sum()) + 1e-6 * before
    left = find_touches(vertices, parts, margin)
    if abs(after - before) > overlap or len(left.area):
        raise PartError(
            f"{source}: bodies that touch along {touches.area.sum():.5g} mm^2 could not be joined: "
            f"{before:.6g} mm^3 before, {after:.6g} mm^3 after, {left.area.sum():.5g} mm^2 still "
            "touching; unite them in CAD"
        )

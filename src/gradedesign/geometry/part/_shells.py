"""Closed shells sorted by what they bound: solids, voids, overlaps, fragments.

A reversed shell inside a solid is a void, one that reaches out of it a hole; a shell inside a
solid that runs the same way round bounds nothing and is dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import linked_sets
from gradedesign.geometry.part._folds import unfolded_shells
from gradedesign.geometry.part._joined import Settled, overlapping, settle_touches, united_shells
from gradedesign.geometry.part._nesting import Nesting, find_nesting, innermost, shell_volume, unite
from gradedesign.geometry.part._self_crossing import require_simple, uncross_shells
from gradedesign.geometry.part._shell_roles import ShellRoles, outward_signs, shell_roles
from gradedesign.geometry.part._touching import Touches, find_touches, own_vertices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidShells:
    """The surface that bounds the material, with counts of the changes made to obtain it."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    faces: IntArray  #: ``(m, 3)``.
    counts: Mapping[str, int]  #: Keys as in ``RepairReport``.
    common_area: float  #: mm^2. Of the faces in which solids touch.
    warnings: tuple[str, ...]


def settle_shells(
    vertices: FloatArray, faces: IntArray, *, bodies: str, margin: float, source: str
) -> SolidShells:
    """Turn shells outward, keep true voids, unite overlaps, drop fragments, count the bodies.

    Raises PartError if the surface does not close, has no volume, overlaps itself in a way that
    cannot be settled, or falls into several bodies where one is asked.

    - ``vertices (n, 3)``, mm
    - ``faces (m, 3)``: consistently oriented
    - ``bodies``: "one", "join" or "all"
    - ``margin``, mm: depth up to which facets only touch
    """
    single = unfolded_shells(vertices, faces, margin=margin, source=source)
    _require_volume(single.vertices, single.parts, source)
    free = uncross_shells(single.vertices, single.parts, margin=margin, source=source)
    shells, roles, notes = _bounding(free.vertices, list(free.parts), margin, source)
    united = int(shells.crossing.sum()) + free.united
    if shells.crossing.any():
        shells, note = _united(shells, margin, source)
        notes.append(note)
    settled = settle_touches(
        Settled(vertices=shells.vertices, parts=tuple(shells.parts)),
        shells.owner,
        shells.touches,
        bodies=bodies,
        margin=margin,
        source=source,
    )
    vertices, parts = own_vertices(settled.vertices, settled.parts)
    volumes = np.array([shell_volume(vertices, part) for part in parts])
    _require_bodies(vertices, parts, volumes, bodies, settled.words, source)
    faces = np.concatenate(parts)
    if len(parts) > 1 or united:  # a single shell was measured when it was uncrossed
        require_simple(vertices, faces, source)
    counts = {
        "facets_folded": single.removed,
        "shells_inverted": int(roles.inverted.sum()),
        "shells_ignored": int(roles.ignored.sum()),
        "shells_united": united,
        "fragments_dropped": int(roles.fragment.sum()),
        "bodies_joined": settled.joined,
        "bodies": int((volumes > 0).sum()),
        "voids": int((volumes < 0).sum()),
    }
    return SolidShells(
        vertices=vertices,
        faces=faces,
        counts=counts,
        common_area=settled.area,
        warnings=(*single.notes, *free.notes, *notes, *settled.notes),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Shells:
    """Shells that bound material, outward, voids reversed, without common vertices."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    parts: list[IntArray]  #: Each ``(k, 3)``.
    nesting: Nesting
    crossing: BoolArray  #: ``(s,)``. Which overlap others.
    touches: Touches

    @property
    def owner(self) -> IntArray:
        """Solid that each shell bounds: itself, or for a void the solid around it, ``(s,)``."""
        owner = np.arange(len(self.parts))
        for k, part in enumerate(self.parts):
            around = innermost(self.nesting, k) if shell_volume(self.vertices, part) < 0 else None
            owner[k] = k if around is None else around
        return owner


def _bounding(
    vertices: FloatArray, parts: list[IntArray], margin: float, source: str
) -> tuple[_Shells, ShellRoles, list[str]]:
    """Shells that bound material, the roles of all, and remarks."""
    volumes = np.array([shell_volume(vertices, part) for part in parts])
    nesting = find_nesting(vertices, parts, volumes, margin)
    sign, inverted = outward_signs(nesting, volumes, source)
    turned = [p[:, ::-1] if f else p for p, f in zip(parts, sign * volumes < 0, strict=True)]
    vertices, parts = own_vertices(vertices, turned)
    touches = find_touches(vertices, parts, margin)
    roles = shell_roles(nesting, volumes, sign, inverted, touches.matrix(len(parts)))
    kept = np.flatnonzero(roles.kept)
    if len(kept) == 0:
        raise PartError(
            f"{source}: its {len(parts)} closed shells cancel each other, so that nothing is "
            "solid; turn the normals of those that are solids outward"
        )
    among = np.ix_(kept, kept)
    shells = _Shells(
        vertices=vertices,
        parts=[parts[k] for k in kept.tolist()],
        nesting=Nesting(inside=nesting.inside[among], overlap=nesting.overlap[among]),
        crossing=np.asarray(nesting.overlap[among].any(axis=1)),
        touches=touches.among(kept, len(parts)),
    )
    return shells, roles, _notes(volumes, roles, source)


def _united(shells: _Shells, margin: float, source: str) -> tuple[_Shells, str]:
    """Unite shells that overlap and describe the change; keep the others."""
    vertices, parts, nesting = shells.vertices, shells.parts, shells.nesting
    volumes = np.array([shell_volume(vertices, part) for part in parts])
    related = nesting.overlap.copy()
    related[np.arange(len(parts)), shells.owner] = True
    cluster = linked_sets(np.nonzero(related), len(parts))
    # What is united anyway must leave no slit where its shells touch as well.
    one, other = cluster[shells.touches.shells]
    touches = shells.touches.chosen(
        (one == other) & (shells.touches.shells[0] != shells.touches.shells[1])
    )
    vertices = overlapping(Settled(vertices=vertices, parts=tuple(parts)), touches)[0].vertices
    points, made = [], []
    before = after = 0.0
    count = 0
    for number in range(int(cluster.max()) + 1):
        own = cluster == number
        if shells.crossing[own].any():
            sign = np.where(volumes > 0, 1, -1)
            new, pieces = united_shells(*unite(vertices, parts, own, sign, nesting, source), margin)
            before += float(volumes[own].sum())
            after += sum(shell_volume(new, piece) for piece in pieces)
        else:
            new, pieces = own_vertices(vertices, [parts[k] for k in np.flatnonzero(own)])
        points.append(new)
        made += [piece + count for piece in pieces]
        count += len(new)
    note = (
        f"{source}: overlapping shells were united; volume {before:.6g} mm^3 counted shell by "
        f"shell, {after:.6g} mm^3 united"
    )
    vertices, parts = own_vertices(np.concatenate(points), made)
    volumes = np.array([shell_volume(vertices, part) for part in parts])
    united = _Shells(
        vertices=vertices,
        parts=parts,
        nesting=find_nesting(vertices, parts, volumes, margin),
        crossing=np.zeros(len(parts), dtype=np.bool_),
        touches=find_touches(vertices, parts, margin),
    )
    return united, note


def _require_volume(vertices: FloatArray, parts: Sequence[IntArray], source: str) -> None:
    """Refuse a surface of which no shell has thickness."""
    volumes = [abs(shell_volume(vertices, part)) for part in parts]
    boxes = [float(np.prod(np.ptp(vertices[part], axis=(0, 1)))) for part in parts]
    if all(v <= 1e-9 * box for v, box in zip(volumes, boxes, strict=True)):
        raise PartError(
            f"{source}: the surface encloses no volume ({max(volumes):.3g} mm^3 in a box "
            f"of {max(boxes):.4g} mm^3); a part needs thickness"
        )


def _notes(volumes: FloatArray, roles: ShellRoles, source: str) -> list[str]:
    """Put the decisions about shells into words."""
    inverted, ignored, cut, fragment = roles.inverted, roles.ignored, roles.cut, roles.fragment
    warnings = []
    if inverted.any():
        warnings.append(f"{source}: {inverted.sum()} of {len(volumes)} shells inside out, flipped")
    for words, which in (
        ("shells inside the solid ignored ({}); a void needs reversed normals", roles.sign > 0),
        ("reversed shells that lie in no solid ignored ({})", roles.sign < 0),
    ):
        if (which & ignored).any():
            volume = f"{np.abs(volumes[which & ignored]).sum():.4g} mm^3"
            warnings.append(f"{source}: {(which & ignored).sum()} {words.format(volume)}")
    if cut.any():
        warnings.append(
            f"{source}: {cut.sum()} reversed shells that reach out of the solid were taken as "
            "holes; a boss needs outward normals"
        )
    if fragment.any():
        warnings.append(
            f"{source}: {fragment.sum()} disconnected components dropped "
            f"({np.abs(volumes[fragment]).sum():.4g} mm^3, each under 0.1 % of the largest body)"
        )
    return warnings


def _require_bodies(
    vertices: FloatArray,
    parts: Sequence[IntArray],
    volumes: FloatArray,
    bodies: str,
    touching: str,
    source: str,
) -> None:
    """Refuse several solids unless they are wanted."""
    solids = np.flatnonzero(volumes > 0)
    if bodies == "all" or len(solids) == 1:
        return
    places = [vertices[parts[k]].mean(axis=(0, 1)) for k in solids[:5]]
    listed = "; ".join(
        f"{volumes[k]:.4g} mm^3 around ({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g}) mm"
        for k, p in zip(solids, places, strict=False)
    )
    what_to_do = 'unite them in CAD, or set bodies = "all" if they are meant to be loose'
    if touching:  # loose ones that touch would be one for every analysis
        what_to_do = (
            f'{touching}: set bodies = "join" to unite them there, or leave a gap between them in '
            'CAD and set bodies = "all" if they are meant to be loose'
        )
    raise PartError(
        f"{source}: the file holds {len(solids)} separate solids: {listed}; {what_to_do}"
    )

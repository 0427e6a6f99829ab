"""Closed shells sorted by what they bound: solids, voids, overlaps, fragments.

A reversed shell inside a solid is a void, one that reaches out of it a hole; a shell inside a
solid that runs the same way round bounds nothing and is dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.part._edges import Edges, face_edges
from gradedesign.part._nesting import Nesting, find_nesting, shell_volume, unite
from gradedesign.part._orient import shell_labels, split_shells
from gradedesign.part._self_crossing import require_simple, uncross_shells
from gradedesign.part._shell_roles import ShellRoles, shell_roles

#: Shells below this share of the largest volume enclose nothing that single precision can hold.
FLAT_SHARE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidShells:
    """The surface that bounds the material, with counts of the changes made to obtain it.

    Attributes
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
    counts : mapping of str to int
        Keys as in ``RepairReport``.
    warnings : tuple of str
    """

    vertices: FloatArray
    faces: IntArray
    counts: Mapping[str, int]
    warnings: tuple[str, ...]


def settle_shells(
    vertices: FloatArray, faces: IntArray, *, bodies: str, margin: float, source: str
) -> SolidShells:
    """Turn shells outward, keep true voids, unite overlaps, drop fragments, count the bodies.

    Parameters
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
        Consistently oriented.
    bodies : {"one", "all"}
    margin : float, mm
        Depth up to which facets only touch.
    source : str

    Raises
    ------
    PartError
        If the surface does not close, has no volume, overlaps itself in a way that cannot be
        settled, or falls into several bodies where one is asked.
    """
    parts = split_shells(faces, _closed_shells(vertices, faces, source))
    _require_volume(vertices, parts, source)
    free = uncross_shells(vertices, parts, margin=margin, source=source)
    vertices = free.vertices
    parts, volumes, flat = _without_flat(vertices, free.parts, source)
    nesting = find_nesting(vertices, parts, volumes)
    roles = shell_roles(nesting, volumes, source)
    sign, keep = roles.sign, roles.keep
    warnings = [*free.notes, *flat, *_notes(volumes, roles, source)]
    parts = [p[:, ::-1] if flip else p for p, flip in zip(parts, sign * volumes < 0, strict=True)]
    crossing = keep & nesting.overlap[:, keep].any(axis=1)
    shells = [parts[k] for k in np.flatnonzero(keep)]
    if crossing.any():
        vertices, shells, note = _united(vertices, parts, keep, sign, nesting, source)
        warnings.append(note)
    shell_volumes = np.array([shell_volume(vertices, part) for part in shells])
    _require_bodies(vertices, shells, shell_volumes, bodies, source)
    vertices, faces = _separate(vertices, shells)
    if len(shells) > 1 or crossing.any():  # a single shell was measured when it was uncrossed
        require_simple(vertices, faces, source)
    counts = {
        "shells_inverted": int(roles.inverted.sum()),
        "shells_ignored": int(roles.ignored.sum()),
        "shells_united": int(crossing.sum()) + free.united,
        "fragments_dropped": int(roles.fragment.sum()),
        "bodies": int((shell_volumes > 0).sum()),
        "voids": int((shell_volumes < 0).sum()),
    }
    return SolidShells(vertices=vertices, faces=faces, counts=counts, warnings=tuple(warnings))


def _united(
    vertices: FloatArray,
    parts: list[IntArray],
    keep: BoolArray,
    sign: IntArray,
    nesting: Nesting,
    source: str,
) -> tuple[FloatArray, list[IntArray], str]:
    """Unite overlapping shells: vertices, the shells of the union, and a remark with volumes."""
    before = sum(shell_volume(vertices, parts[k]) for k in np.flatnonzero(keep))
    vertices, faces = unite(vertices, parts, keep, sign, nesting, source)
    shells = split_shells(faces, shell_labels(face_edges(faces), len(faces)))
    note = (
        f"{source}: overlapping shells were united; volume {before:.6g} mm^3 counted shell by "
        f"shell, {sum(shell_volume(vertices, shell) for shell in shells):.6g} mm^3 united"
    )
    return vertices, shells, note


def _without_flat(
    vertices: FloatArray, parts: Sequence[IntArray], source: str
) -> tuple[list[IntArray], FloatArray, list[str]]:
    """Drop closed shells that enclose nothing, such as pockets flattened by single precision."""
    volumes = np.array([shell_volume(vertices, part) for part in parts])
    solid = np.abs(volumes) > FLAT_SHARE * np.abs(volumes).max()
    shells = [p for p, keep in zip(parts, solid, strict=True) if keep]
    gone = len(parts) - len(shells)
    notes = [f"{source}: {gone} closed shells without volume were dropped"] if gone else []
    return shells, volumes[solid], notes


def _closed_shells(vertices: FloatArray, faces: IntArray, source: str) -> IntArray:
    """Label shells such that each closes by itself, ``(m,)``."""
    edges = face_edges(faces)
    label = shell_labels(edges, len(faces))
    side, net = _net_directions(edges, label)
    if net.any():  # sheets that close only together, at edges of more than two facets
        touched = np.isin(edges.edge_of, edges.edge_of[side[net != 0]])
        shell = np.tile(label, 3)[touched]
        graph = coo_array(
            (np.ones(len(shell)), (shell, int(label.max()) + 1 + edges.edge_of[touched])),
            shape=(int(label.max()) + 1 + len(edges.count),) * 2,
        )
        merged = connected_components(graph, directed=False)[1][label]
        label = np.unique(merged, return_inverse=True)[1].astype(np.int64)
        side, net = _net_directions(edges, label)
    if net.any():
        wrong = edges.edge_of[side[net != 0]]
        place = vertices[edges.ends[wrong]].mean(axis=1)
        listed = "; ".join(f"({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g}) mm" for p in place[:5])
        raise PartError(
            f"{source}: {len(np.unique(wrong))} non-manifold edges at which the facets do not "
            f"close to a solid, at {listed}; separate or unite the touching bodies in CAD"
        )
    return label


def _net_directions(edges: Edges, label: IntArray) -> tuple[IntArray, IntArray]:
    """Net count of directions along each edge within each shell, with one side of each."""
    key = np.tile(label, 3) * np.int64(len(edges.count)) + edges.edge_of
    _, side, index = np.unique(key, return_index=True, return_inverse=True)
    net = np.zeros(len(side), dtype=np.int64)
    np.add.at(net, index, np.where(edges.forward, 1, -1))
    return side, net


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
    if ignored.any():
        warnings.append(
            f"{source}: {ignored.sum()} shells inside the solid ignored "
            f"({np.abs(volumes[ignored]).sum():.4g} mm^3); a void needs reversed normals"
        )
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
    vertices: FloatArray, parts: list[IntArray], volumes: FloatArray, bodies: str, source: str
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
    raise PartError(
        f"{source}: the file holds {len(solids)} separate solids: {listed}; "
        'unite them in CAD, or set bodies = "all" if they are meant to be loose'
    )


def _separate(vertices: FloatArray, parts: list[IntArray]) -> tuple[FloatArray, IntArray]:
    """Give every shell its own vertices, so that shells that touch stay apart."""
    points, facets, start = [], [], 0
    for part in parts:
        used, index = np.unique(part, return_inverse=True)
        points.append(vertices[used])
        facets.append(index.reshape(-1, 3) + start)
        start += len(used)
    return np.concatenate(points), np.concatenate(facets).astype(np.int64)

"""Which closed shells bound material: solids, voids, overlaps, crumbs.

Material is where the winding number is positive. A reversed shell inside a solid is a void; a
shell inside a solid that runs the same way round bounds nothing and is dropped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.part._edges import Edges, face_edges
from gradedesign.part._nesting import Nesting, find_nesting, unite
from gradedesign.part._orient import shell_labels

#: A loose piece below this share of the largest one's volume is a crumb.
CRUMB_SHARE = 1e-3
#: Shells below this share of the largest volume enclose nothing that single precision can hold.
FLAT_SHARE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidShells:
    """The surface that bounds the material, and what was done to get it.

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
    vertices: FloatArray, faces: IntArray, *, bodies: str, source: str
) -> SolidShells:
    """Turn shells outward, keep true voids, unite overlaps, drop crumbs, count the bodies.

    Raises
    ------
    PartError
        If the surface does not close, has no volume, or falls into several bodies where one
        is asked.
    """
    label = _closed_shells(vertices, faces, source)
    parts = [faces[label == k] for k in range(int(label.max()) + 1)]
    volumes = np.array([_volume(vertices, part) for part in parts])
    _require_volume(vertices, volumes, source)
    parts, volumes, flat = _without_flat(parts, volumes, source)
    nesting = find_nesting(vertices, parts, volumes)
    crumb = _crumbs(nesting, volumes)
    sign, inverted = _outward_signs(nesting, volumes)
    outside = np.where(nesting.inside, sign[None, :], 0).sum(axis=1)
    bounding = (outside > 0) != (outside + sign > 0)
    ignored, keep = ~bounding & ~crumb, bounding & ~crumb
    warnings = [
        *flat,
        *_notes(volumes, crumb=crumb, inverted=inverted, ignored=ignored, source=source),
    ]
    parts = [p[:, ::-1] if flip else p for p, flip in zip(parts, sign * volumes < 0, strict=True)]
    crossing = keep & nesting.overlap[:, keep].any(axis=1)
    kept = [parts[k] for k in np.flatnonzero(keep)]
    if crossing.any():
        vertices, kept, note = _united(vertices, parts, keep, sign, nesting, source)
        warnings.append(note)
    kept_volumes = np.array([_volume(vertices, part) for part in kept])
    _require_bodies(vertices, kept, kept_volumes, bodies, source)
    vertices, faces = _separate(vertices, kept)
    counts = {
        "shells_inverted": int(inverted.sum()),
        "shells_ignored": int(ignored.sum()),
        "shells_united": int(crossing.sum()),
        "fragments_dropped": int(crumb.sum()),
        "bodies": int((kept_volumes > 0).sum()),
        "voids": int((kept_volumes < 0).sum()),
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
    before = sum(_volume(vertices, parts[k]) for k in np.flatnonzero(keep))
    vertices, faces = unite(vertices, parts, keep, sign, nesting, source)
    label = shell_labels(face_edges(faces), len(faces))
    shells = [faces[label == k] for k in range(int(label.max()) + 1)]
    note = (
        f"{source}: overlapping shells were united; volume {before:.6g} mm^3 counted shell by "
        f"shell, {_volume(vertices, faces):.6g} mm^3 united"
    )
    return vertices, shells, note


def _volume(vertices: FloatArray, faces: IntArray) -> float:
    """Signed volume of a closed shell about its own middle, mm^3."""
    corners = vertices[faces]
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _without_flat(
    parts: list[IntArray], volumes: FloatArray, source: str
) -> tuple[list[IntArray], FloatArray, list[str]]:
    """Drop closed shells that enclose nothing, such as pockets flattened by single precision."""
    solid = np.abs(volumes) > FLAT_SHARE * np.abs(volumes).max()
    gone = int(np.count_nonzero(~solid))
    if gone == 0:
        return parts, volumes, []
    note = f"{source}: {gone} closed shells without volume were dropped"
    return [p for p, keep in zip(parts, solid, strict=True) if keep], volumes[solid], [note]


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


def _require_volume(vertices: FloatArray, volumes: FloatArray, source: str) -> None:
    box = float(np.prod(np.ptp(vertices, axis=0)))
    if np.abs(volumes).max() <= 1e-9 * box:
        raise PartError(
            f"{source}: the surface encloses no volume ({np.abs(volumes).max():.3g} mm^3 in a box "
            f"of {box:.4g} mm^3); a part needs thickness"
        )


def _crumbs(nesting: Nesting, volumes: FloatArray) -> BoolArray:
    """Loose pieces too small to be meant."""
    loose = ~nesting.inside.any(axis=1) & ~nesting.overlap.any(axis=1)
    return loose & (np.abs(volumes) < CRUMB_SHARE * np.abs(volumes).max())


def _outward_signs(nesting: Nesting, volumes: FloatArray) -> tuple[IntArray, BoolArray]:
    """+1 for shells that add material, -1 for those that take it, and which had to be flipped.

    Everything inside an inverted outermost shell is flipped with it: the file is inside out.
    """
    size = np.abs(volumes)
    outermost = np.where(
        nesting.inside.any(axis=1),
        np.argmax(np.where(nesting.inside, size[None, :], -1.0), axis=1),
        np.arange(len(volumes)),
    )
    inverted = volumes[outermost] < 0
    return np.where((volumes > 0) ^ inverted, 1, -1), inverted


def _notes(
    volumes: FloatArray,
    *,
    crumb: BoolArray,
    inverted: BoolArray,
    ignored: BoolArray,
    source: str,
) -> list[str]:
    """Put the decisions about shells into words."""
    warnings = []
    if inverted.any():
        warnings.append(f"{source}: {inverted.sum()} of {len(volumes)} shells inside out, flipped")
    if ignored.any():
        warnings.append(
            f"{source}: {ignored.sum()} shells inside the solid ignored "
            f"({np.abs(volumes[ignored]).sum():.4g} mm^3); a void needs reversed normals"
        )
    if crumb.any():
        warnings.append(
            f"{source}: {crumb.sum()} loose fragments dropped "
            f"({np.abs(volumes[crumb]).sum():.4g} mm^3, each under 0.1 % of the largest body)"
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

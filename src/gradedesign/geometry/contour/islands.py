"""Disconnected components of a lattice: removed where tiny, refused where not."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour._surface_kernels import shell_volumes, vertex_shells
from gradedesign.geometry.tets.quality import piece_labels
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.geometry.triangles.short_edges import used_only
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.geometry.triangles.winding import winding_numbers

log = logging.getLogger(__name__)

#: Largest share of the volume that may be dropped as disconnected components. Chosen, not measured.
_MAX_SHARE = 0.02
#: About the cube of the edges that are collapsed after the cut, 0.02 grid steps, over that of half
#: a step.
CRUMB = 1e-4

#: Share of the solid that is dust of the contour: pieces of a few of its triangles where surfaces
#: touch (1.5e-5 of 232 mm^3 where a net joins cut struts). No one misses them. Chosen.
_DUST = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Islands:
    """Report on the removal of disconnected components and closed pockets."""

    dropped: int  #: Disconnected solids removed.
    dropped_volume: float  #: mm^3. Their volume, closed pockets inside them subtracted.
    dropped_share: float  #: Their share of the solid volume before removal.
    pockets: int  #: Closed voids inside the solid that stays; no powder or resin leaves them.
    pocket_volume: float  #: mm^3. Their volume.
    filled: int  #: Closed voids that were filled, as printing would or below the grid.
    filled_volume: float  #: mm^3. Their volume.
    filled_share: float  #: That over the solid that stays.

    @property
    def filled_words(self) -> tuple[str, ...]:
        """Warning on closed voids that were filled, unless they are dust."""
        if self.filled_share <= _DUST:
            return ()
        pores = "closed pore was" if self.filled == 1 else "closed pores were"
        return (
            f"{self.filled} {pores} filled, too small to be drained: {self.filled_volume:.3g} "
            f"mm^3 in all, {self.filled_share:.2g} of the solid",
        )


def islands_words(dropped: int, share: float) -> tuple[str, ...]:
    """Warning on solids that were left out, by their number and share of the volume."""
    words = "floating island was" if dropped == 1 else "floating islands were"
    return (f"{dropped} {words} removed",) if share > _DUST else ()


def remove_islands(
    surface: SurfaceMesh,
    *,
    keep: int = 1,
    max_share: float = _MAX_SHARE,
    least_pocket: float = 0.0,
) -> tuple[SurfaceMesh, Islands]:
    """Keep the largest solids of a closed surface with their voids, drop the others.

    A shell of positive volume bounds a solid from outside. A shell of negative volume is a void;
    it belongs to the smallest solid around it and goes or stays with it.

    Raises LatticeError if nothing is solid, or more than ``max_share`` would be dropped.

    - ``surface``: closed and outward oriented
    - ``keep``: number of solids to keep, by volume; the number of bodies of the part
    - ``max_share``: largest share of the volume that may be dropped
    - ``least_pocket``, mm^3: closed voids up to this volume are filled: below the grid they are
      artefacts of cutting. Of solids those up to `CRUMB` of it are, and are dropped without being
      counted.
    """
    vertex_shell = vertex_shells(surface.faces, len(surface.vertices))
    shell = vertex_shell[surface.faces[:, 0]]
    count = int(vertex_shell.max()) + 1
    volume = shell_volumes(surface.vertices, surface.faces, vertex_shell, count)
    solids = np.flatnonzero(volume > 0)
    if not solids.size:
        raise LatticeError("the surface encloses no solid; a field is negative inside the solid")
    by_size = solids[np.argsort(-volume[solids], kind="stable")]
    kept = np.zeros(len(volume), dtype=bool)
    kept[by_size[:keep]] = True
    disconnected = by_size[keep:]
    voids = np.flatnonzero(volume <= 0)
    owner = _void_owners(surface, shell, voids, disconnected, int(by_size[0]))
    kept[voids] = kept[owner] & (volume[voids] < -least_pocket)
    # Pockets that are filled are no part of what is dropped: they would hide as much of it.
    filled = voids[kept[owner] & ~kept[voids]]
    full = abs(float(volume[filled].sum()))
    gone = float(volume[~kept].sum()) + full
    share = gone / float(volume.sum())
    report = Islands(
        dropped=int(np.count_nonzero(volume[disconnected] > CRUMB * least_pocket)),
        dropped_volume=gone,
        dropped_share=share,
        pockets=int(np.count_nonzero(kept[voids])),
        pocket_volume=abs(float(volume[voids][kept[voids]].sum())),
        filled=len(filled),
        filled_volume=full,
        filled_share=full / float(volume[kept].sum()),
    )
    refuse_large(report.dropped, share, max_share)
    if kept.all():
        return surface, report
    log.info(
        "dropped %d components, %.3g mm^3 (%.2g of the volume)", len(disconnected), gone, share
    )
    return used_only(surface.vertices, surface.faces, kept[shell]), report


def without_crumbs(surface: SurfaceMesh, least: float) -> tuple[SurfaceMesh, int]:
    """A closed surface without solids and voids of less than a volume, mm^3.

    Returns ``surface``; ``count``: solids that are left.
    """
    at_vertex = vertex_shells(surface.faces, len(surface.vertices))
    shell = at_vertex[surface.faces[:, 0]]
    volume = shell_volumes(surface.vertices, surface.faces, at_vertex, int(shell.max()) + 1)
    kept = np.abs(volume) >= least
    left = used_only(surface.vertices, surface.faces, kept[shell])
    return left, int(np.count_nonzero(kept & (volume > 0)))


def largest_components(
    mesh: TetMesh, *, keep: int = 1, max_share: float = _MAX_SHARE
) -> tuple[TetMesh, int, float]:
    """Keep the largest face-connected pieces of a tetrahedral mesh.

    Raises LatticeError if the mesh is empty, or more than ``max_share`` would be dropped.

    ``keep``: number of pieces to keep, by volume; the number of bodies of the part. ``max_share``:
    largest share of the volume that may be dropped. Returns ``mesh``: without the points that
    nothing uses; ``dropped``: number of pieces removed; ``share``: their share of the volume.
    """
    if mesh.tets.shape[1] == 0:
        raise LatticeError("the mesh holds no tetrahedra; use a finer grid")
    label = np.asarray(piece_labels(mesh))
    volume = np.bincount(label, weights=signed_volumes(mesh))
    main = np.argsort(-volume, kind="stable")[:keep]
    dropped = max(int(np.count_nonzero(np.bincount(label))) - keep, 0)
    if not dropped:
        return mesh, 0, 0.0
    share = 1.0 - float(volume[main].sum() / volume.sum())
    refuse_large(dropped, share, max_share)
    log.info("dropped %d disconnected components of tets, %.2g of the volume", dropped, share)
    tets = mesh.tets[:, np.isin(label, main)]
    used, packed = np.unique(tets, return_inverse=True)
    kept = TetMesh(points=mesh.points[:, used], tets=packed.reshape(tets.shape))
    return kept, dropped, share


def refuse_large(dropped: int, share: float, max_share: float = _MAX_SHARE) -> None:
    """Refuse disconnected components that hold more than a share of the volume.

    Raises `LatticeError`.
    """
    if share > max_share:
        raise LatticeError(
            f"the lattice falls apart: {dropped} disconnected components hold "
            f"{100 * share:.3g} % of its volume, at most {100 * max_share:.3g} % may be dropped; "
            f"raise the lower density, enlarge the cells or use a finer grid, or add a skin"
        )


def _void_owners(
    surface: SurfaceMesh, shell: IntArray, voids: IntArray, disconnected: IntArray, main: int
) -> IntArray:
    """The smallest disconnected solid around each void, else the main solid."""
    owner = np.full(len(voids), main)
    if not disconnected.size or not voids.size:
        return owner
    order = np.argsort(shell, kind="stable")
    edge = np.searchsorted(shell[order], np.arange(shell.max() + 2))
    corners = surface.vertices[surface.faces]

    def triangles(n: int) -> FloatArray:
        return corners[order[edge[n] : edge[n + 1]]]

    solid = {int(n): triangles(int(n)) for n in disconnected}
    box = {n: (t.min(axis=(0, 1)), t.max(axis=(0, 1))) for n, t in solid.items()}
    for v, void in enumerate(voids):
        point = triangles(int(void))[0, 0]
        place = point[:, None]
        for n in disconnected:  # from large to small: the last hit is the innermost
            low, high = box[int(n)]
            within = (low < point).all() and (point < high).all()
            if within and winding_numbers(solid[int(n)], place)[0] > 0.5:
                owner[v] = n
    return owner

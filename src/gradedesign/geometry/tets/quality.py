"""Checks of a tetrahedral mesh before it is analysed: volume, orientation, overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import IntArray
from gradedesign.errors import MeshError
from gradedesign.geometry.tets._quality_kernels import label_pieces
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes


@dataclass(frozen=True, slots=True, kw_only=True)
class TetReport:
    """Quality of a tetrahedral mesh."""

    count: int  #: Tetrahedra.
    volume: float  #: Sum of signed volumes, mm^3.
    inverted: int  #: Tetrahedra without positive volume.
    crowded: int  #: Facets with more than two tetrahedra: the mesh overlaps itself.


def tet_report(mesh: TetMesh) -> TetReport:
    """Measure a mesh.

    Raises MeshError if it has no tetrahedra.
    """
    if mesh.tets.shape[1] == 0:
        raise MeshError("the mesh has no tetrahedra; refine it, or check that its field is inside")
    volumes = signed_volumes(mesh)
    _, _, crowded = label_pieces(mesh.tets, mesh.points.shape[1])
    return TetReport(
        count=mesh.tets.shape[1],
        volume=float(volumes.sum()),
        inverted=int(np.count_nonzero(~(volumes > 0.0))),
        crowded=int(crowded),
    )


def piece_labels(mesh: TetMesh) -> IntArray:
    """Number the pieces that hang together through facets; those that touch elsewhere are two.

    Returns (m,) int array: 0, 1, ... in the order of the first tetrahedron of each piece.
    """
    labels, _, _ = label_pieces(mesh.tets, mesh.points.shape[1])
    return labels


def without_unused_points(mesh: TetMesh) -> TetMesh:
    """Return the mesh without the points that no tetrahedron uses, in unchanged order."""
    used = np.zeros(mesh.points.shape[1], dtype=bool)
    used[mesh.tets] = True
    if used.all():
        return mesh
    number = np.cumsum(used) - 1
    return TetMesh(points=mesh.points[:, used], tets=number[mesh.tets])


def require_sound(
    mesh: TetMesh,
    *,
    subject: str,
    expected_volume: float | None = None,
    volume_tolerance: float = 0.01,
) -> TetReport:
    """Refuse a mesh that would give wrong results.

    Raises MeshError if there are no tetrahedra, some are inverted or overlap, or the volume is
    another; the message names all numbers that are wrong and the remedy of each.

    ``subject``: names the mesh in the message: ``the explicit lattice at 0.5 mm``.
    ``expected_volume``: mm^3. ``volume_tolerance``: largest relative difference from it.
    """
    report = tet_report(mesh)
    faults = []
    if report.inverted:
        faults.append(
            f"{report.inverted} of {report.count} tetrahedra have no positive volume; mesh again "
            "with a finer size"
        )
    if report.crowded:
        faults.append(
            f"{report.crowded} facets have more than two tetrahedra, so the mesh overlaps itself; "
            "repair the surface it comes from"
        )
    if expected_volume is not None:
        error = abs(report.volume - expected_volume) / expected_volume
        if not error <= volume_tolerance:
            faults.append(
                f"its volume is {report.volume:.6g} mm^3, expected {expected_volume:.6g} mm^3 "
                f"within {volume_tolerance:.3g} (off by {error:.3g}); mesh finer, so that the "
                "thinnest wall is resolved"
            )
    if faults:
        raise MeshError(f"{subject} is refused: " + "; and ".join(faults))
    return report

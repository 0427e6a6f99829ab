"""Smooth faces of a triangle surface: planes, cylinders and other patches without a sharp edge.

A triangle file knows no faces; selections such as "the 8 mm holes" need them. Regions are
parted at sharp edges, then taken apart into planes and cylinders where these meet tangentially.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, lock, locked
from gradedesign.geometry.part._clusters import Clusters, facet_patch, find_clusters
from gradedesign.geometry.part._curved_faces import Piece, split_region
from gradedesign.geometry.part._edges import split_by
from gradedesign.geometry.part._face_fits import Cylinder, covered_angle
from gradedesign.geometry.part._facet_sheet import facet_sheet, large_flat
from gradedesign.geometry.part._walls import find_walls
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

log = logging.getLogger(__name__)

#: Edges that turn by more, degrees, part two faces; facets of a hole must turn by no more, so a
#: hole of 12 facets is the coarsest that is known as a cylinder.
_SHARP_DEG = 30.0
#: Mean normals shorter than this point nowhere, as on a full cylinder. Chosen, not measured.
_NOWHERE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmoothFace:
    """One face of the part as an engineer sees it."""

    kind: str  #: "plane", "cylinder", "cone" or "other".
    area: float  #: mm^2.
    centroid: FloatArray  #: ``(3,)``, mm. Of the triangles; for a hole it lies on its axis.
    #: ``(3,)``. Area-averaged outward unit normal; None where it averages out.
    normal: FloatArray | None = None
    #: ``(3,)``. Of a cylinder or cone: unit vector with its largest component positive.
    axis: FloatArray | None = None
    #: ``(3,)``, mm. On the axis of a cylinder or cone, halfway along it.
    point: FloatArray | None = None
    diameter: float | None = None  #: mm. Of a cylinder.
    #: Of a cylinder or cone: True for a hole, False for a boss or a rounded edge.
    concave: bool | None = None
    half_angle: float | None = None  #: degrees. Of a cone: between its axis and its side.
    wide_diameter: float | None = None  #: mm. Of a cone: where it is widest.
    #: degrees. Of a cylinder or cone: how far it goes around its axis, 360 all around.
    span: float | None = None

    def __post_init__(self) -> None:
        for name in ("centroid", "normal", "axis", "point"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, locked(value, (3,), name=name))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmoothFaces:
    """The faces of a surface."""

    label: IntArray  #: ``(m,)``. Face of every triangle.
    faces: tuple[SmoothFace, ...]  #: In the order of their first triangles.

    def __post_init__(self) -> None:
        lock(self, dtype=np.int64, label=(None,))


def segment_faces(surface: SurfaceMesh) -> SmoothFaces:
    """Part a closed surface into smooth faces.

    ``surface``: closed and outward.
    """
    clusters = find_clusters(surface, _SHARP_DEG)
    groups = split_by(clusters.region, np.arange(len(clusters.region)))
    pieces = [piece for group in groups for piece in split_region(clusters, group.tolist())]
    owner = np.zeros(len(clusters.facets), dtype=np.int64)
    for number, (_, members, _) in enumerate(pieces):
        owner[members] = number
    label, kinds, fits = _with_walls(clusters, owner[clusters.label], pieces)
    log.info(
        "%d smooth faces: %d planes, %d cylinders, %d others",
        len(kinds),
        kinds.count("plane"),
        kinds.count("cylinder"),
        kinds.count("other"),
    )
    facets = split_by(label, np.arange(len(label)))
    return SmoothFaces(
        label=label,
        faces=tuple(
            _face(clusters, own, kind, fit)
            for own, kind, fit in zip(facets, kinds, fits, strict=True)
        ),
    )


def _with_walls(
    clusters: Clusters, label: IntArray, pieces: list[Piece]
) -> tuple[IntArray, list[str], list[Cylinder | None]]:
    """Faces in the order of their first facets, with the walls that slivers cut, and cones."""
    kinds, fits = [piece[0] for piece in pieces], [piece[2] for piece in pieces]
    flat = large_flat(clusters, label, kinds)
    cylindrical = np.array([kind == "cylinder" for kind in kinds])[label]
    if not (flat | cylindrical).all():
        sheet = facet_sheet(clusters, flat)
        for kind, wall in find_walls(sheet, cylindrical):
            label[wall.facets] = len(kinds)
            kinds.append(kind)
            fits.append(wall.cylinder)
    used, first, label = np.unique(label, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    return (
        rank[label.ravel()].astype(np.int64),
        [kinds[k] for k in used[order]],
        [fits[k] for k in used[order]],
    )


def mean_normal(vector: FloatArray, area: float) -> FloatArray | None:
    """Direction of the sum of area vectors ``(3,)`` of an area; None where they cancel."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > _NOWHERE * area else None


def _face(clusters: Clusters, facets: IntArray, kind: str, fit: Cylinder | None) -> SmoothFace:
    """Measure one face."""
    patch = facet_patch(clusters, facets)
    area = float(patch.areas.sum())
    face = SmoothFace(
        kind=kind,
        area=area,
        centroid=patch.areas @ patch.centres / area,
        normal=mean_normal(patch.areas @ patch.normals, area),
    )
    if fit is None:
        return face
    corners = clusters.surface.vertices[clusters.surface.faces[facets]]
    reach = float(((corners - fit.point) @ fit.axis).max())
    cone = kind == "cone"
    return replace(
        face,
        axis=fit.axis * np.sign(fit.axis[np.argmax(np.abs(fit.axis))]),
        point=fit.point,
        diameter=None if cone else 2.0 * fit.radius,
        concave=fit.concave,
        half_angle=float(np.degrees(np.arctan(fit.rise))) if cone else None,
        wide_diameter=2.0 * (fit.radius + fit.rise * reach) if cone else None,
        span=covered_angle(corners, fit.axis, fit.point),
    )

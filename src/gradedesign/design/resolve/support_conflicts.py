"""Supports that contradict each other, and motions they leave free, before any mesh."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.part.bodies import body_of_triangles
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec
from gradedesign.mechanics.fe.supports import disagrees
from gradedesign.mechanics.solver.rigid_modes import free_modes

#: Regions closer than this share of the part's diagonal touch: the rounding of cut corners.
TOUCHING = 1e-9


def require_agreeing(load_cases: Sequence[LoadCaseSpec], part: Part, where: Where) -> None:
    """Refuse load cases of which two supports contradict each other on a common point.

    Regions that share an edge, a corner or an area have nodes of every mesh in common, which
    cannot be displaced by two values.

    Raises CaseError, naming both supports by file, line, region and value, and a common point.
    """
    tolerance = TOUCHING * part.diagonal
    for number, spec in enumerate(load_cases):
        for first, second in combinations(range(len(spec.fix)), 2):
            one, other = spec.fix[first], spec.fix[second]
            differing = _differing(one, other)
            if not differing:
                continue
            at = common_point(part.regions[one.region], part.regions[other.region], tolerance)
            if at is None:
                continue
            axis, key = "xyz"[differing[0]], f"load_case[{number}].fix"
            wanted = [fix.displacement[differing[0]] for fix in (one, other)]
            raise CaseError(
                f"{where(f'{key}[{second}]')}: load case '{spec.name}': the support of "
                f"region '{other.region}' prescribes the {axis} displacement {wanted[1]:g} mm, "
                f"that of region '{one.region}' ({where(f'{key}[{first}]')}) {wanted[0]:g} "
                f"mm, and the two regions meet, as at ({', '.join(f'{c:.4g}' for c in at)}) mm; "
                f'leave {axis} free in one of them, as displacement with "free" does, or choose '
                f"regions that do not touch"
            )


def _differing(one: FixSpec, other: FixSpec) -> list[int]:
    """Components that two supports prescribe differently."""
    pairs = enumerate(zip(one.displacement, other.displacement, strict=True))
    return [c for c, (a, b) in pairs if a is not None and b is not None and disagrees(a, b)]


def common_point(one: Region, other: Region, tolerance: float) -> FloatArray | None:
    """A point at which two regions of a surface touch or overlap, ``(3,)`` mm; None if they do not.

    Pieces of different triangles touch only along these triangles' common edge or at a common
    corner, so that a corner of one of the two lies on the other; cut pieces of one triangle may
    also cross without.
    """
    for a, b in ((one, other), (other, one)):
        corners = np.unique(b.corners.reshape(-1, 3), axis=0)
        away = region_distance(a.corners)(corners.T)
        if away.min() <= tolerance:
            return np.asarray(corners[int(np.argmin(away))])
    for triangle in np.intersect1d(one.triangles, other.triangles):
        for piece in one.corners[one.triangles == triangle]:
            for against in other.corners[other.triangles == triangle]:
                if _overlap(piece, against):
                    return np.asarray(0.5 * (piece.mean(axis=0) + against.mean(axis=0)))
    return None


def _overlap(one: FloatArray, other: FloatArray) -> bool:
    """Whether two triangles ``(3, 3)`` of one plane overlap: no edge of either separates them."""
    normal = np.cross(one[1] - one[0], one[2] - one[0])
    for corners in (one, other):
        across = np.cross(normal, np.roll(corners, -1, axis=0) - corners)
        a, b = across @ one.T, across @ other.T
        if ((a.max(axis=1) < b.min(axis=1)) | (b.max(axis=1) < a.min(axis=1))).any():
            return False
    return True


def require_supported(load_cases: Sequence[LoadCaseSpec], part: Part, where: Where) -> None:
    """Refuse load cases whose supports leave a body of the part free to move.

    The same check is made again with the pieces of the mesh; this one needs no mesh.

    Raises CaseError, naming file, line, load case and motions.
    """
    body = body_of_triangles(part.surface)
    count = int(body.max()) + 1
    for number, spec in enumerate(load_cases):
        for k in range(count):
            modes = _modes(spec, part, body == k)
            if modes:
                which = "" if count == 1 else f" of body {k + 1}, {_place(part, body == k)}"
                raise CaseError(
                    f"{where(f'load_case[{number}].fix')}: load case '{spec.name}': the "
                    f"supports leave rigid motions free{which}: {'; '.join(modes)}. Fix more faces "
                    f"or components"
                )


def require_apart(spec: PartSpec, part: Part, where: Where) -> None:
    """Refuse bodies that touch and are not joined: no grid or mesh keeps them apart.

    Raises CaseError, naming file, line and the area of the faces in common.
    """
    area = part.report.common_area
    if spec.bodies == "all" and area > 0.0:
        raise CaseError(
            f'{where("part.bodies")}: found "all", but solids of the part touch along '
            f"{area:.5g} mm^2 with nothing between, where every analysis would join them; "
            'bodies = "join" says that they are one, or leave a gap of at least an element'
        )


def _place(part: Part, own: BoolArray) -> str:
    """Volume and box of the body that has these triangles."""
    surface = SurfaceMesh(vertices=part.surface.vertices, faces=part.surface.faces[own])
    corners = corner_points(surface).reshape(-1, 3)
    low, high = (", ".join(f"{x:.4g}" for x in p) for p in (corners.min(axis=0), corners.max(0)))
    return f"{enclosed_volume(surface):.4g} mm^3 from ({low}) to ({high}) mm"


def _modes(spec: LoadCaseSpec, part: Part, own: np.ndarray) -> tuple[str, ...]:
    """Free motions of the body that has these triangles."""
    points: list[FloatArray] = []
    fixed: list[np.ndarray] = []
    for fix in spec.fix:
        region = part.regions[fix.region]
        corners = region.corners[own[region.triangles]].reshape(-1, 3).T
        points.append(corners)
        component = np.array([value is not None for value in fix.displacement])
        fixed.append(np.repeat(component[:, None], corners.shape[1], axis=1))
    return free_modes(np.concatenate(points, axis=1), np.concatenate(fixed, axis=1))

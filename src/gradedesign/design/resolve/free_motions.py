"""Rigid motions that supports leave free, from the surface of the part alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.part.bodies import body_of_triangles
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.solver.rigid_modes import free_modes


def require_supported(load_cases: Sequence[LoadCaseSpec], part: Part, where: Where) -> None:
    """Refuse load cases whose supports leave a body of the part free to move.

    The same check is made again with the pieces of the mesh; this one needs no mesh.

    Raises
    ------
    CaseError
        Naming file, line, load case and motions.
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

    Raises
    ------
    CaseError
        Naming file, line and the area of the faces in common.
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

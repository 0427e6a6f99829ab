"""Rigid motions that supports leave free, from the surface of the part alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.case.schema import Case, LoadCaseSpec
from gradedesign.errors import CaseError
from gradedesign.fe.rigid_modes import free_modes
from gradedesign.mesh.surface_mesh import corner_points
from gradedesign.part.part import Part


def require_supported(case: Case, part: Part) -> None:
    """Refuse load cases whose supports leave a body of the part free to move.

    The same check is made again with the pieces of the mesh; this one needs no mesh.

    Raises
    ------
    CaseError
        Naming file, line, load case and motions.
    """
    bodies, body = _bodies(part)
    if len(bodies) == 1:
        body = np.full(len(body), bodies[0])
    elif len(bodies) < body.max() + 1:
        return  # which cavity belongs to which body, the mesh tells
    for number, spec in enumerate(case.load_case):
        for k in bodies:
            modes = _modes(spec, part, body == k)
            if modes:
                which = "" if len(bodies) == 1 else f" of body {bodies.index(k) + 1}"
                raise CaseError(
                    f"{case.where(f'load_case[{number}].fix')}: load case '{spec.name}': the "
                    f"supports leave rigid motions free{which}: {'; '.join(modes)}. Fix more faces "
                    f"or components"
                )


def _bodies(part: Part) -> tuple[list[int], IntArray]:
    """Numbers of the solid bodies, and the shell of every triangle ``(m,)``; cavities move with."""
    faces = part.surface.faces
    n = len(part.surface.vertices)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    shell = connected_components(graph, directed=False)[1][faces[:, 0]].astype(np.int64)
    a, b, c = np.moveaxis(corner_points(part.surface) - part.surface.vertices.mean(axis=0), 1, 0)
    volume = np.bincount(shell, weights=np.einsum("ij,ij->i", a, np.cross(b, c)))
    return [int(k) for k in np.flatnonzero(volume > 0)], shell


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

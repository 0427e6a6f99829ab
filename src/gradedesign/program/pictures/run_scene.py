"""Scene of a finished run: density, the printed body, stress and displacement on the case's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray, plain_vector
from gradedesign.common.system.progress import report_step
from gradedesign.design.resolve.shown_case import CaseShown
from gradedesign.errors import MeshError
from gradedesign.geometry.tets.point_location import locate
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.geometry.triangles._surface_mesh_kernels import corners_of_box
from gradedesign.geometry.triangles.boolean import fewer_triangles
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_triangles
from gradedesign.mechanics.explicit.analysis import SurfaceFields
from gradedesign.program.pictures.case_scene import case_scene
from gradedesign.program.pictures.packed import packed, packed_mesh, quantised
from gradedesign.program.pictures.pictures import SHOWN_SHIFT, round_factor
from gradedesign.program.pictures.scene import Layer, sharp_edges, thinned
from gradedesign.program.pictures.volume import scalar_data, volume_of

#: Triangles of a body in a page, which software draws in two seconds, and of one that carries
#: fields of every load case: with four of them a report stays below 10 MB. Chosen, not measured.
_MOST, _MOST_WITH_FIELDS = 250_000, 150_000
#: Vertices of a surface at which the distance to the one that is drawn is measured. Chosen, not
#: measured.
_MEASURED = 100_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunShown:
    """A finished run as it is shown."""

    case: CaseShown  #: With the cells and solid members of the design.
    #: (TetMesh, (m,) array) or None. The part's tetrahedra and their relative densities, 1 where
    #: they are solid.
    density: tuple[TetMesh, FloatArray] | None = None
    printed: SurfaceMesh | None = None  #: As exported.
    #: Fields of the explicit analysis by load case, all on one surface, the governing one first.
    analysed: Mapping[str, SurfaceFields]
    limit: float | None = None  #: MPa. Allowed stress.


def run_scene(run: RunShown, title: str) -> dict[str, Any]:
    """Data of the scene of a run, as ``page/scene.js`` reads them."""
    volume = None if run.case.domain is None else volume_of(run.case.domain)
    data = case_scene(run.case, title, volume)
    views: list[dict[str, Any]] = []
    if run.printed is not None:
        report_step("triangles of the scene")
        surface, words = _drawn_surface(run.printed, _MOST)
        data["printed"] = packed_mesh(surface)
        view = {"id": "printed", "title": "Printed body", "body": "printed", "note": words}
        views.append(view)
    if run.analysed:
        more, words = _analysed_data(run.analysed)
        data |= {"analysed": more, "limit": run.limit}
        views += [{**view, "note": words} for view in _FIELD_VIEWS]
    if run.density is not None and volume is not None:
        mesh, density = run.density
        at = density[locate(mesh, volume.points)[0]]
        low, high = float(density.min()), float(density.max())
        data["volumes"]["density"] = {**scalar_data(volume, at, low, high), "colours": "viridis"}
        views.append(_DENSITY_VIEW)
    last, *others = data["views"]
    return {**data, "views": [*views, *others, last]}


def surface_scene(
    surface: SurfaceMesh, title: str, analysed: Mapping[str, SurfaceFields] | None = None
) -> dict[str, Any]:
    """Data of the scene of a surface alone, with fields by load case where there are any."""
    drawn, words = _drawn_surface(surface, _MOST)
    low, high = corners_of_box(surface.vertices)
    edges = sharp_edges(Layer(vertices=drawn.vertices, faces=drawn.faces))
    # One view, of a body without faces of its own, regions or loads.
    view = {"id": "printed", "title": "Surface", "body": "part", "note": words}
    data: dict[str, Any] = {
        "title": title,
        "box": [plain_vector(low), plain_vector(high)],
        "part": {**packed_mesh(drawn), "labels": packed(np.zeros(len(drawn.faces), np.int64), 32)},
        "edges": quantised(edges.reshape(-1, 3)),
        "faces": [], "regions": [], "cases": [], "volumes": {}, "views": [view],
    }  # fmt: skip
    if analysed:
        data["analysed"], words = _analysed_data(analysed)
        views = [{**each, "note": words} for each in _FIELD_VIEWS]
        data |= {"limit": None, "views": [*views, view]}
    return data


_FIELD_VIEWS = (
    {
        "id": "stress", "title": "Stress", "body": "analysed", "field": "stress",
        "colours": "turbo", "unitTitle": "von Mises stress", "unit": "MPa",
    },
    {
        "id": "moved", "title": "Displacement", "body": "analysed", "field": "displacement",
        "colours": "plasma", "unitTitle": "displacement", "unit": "mm",
    },
)  # fmt: skip
_DENSITY_VIEW = {
    "id": "density", "title": "Density", "body": "part", "volume": "density",
    "unitTitle": "relative density",
}  # fmt: skip


def _analysed_data(fields: Mapping[str, SurfaceFields]) -> tuple[dict[str, Any], str]:
    """The analysed surface with the fields of every load case, and how it is drawn, in words."""
    first = next(iter(fields.values())).surface
    surface, words = _drawn_surface(first, _MOST_WITH_FIELDS)
    # What is drawn stands on vertices of the whole: each of these belongs to its nearest one.
    _, nearest = cKDTree(surface.vertices).query(first.vertices)
    _, own = cKDTree(first.vertices).query(surface.vertices)
    diagonal = float(np.linalg.norm(np.ptp(first.vertices, axis=0)))
    cases = []
    for name, field in fields.items():
        stress = np.zeros(len(surface.vertices))
        np.maximum.at(stress, nearest, field.von_mises)  # peaks must not vanish
        largest = float(np.linalg.norm(field.displacement, axis=0).max())
        cases.append(
            {
                "name": name,
                "von_mises": quantised(stress),
                "displacement": quantised(field.displacement.T[own]),
                "most": float(field.von_mises.max()),
                "largest": largest,
                "factor": round_factor(SHOWN_SHIFT * diagonal, largest),
            }
        )
    return {**packed_mesh(surface), "cases": cases}, words


def _drawn_surface(surface: SurfaceMesh, most: int) -> tuple[SurfaceMesh, str]:
    """A surface of few enough triangles for a page, and how near it is to the whole, in words."""
    count = len(surface.faces)
    if count <= most:
        return surface, f"drawn whole, {count} triangles"
    try:
        fewer = fewer_triangles(surface, most, subject="the scene")
    except MeshError:  # not manifold: its vertices are gathered instead, and measured as well
        layer = thinned(Layer(vertices=surface.vertices, faces=surface.faces), most)
        fewer = SurfaceMesh(vertices=layer.vertices, faces=layer.faces)
    sample = surface.vertices[:: len(surface.vertices) // _MEASURED + 1]
    away = closest_triangles(build_triangle_tree(corner_points(fewer)), sample.T)[0]
    words = f"drawn with {len(fewer.faces)} of {count} triangles, within {away.max():.2g} mm"
    return fewer, words

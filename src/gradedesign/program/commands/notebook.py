"""Records in a notebook: the page of `gradedesign preview` in a frame, or a still."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from functools import cache
from html import escape

import numpy as np

from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.shown_case import CaseShown, shown_case
from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import evaluate_shape
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.geometry.triangles.boolean import intersection
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.analysis import SurfaceFields
from gradedesign.program.commands.preview import Preview, RunPreview, problem_at
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs.scene_file import stored_scene, stored_still
from gradedesign.program.pictures.pictures import surface_still
from gradedesign.program.pictures.run_scene import surface_scene

#: Characters of a page that a notebook keeps; of a larger one it shows the still. Chosen, not
#: measured.
_MOST = 6_000_000
#: Pixels of a frame.
_HEIGHT = 560
#: Density of the cells that are drawn, where they exist at it, and grid steps along a cell. Chosen,
#: not measured.
_DENSITY, _STEPS = 0.3, 24


def notebook_html(record: object) -> str | None:
    """A record as a notebook shows it; None where it shows the text.

    A mistake in a case, a cell that cannot be drawn: the message stands there.
    """
    try:
        preview = _preview(record)
        if preview is None:
            return None
        page = preview.page()
        if len(page) <= _MOST:
            # Of no origin: the page's scripts reach nothing of the notebook.
            return (
                f'<iframe sandbox="allow-scripts" style="width:100%;height:{_HEIGHT}px;border:0" '
                f'title="{escape(preview.words)}" srcdoc="{escape(page)}"></iframe>'
            )
        return _still_html(preview.still, preview.words)
    except GradeDesignError as error:
        return f"<p>{escape(str(error))}</p>"


def _preview(record: object) -> Preview | RunPreview | None:
    if isinstance(record, Case):
        shown = shown_case(record, _installed())
        mistake = None if shown.mistake is None else problem_at(record.path, shown.mistake)
        return Preview(shown=shown, title=record.name, problem=mistake, read=())
    if isinstance(record, Part):
        return Preview(shown=CaseShown(part=record), title=record.source, problem=None, read=())
    if isinstance(record, RunResult):
        return _of_run(record)
    if isinstance(record, CellFamily | Cell):
        return _of_cell(record if isinstance(record, Cell) else calibrate(record))
    if isinstance(record, SurfaceFields):
        return _of_surface(record.surface, "Analysed surface", {"": record})
    if isinstance(record, TetMesh):
        facets, _ = boundary_facets(record)
        return _of_surface(SurfaceMesh(vertices=record.points.T, faces=facets), "Tetrahedra")
    return _of_surface(record, "Surface") if isinstance(record, SurfaceMesh) else None


@cache
def _installed() -> Registry:
    return build_registry()


def _of_run(result: RunResult) -> RunPreview | None:
    still = stored_still(result)
    try:
        scene = stored_scene(result.folder)
    except CaseError:  # failed, or of a stopped stage: its text says why
        return None
    return RunPreview(scene=scene, words=result.verdict, still=still, read=())


def _of_surface(
    surface: SurfaceMesh, title: str, fields: Mapping[str, SurfaceFields] | None = None
) -> RunPreview | None:
    if not len(surface.faces):
        return None
    edges = " x ".join(f"{edge:.4g}" for edge in np.ptp(surface.vertices, axis=0))
    words = f"{len(surface.faces)} triangles, {edges}"
    scene, still = surface_scene(surface, title, fields), surface_still(surface, title)
    return RunPreview(scene=scene, words=words, still=still, read=())


def _of_cell(cell: Cell) -> RunPreview | None:
    """Two cells along each axis, or all that a random one has, contoured as what is printed."""
    family = cell.family
    low, high = cell.window
    density = min(max(_DENSITY, low), high)
    level = float(cell.level_of(density))
    count = 2 if family.period == 1 else family.period
    step = count / (2 * _STEPS)
    raw = extract_surface(
        lambda points: evaluate_shape(family, cell.parameters, points) - level,
        (-2 * step,) * 3,
        (count + 2 * step,) * 3,
        step,
    )
    box = box_surface((float(count),) * 3)
    surface = intersection(raw, box, subject=f"the picture of cell '{cell.name}'")
    title = f"{cell.name}, relative density {density:.3g}"
    return _of_surface(surface, title)


def _still_html(still: bytes | None, words: str) -> str | None:
    if still is None:
        return None
    data = base64.b64encode(still).decode("ascii")
    return f'<p>{escape(words)}</p><img alt="{escape(words)}" src="data:image/png;base64,{data}">'

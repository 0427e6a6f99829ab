"""Scenes drawn by VTK, off screen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.program.pictures.scene import (
    LEGEND_ROW,
    SIZE,
    Arrow,
    ColourBar,
    Layer,
    LegendEntry,
    Lines,
    Scene,
    frame_of,
    legend_box,
    scene_box,
)

if TYPE_CHECKING:
    import pyvista

#: Letters of a line of the caption. Chosen, not measured.
_CAPTION = 92
#: Triangles that are drawn of one layer at most. Chosen, not measured.
MOST_TRIANGLES = 2_000_000


def draw_opengl(scene: Scene) -> bytes:
    """PNG of a scene."""
    import pyvista

    with _quiet_vtk():
        plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
        try:
            plotter.set_background("white")
            _add_all(plotter, scene)
            _set_camera(plotter, scene)
            picture = BytesIO()
            plotter.screenshot(picture)
        finally:
            plotter.close()
    return picture.getvalue()


@contextmanager
def _quiet_vtk() -> Iterator[None]:
    """Keep VTK's remark on a missing display off the terminal."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)


def _add_all(plotter: pyvista.Plotter, scene: Scene) -> None:
    for layer in scene.layers:
        _add_layer(plotter, layer, scene.bar)
    for lines in scene.lines:
        _add_lines(plotter, lines)
    for arrow in scene.arrows:
        _add_on_top(plotter, _arrow(arrow), arrow.colour)
    for label in scene.labels:
        plotter.add_point_labels(
            np.array([label.point]),
            [label.text],
            font_size=20,
            bold=True,
            text_color="white",
            shape_color=label.colour,
            shape_opacity=0.9,
            margin=5,
            show_points=False,
            always_visible=True,
        )
    plotter.add_text(scene.title, position=(20, SIZE[1] - 48), font_size=16, color="black")
    if scene.caption:
        text = "\n".join(wrap(scene.caption, _CAPTION))
        plotter.add_text(text, position=(190, 14), font_size=11, color="#333333")
    (left, _), (_, top) = legend_box(scene.legend)
    for row, entry in enumerate(scene.legend, 1):
        _add_legend_row(plotter, entry, left, top - LEGEND_ROW * row)
    plotter.add_axes(line_width=3, color="black", viewport=(0.0, 0.0, 0.15, 0.2))


def _add_on_top(plotter: pyvista.Plotter, mesh: Any, colour: str) -> None:
    """Add a mesh that no other hides: its depth is drawn as nearer than all."""
    actor = plotter.add_mesh(mesh, color=colour, smooth_shading=True, ambient=0.45)
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, -66_000.0)


def _add_legend_row(
    plotter: pyvista.Plotter, entry: LegendEntry, left: float, bottom: float
) -> None:
    """Add a coloured square and its meaning to the legend."""
    square = plotter.add_text(" ", position=(left, bottom), font_size=11)
    square.prop.background_color = entry.colour
    square.prop.background_opacity = 1.0
    square.prop.show_frame = False
    square.input = "    "
    plotter.add_text(entry.text, position=(left + 40, bottom), font_size=11, color="black")


def _polydata(vertices: FloatArray, faces: IntArray) -> pyvista.PolyData:
    import pyvista

    return pyvista.PolyData.from_regular_faces(vertices, faces)


def _add_layer(plotter: pyvista.Plotter, layer: Layer, bar: ColourBar | None) -> None:
    data = _polydata(layer.vertices, layer.faces)
    shading = {"smooth_shading": layer.smooth, "opacity": layer.opacity, "ambient": 0.35}
    if layer.values is None or bar is None:
        plotter.add_mesh(data, color=layer.colour, specular=0.2, **shading)
        return
    (data.cell_data if layer.per_face else data.point_data)["values"] = layer.values
    plotter.add_mesh(
        data,
        scalars="values",
        cmap=bar.colours,
        clim=(bar.low, bar.high),
        above_color=bar.above,
        show_scalar_bar=True,
        scalar_bar_args={
            "title": f"{bar.title}\n",  # a line between title and first label
            "vertical": True,
            "position_x": 0.86,
            "position_y": 0.2,
            "width": 0.09,
            "height": 0.6,
            "title_font_size": 18,
            "label_font_size": 20,
            "n_labels": 6,
            "fmt": "%.4g",
            "color": "black",
            # A blank keeps the swatch; the word would be drawn across it, and the caption has it.
            "above_label": " " if bar.above else None,
        },
        **shading,
    )


def _add_lines(plotter: pyvista.Plotter, lines: Lines) -> None:
    if len(lines.segments) and lines.radius > 0:
        import pyvista

        points = np.concatenate([lines.segments[:1, 0], lines.segments[:, 1]])
        bar = pyvista.lines_from_points(points).tube(radius=lines.radius)
        _add_on_top(plotter, bar, lines.colour)
    elif len(lines.segments):
        plotter.add_lines(
            lines.segments.reshape(-1, 3), color=lines.colour, width=lines.width, connected=False
        )


def _arrow(arrow: Arrow) -> pyvista.PolyData:
    import pyvista

    direction = arrow.tip - arrow.tail
    return pyvista.Arrow(
        start=arrow.tail,
        direction=direction,
        scale=float(np.linalg.norm(direction)),
        tip_length=0.3,
        tip_radius=0.1,
        shaft_radius=0.04,
    )


def _set_camera(plotter: pyvista.Plotter, scene: Scene) -> None:
    """Look along a fixed oblique direction, at what the frame says."""
    low, high = scene_box(scene)
    frame = frame_of(scene)
    reach = float(np.linalg.norm(high - low)) or 1.0
    plotter.camera.parallel_projection = True
    plotter.camera.focal_point = tuple(frame.middle)
    plotter.camera.position = tuple(frame.middle + 3 * reach * frame.back)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.camera.parallel_scale = 0.5 * frame.height
    plotter.renderer.ResetCameraClippingRange()

"""Scenes drawn without OpenGL: plain, slow, and on every machine."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.program.pictures.scene import ColourBar, Layer, Scene, scene_box

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Triangles that are drawn of one layer at most. Chosen, not measured.
MOST_TRIANGLES = 30_000

#: Letters of a line of the caption. Chosen, not measured.
_CAPTION = 130
_LIGHT = np.array([0.4, -0.7, 0.6])


def draw_plain(scene: Scene) -> bytes:
    """PNG of a scene."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

    figure = Figure(figsize=(12, 9), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    # Tight placement: a long part would otherwise fill a third of the picture.
    axes: Any = figure.add_axes((0.0, 0.05, 0.88 if scene.bar else 1.0, 0.9), projection="3d")
    # Triangles are sorted among each other, all in one; what nothing hides is drawn after them.
    axes.computed_zorder = False
    _add_layers(axes, scene.layers, scene.bar)
    # Strokes know no depth here: beside a coloured surface they stand behind it.
    under = 0 if scene.bar else 2
    for lines in (group for group in scene.lines if len(group.segments)):
        width, order = (4, 3) if lines.radius > 0 else (1, under)
        axes.add_collection3d(
            Line3DCollection(lines.segments, colors=lines.colour, linewidths=width, zorder=order)
        )
    for arrow in scene.arrows:
        step = arrow.tip - arrow.tail
        axes.quiver(*arrow.tail, *step, color=arrow.colour, linewidth=3, zorder=4)
    for label in scene.labels:
        box = {"facecolor": label.colour, "edgecolor": "none", "pad": 2}
        axes.text(*label.point, label.text, color="white", bbox=box, zorder=10)
    _frame(axes, scene)
    if scene.bar:
        _add_bar(figure, scene.bar)
    if scene.legend:
        handles = [Patch(color=entry.colour, label=entry.text) for entry in scene.legend]
        figure.legend(handles=handles, loc="upper right", fontsize=11, frameon=False)
    figure.text(0.02, 0.95, scene.title, fontsize=16)
    caption = "\n".join(wrap(scene.caption, _CAPTION))
    figure.text(0.02, 0.02, caption, fontsize=10, color="#333333")
    picture = BytesIO()
    figure.savefig(picture, format="png")
    return picture.getvalue()


def _frame(axes: Any, scene: Scene) -> None:
    low, high = scene_box(scene)
    span = np.maximum(high - low, 1e-3 * max(float((high - low).max()), 1e-9))
    axes.set(xlim=(low[0], low[0] + span[0]), ylim=(low[1], low[1] + span[1]))
    axes.set(zlim=(low[2], low[2] + span[2]), xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_box_aspect(span, zoom=1.1)
    axes.set_proj_type("ortho")
    axes.view_init(elev=27, azim=-53)


def _add_layers(axes: Any, layers: Sequence[Layer], bar: ColourBar | None) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    faces = [_faces(layer, bar) for layer in layers if len(layer.faces)]
    corners, colours = (np.concatenate(parts) for parts in zip(*faces, strict=True))
    axes.add_collection3d(
        Poly3DCollection(corners, facecolors=colours, edgecolors="none", zorder=1)
    )


def _faces(layer: Layer, bar: ColourBar | None) -> tuple[FloatArray, FloatArray]:
    """Corners ``(m, 3, 3)`` and colours ``(m, 4)`` of a layer's triangles."""
    from matplotlib.colors import to_rgb

    corners = layer.vertices[layer.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    toward = np.divide(normal @ _LIGHT, length, out=np.zeros_like(length), where=length > 0)
    shade = 0.55 + 0.45 * np.clip(toward / np.linalg.norm(_LIGHT), 0.0, 1.0)
    if layer.values is None or bar is None:
        colour = np.tile(to_rgb(layer.colour), (len(corners), 1))
    else:
        values = layer.values if layer.per_face else layer.values[layer.faces].mean(axis=1)
        colour = _colours(bar)(values)[:, :3]
    opaque = np.full((len(corners), 1), layer.opacity)
    return corners, np.concatenate([colour * shade[:, None], opaque], axis=1)


def _colours(bar: ColourBar) -> Any:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    colours = colormaps[bar.colours].with_extremes(over=bar.above)
    high = bar.high if bar.high > bar.low else bar.low + 1.0
    return ScalarMappable(norm=Normalize(bar.low, high), cmap=colours).to_rgba


def _add_bar(figure: Figure, bar: ColourBar) -> None:
    side: Axes = figure.add_axes((0.89, 0.2, 0.025, 0.6))
    mappable = _colours(bar).__self__
    figure.colorbar(mappable, cax=side, label=bar.title, extend="max" if bar.above else "neither")

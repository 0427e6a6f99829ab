"""Pictures of scenes: surfaces by a depth buffer of our own, strokes and words by matplotlib."""

from __future__ import annotations

from io import BytesIO
from textwrap import wrap
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, read_only
from gradedesign.program.pictures._depth_kernels import front_triangles, paint
from gradedesign.program.pictures.scene import (
    LEGEND_ROW,
    SIZE,
    Arrow,
    ColourBar,
    Frame,
    Layer,
    LegendEntry,
    Lines,
    Scene,
    frame_of,
    legend_box,
)

#: Samples along the side of a pixel, whose mean it is. Chosen, not measured.
_SAMPLES = 3
#: Samples along right and up.
_SHAPE = (_SAMPLES * SIZE[0], _SAMPLES * SIZE[1])
#: Pixels to the inch, of which sizes of letters in points follow.
_DPI = 100
#: Colours along a bar.
_STEPS = 256
#: Letters of a line of the caption. Chosen, not measured.
_CAPTION = 110
#: Samples by which a stroke on a surface counts as before it, and of a piece that is hidden or
#: not. Chosen, not measured.
_LIFTED, _PIECE = 24.0, 12.0
#: A sample and its neighbours.
_AROUND = np.array([(0, 0), (2, 0), (-2, 0), (0, 2), (0, -2)])
#: Place and length of the axes in the corner, pixels. Chosen, not measured.
_CORNER, _AXIS = np.array([80.0, 80.0]), 50.0


def draw(scene: Scene) -> bytes:
    """PNG of a scene."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    frame = frame_of(scene)
    picture, nearest = _painted(scene, frame)
    figure = Figure(figsize=(SIZE[0] / _DPI, SIZE[1] / _DPI), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    figure.figimage(picture, origin="lower", zorder=-1)
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(0, SIZE[0]), ylim=(0, SIZE[1]))
    for lines in scene.lines:
        _add_lines(axes, lines, frame, nearest)
    for arrow in scene.arrows:
        _add_arrow(axes, arrow, frame)
    for label in scene.labels:
        box = {"facecolor": label.colour, "alpha": 0.9, "edgecolor": "none", "pad": 6}
        x, y = _pixels(label.point, frame)
        words = {"color": "white", "fontsize": 12, "fontweight": "bold", "bbox": box, "zorder": 10}
        axes.text(x + 8, y + 9, label.text, **words)
    _add_corner(axes, frame)
    _add_legend(axes, scene.legend)
    axes.text(20, SIZE[1] - 38, scene.title, fontsize=17)
    caption = "\n".join(wrap(scene.caption, _CAPTION))
    axes.text(190, 14, caption, fontsize=11, color="#333333", va="bottom")
    if scene.bar:
        _add_bar(figure, scene.bar)
    written = BytesIO()
    figure.savefig(written, format="png")
    return written.getvalue()


def _painted(scene: Scene, frame: Frame) -> tuple[FloatArray, Any]:
    """Picture ``(h, w, 3)`` of the surfaces, 0 to 1, and the depth of the opaque ones by sample."""
    picture = np.full((*_SHAPE, 3), 255, dtype=np.uint8)
    nearest = np.full(_SHAPE, -np.inf, dtype=np.float32)
    # What one looks through is painted last.
    for layer in sorted(scene.layers, key=lambda layer: layer.opacity < 1.0):
        if len(layer.faces):
            _paint(picture, nearest, layer, scene.bar, frame)
    # Samples by place in their pixel: numpy's mean over two short axes takes three times as long.
    total = np.zeros((*SIZE, 3), dtype=np.uint16)
    for i, j in np.ndindex(_SAMPLES, _SAMPLES):
        total += picture[i::_SAMPLES, j::_SAMPLES]
    return total.transpose(1, 0, 2) / (255.0 * _SAMPLES**2), nearest


def _paint(picture: Any, nearest: Any, layer: Layer, bar: ColourBar | None, frame: Frame) -> None:
    places = read_only(_places(layer.vertices, frame))
    faces = read_only(np.ascontiguousarray(layer.faces, dtype=np.int64))
    values, per_face, bounds = np.zeros(len(faces)), True, (0.0, 1.0)
    if layer.values is not None and bar is not None:
        values, per_face = np.ascontiguousarray(layer.values, dtype=np.float64), layer.per_face
        bounds = (float(bar.low), float(bar.high if bar.high > bar.low else bar.low + 1.0))
        colours = _colours(bar)
    else:
        colours = _rgb(layer.colour, layer.colour)
    front = front_triangles(places, faces, _SHAPE)
    opacity = float(layer.opacity)
    paint(
        *(picture, nearest, front, places, faces),
        *(read_only(values), per_face, read_only(colours), bounds, opacity),
    )


def _places(points: FloatArray, frame: Frame) -> FloatArray:
    """Samples along right and up, and towards the viewer, of points ``(..., 3)`` in mm."""
    axes = np.stack([frame.right, frame.up, frame.back])
    middle = np.array([0.5 * (_SHAPE[0] - 1), 0.5 * (_SHAPE[1] - 1), 0.0])
    scale = _SHAPE[1] / frame.height
    return np.ascontiguousarray((np.asarray(points) - frame.middle) @ axes.T * scale + middle)


def _pixels(points: FloatArray, frame: Frame) -> FloatArray:
    """Pixels along right and up of points ``(..., 3)`` in mm."""
    return (_places(points, frame)[..., :2] + 0.5) / _SAMPLES


def _rgb(*colours: Any) -> FloatArray:
    from matplotlib.colors import to_rgb

    return 255.0 * np.array([to_rgb(colour) for colour in colours])


def _colours(bar: ColourBar) -> FloatArray:
    """Colours of a bar from below, and the one above it, as `paint` takes them."""
    from matplotlib import colormaps

    steps = colormaps[bar.colours](np.linspace(0.0, 1.0, _STEPS))
    return _rgb(*steps, bar.above or steps[-1])


def _add_lines(axes: Any, lines: Lines, frame: Frame, nearest: Any) -> None:
    """Strokes, hidden where a surface is before them; round bars are not."""
    from matplotlib.collections import LineCollection

    if not len(lines.segments):
        return
    if lines.radius > 0:
        width, shown = 2.0 * lines.radius * SIZE[1] / frame.height, _pixels(lines.segments, frame)
    else:
        width, shown = lines.width, _visible_pieces(_places(lines.segments, frame), nearest)
    style: dict[str, Any] = {
        "colors": lines.colour,
        "linewidths": width * 72 / _DPI,
        "capstyle": "round",
    }
    axes.add_collection(LineCollection(list(shown), zorder=4 if lines.radius > 0 else 3, **style))


def _visible_pieces(segments: FloatArray, nearest: Any) -> FloatArray:
    """Pieces ``(k, 2, 2)`` in pixels of segments ``(n, 2, 3)`` in samples that nothing hides."""
    length = np.linalg.norm(segments[:, 1, :2] - segments[:, 0, :2], axis=1)
    count = np.maximum(np.ceil(length / _PIECE), 1).astype(np.int64)
    which = np.repeat(np.arange(len(segments)), count)
    step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    start, along = segments[which, 0], (segments[:, 1] - segments[:, 0])[which]
    share = np.stack([step, step + 1], axis=1) / count[which, None]
    middle = start + share.mean(axis=1)[:, None] * along
    # Of neighbours too, since a sample between two triangles may belong to neither.
    at = np.rint(middle[:, :2]).astype(np.int64)[:, None] + _AROUND
    at = np.clip(at, 0, np.array(_SHAPE) - 1)
    seen = nearest[at[..., 0], at[..., 1]].max(axis=1) <= middle[:, 2] + _LIFTED
    ends = start[seen, None] + share[seen, :, None] * along[seen, None]
    return (ends[..., :2] + 0.5) / _SAMPLES


def _add_arrow(axes: Any, arrow: Arrow, frame: Frame) -> None:
    """An arrow that nothing hides, as thick as its length in space asks for."""
    from matplotlib.patches import FancyArrow

    size = float(np.linalg.norm(arrow.tip - arrow.tail)) * SIZE[1] / frame.height
    (x, y), tip = _pixels(arrow.tail, frame), _pixels(arrow.tip, frame)
    dx, dy = tip - (x, y)
    head = min(0.3 * size, max(float(np.hypot(dx, dy)), 1e-3))
    form: dict[str, Any] = {"width": 0.07 * size, "head_width": 0.2 * size, "head_length": head}
    style: dict[str, Any] = {
        "length_includes_head": True,
        "color": arrow.colour,
        "linewidth": 0,
        "zorder": 5,
    }
    axes.add_patch(FancyArrow(x, y, dx, dy, **form, **style))


def _add_corner(axes: Any, frame: Frame) -> None:
    """Directions of x, y and z."""
    for letter, step in zip("xyz", np.stack([frame.right, frame.up], axis=1), strict=True):
        tip = _CORNER + _AXIS * step
        arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.5, "shrinkA": 0}
        axes.annotate("", tip, _CORNER, arrowprops=arrow)
        axes.text(*(_CORNER + 1.3 * _AXIS * step), letter, fontsize=12, ha="center", va="center")


def _add_legend(axes: Any, entries: tuple[LegendEntry, ...]) -> None:
    from matplotlib.patches import Rectangle

    (left, _), (_, top) = legend_box(entries)
    for row, entry in enumerate(entries, 1):
        bottom = top - LEGEND_ROW * row
        axes.add_patch(Rectangle((left, bottom), 30, 20, color=entry.colour, linewidth=0))
        axes.text(left + 40, bottom + 3, entry.text, fontsize=11)


def _add_bar(figure: Any, bar: ColourBar) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    colours = colormaps[bar.colours].with_extremes(over=bar.above)
    high = bar.high if bar.high > bar.low else bar.low + 1.0
    side = figure.add_axes((0.88, 0.2, 0.022, 0.6))
    mapped = ScalarMappable(norm=Normalize(bar.low, high), cmap=colours)
    scale = figure.colorbar(mapped, cax=side, extend="max" if bar.above else "neither")
    scale.set_label(bar.title, fontsize=12)
    side.tick_params(labelsize=11)

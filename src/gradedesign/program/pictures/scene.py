"""Content of a picture, apart from how it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray, read_only
from gradedesign.geometry.triangles._surface_mesh_kernels import corners_of_box

#: From the part to the viewer, whichever way a scene is drawn, and pixels of a picture.
VIEW = np.array([1.0, -1.35, 0.85])
#: Pixels of a picture. Chosen, not measured.
SIZE = (1200, 900)
#: Pixels of a letter of the legend, of a row of it, and to it from the right and the upper edge.
#: Chosen, not measured.
_LEGEND_LETTER, LEGEND_ROW, _LEGEND_RIGHT, _LEGEND_TOP = 12, 30, 30, 14
#: Share of the width that a colour bar takes. Chosen, not measured.
_BAR_AREA = 0.14


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """One triangle surface."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    faces: IntArray  #: ``(m, 3)``.
    #: ``(n,) or (m,)``. Coloured by the scene's bar; per vertex or per face.
    values: FloatArray | None = None
    per_face: bool = False  #: Whether ``values`` belong to faces.
    #: Used without ``values``.
    colour: str = "#b8bec6"
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lines:
    """Straight strokes ``(k, 2, 3)``, mm, such as a hatch.

    With a ``radius`` in mm they are round bars that nothing hides, such as the arc of a moment.
    """

    segments: FloatArray
    colour: str
    width: float = 2.0
    radius: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arrow:
    """An arrow from ``tail`` to ``tip``, both ``(3,)`` mm, that nothing hides."""

    tail: FloatArray
    tip: FloatArray
    colour: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Label:
    """A text at a point ``(3,)`` mm, never hidden by the part."""

    point: FloatArray
    text: str
    colour: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LegendEntry:
    """Entry of a legend: a colour and its meaning."""

    text: str
    colour: str


def legend_box(entries: Sequence[LegendEntry]) -> IntArray:
    """Left and right, bottom and top of a legend, ``(2, 2)`` pixels; its rows run downwards."""
    letters = max((len(entry.text) for entry in entries), default=0)
    right, top = SIZE[0] - _LEGEND_RIGHT, SIZE[1] - _LEGEND_TOP
    left, bottom = right - 40 - _LEGEND_LETTER * letters, top - LEGEND_ROW * len(entries)
    return np.array([[left, right], [bottom, top]])


@dataclass(frozen=True, slots=True, kw_only=True)
class ColourBar:
    """Scale from values to colours; values above ``high`` are drawn in ``above`` if given."""

    title: str
    low: float
    high: float
    colours: str = "viridis"
    above: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A whole picture."""

    title: str
    caption: str = ""
    layers: tuple[Layer, ...] = ()
    lines: tuple[Lines, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    labels: tuple[Label, ...] = ()
    bar: ColourBar | None = None
    legend: tuple[LegendEntry, ...] = ()


def scene_box(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner ``(3,)`` of everything drawn, mm."""
    pieces = [layer.vertices for layer in scene.layers if len(layer.vertices)]
    pieces += [np.stack([a.tail, a.tip]) for a in scene.arrows]
    pieces += [bars.segments.reshape(-1, 3) for bars in scene.lines if bars.radius > 0]
    boxes = [corners_of_box(read_only(np.asarray(p, dtype=np.float64))) for p in pieces]
    return np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """View of a scene: its place in the picture."""

    right: FloatArray  #: ``(3,)``. Unit vectors of the picture, and towards the viewer.
    up: FloatArray  #: As `right`.
    back: FloatArray  #: As `right`.
    middle: FloatArray  #: ``(3,)``, mm. Shown at the picture's centre.
    height: float  #: mm. Of the whole picture.


def frame_of(scene: Scene) -> Frame:
    """Fit the scene's box between title, caption and bar."""
    low, high = scene_box(scene)
    back = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1)
    wide, tall = np.ptp(right @ corners), np.ptp(up @ corners)
    area = 1.0 - (_BAR_AREA if scene.bar else 0.0)
    height = max(tall / 0.76, wide / (0.9 * area * SIZE[0] / SIZE[1]))
    middle = 0.5 * (low + high) + right * (height * SIZE[0] / SIZE[1]) * 0.5 * (1 - area)
    return Frame(right=right, up=up, back=back, middle=middle, height=float(height))


def thinned(layer: Layer, most: int) -> Layer:
    """A layer of about ``most`` triangles or fewer, vertices clustered on a cubic grid.

    For pictures only: thin walls may close or open. The grid is sized so that a surface with
    this area would keep ``most`` triangles, and coarsened until it does.
    """
    if len(layer.faces) <= most:
        return layer
    corners = layer.vertices[layer.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    spacing = float(np.sqrt(np.linalg.norm(across, axis=1).sum() / most))
    while True:
        vertices, number = _clustered(layer.vertices, spacing)
        faces = number[layer.faces]
        kept = _unrepeated(faces)
        if np.count_nonzero(kept) <= most:
            break
        spacing *= 1.2
    values = layer.values
    if values is not None and layer.per_face:
        values = values[kept]
    elif values is not None:
        peaks = np.full(len(vertices), -np.inf)
        np.maximum.at(peaks, number, values)  # peaks must not vanish
        values = peaks
    return Layer(
        vertices=vertices,
        faces=faces[kept],
        values=values,
        per_face=layer.per_face,
        colour=layer.colour,
        opacity=layer.opacity,
    )


def _clustered(vertices: FloatArray, spacing: float) -> tuple[FloatArray, IntArray]:
    """Mean of the vertices in every used box, and the box number of every vertex."""
    box = np.floor((vertices - vertices.min(axis=0)) / spacing).astype(np.int64)
    size = box.max(axis=0) + 1
    key = (box[:, 0] * size[1] + box[:, 1]) * size[2] + box[:, 2]
    _, number, count = np.unique(key, return_inverse=True, return_counts=True)
    mean = np.stack([np.bincount(number, weights=vertices[:, n]) / count for n in range(3)], axis=1)
    return mean, number


def _unrepeated(faces: IntArray) -> BoolArray:
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def hatch(corners: FloatArray, spacing: float) -> FloatArray:
    """Parallel strokes ``(k, 2, 3)`` over triangles ``(m, 3, 3)``: cuts by tilted planes."""
    normal = np.array([1.0, 0.8, 1.3]) / np.linalg.norm([1.0, 0.8, 1.3])
    height = corners @ normal / spacing
    first = np.ceil(height.min(axis=1)).astype(np.int64)
    count = np.floor(height.max(axis=1)).astype(np.int64) - first + 1
    count = np.maximum(count, 0)
    which = np.repeat(np.arange(len(corners)), count)
    step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    level = first[which] + step
    # Sorted by height, a plane cuts the long edge 0-2 and one of the short edges.
    order = np.argsort(height, axis=1)
    high = np.take_along_axis(height, order, axis=1)[which]
    tri = np.take_along_axis(corners, order[:, :, None], axis=1)[which]
    upper = level > high[:, 1]
    start = _between(tri[:, 0], tri[:, 2], high[:, 0], high[:, 2], level)
    low_side = _between(tri[:, 0], tri[:, 1], high[:, 0], high[:, 1], level)
    high_side = _between(tri[:, 1], tri[:, 2], high[:, 1], high[:, 2], level)
    return np.stack([start, np.where(upper[:, None], high_side, low_side)], axis=1)


def _between(
    p: FloatArray, q: FloatArray, a: FloatArray, b: FloatArray, level: FloatArray
) -> FloatArray:
    rise = b - a
    share = np.divide(level - a, rise, out=np.zeros_like(rise), where=rise != 0)
    return p + np.clip(share, 0.0, 1.0)[:, None] * (q - p)


def sharp_edges(layer: Layer, angle_deg: float = 30.0) -> FloatArray:
    """Edges ``(k, 2, 3)`` mm where two triangles meet at more than an angle, or none meets."""
    corners = layer.vertices[layer.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    edges = np.sort(layer.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], np.repeat(np.arange(len(normal)), 3)[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    cosine = np.einsum("ij,ij->i", normal[owner[1:]], normal[owner[:-1]])
    bent = same & (cosine < np.cos(np.radians(angle_deg)))
    alone = ~np.append(same, False) & ~np.append(False, same)
    shown = alone | np.append(bent, False)
    return layer.vertices[edges[shown]]

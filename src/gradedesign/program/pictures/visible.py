"""The triangles of a layer that its picture shows: the others need not be drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradedesign.program.pictures._visible_kernels import front_triangles
from gradedesign.program.pictures.scene import SIZE, Frame, Layer

#: Layers of fewer triangles are drawn as they are. Chosen, not measured.
FEW = 100_000
#: Samples along the side of a pixel; odd, so that its centre is one.
SAMPLES = 3


def visible(layer: Layer, frame: Frame) -> Layer:
    """Triangles of a large opaque layer that are not hidden by others of the layer.

    A triangle stays where it is foremost at one of `SAMPLES` squared samples of a pixel, or all
    its corners are such a triangle's, so that narrow ones leave no cracks. The
    outermost vertices stay as well, so that the scene keeps its frame.
    """
    if len(layer.faces) <= FEW or layer.opacity < 1.0:
        return layer
    seen = front_triangles(
        layer.vertices,
        layer.faces,
        frame.right,
        frame.up,
        frame.back,
        frame.middle,
        frame.height / (SAMPLES * SIZE[1]),
        (SAMPLES * SIZE[0], SAMPLES * SIZE[1]),
    )
    corner = np.zeros(len(layer.vertices), dtype=bool)
    corner[layer.faces[seen]] = True
    seen = corner[layer.faces].all(axis=1)
    faces = layer.faces[seen]
    used = np.zeros(len(layer.vertices), dtype=bool)
    used[faces] = True
    used[layer.vertices.argmin(axis=0)] = True
    used[layer.vertices.argmax(axis=0)] = True
    number = np.cumsum(used) - 1
    values = layer.values
    if values is not None:
        values = values[seen if layer.per_face else used]
    return replace(layer, vertices=layer.vertices[used], faces=number[faces], values=values)

"""Contours of the layers of a print, between solid and empty pixels by the values beside them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gradedesign import in_threads
from gradedesign.fields import FloatArray, IntArray
from gradedesign_layers._contour_kernels import spread_values
from gradedesign_layers.contours import Tracer, enclosed_areas
from gradedesign_layers.layer_stack import Layers

#: Values are this far from 0 at least, so that every point is between two pixels, of a pixel.
_CLEAR = 1e-6


class LayerContours(NamedTuple):
    """Closed contours of one layer.

    Attributes
    ----------
    places : (k, 2) array, mm
        Points of the contours in turn.
    first : (n + 1,) int array
        Where each begins.
    areas : (n,) array, mm^2
        Enclosed by each, negative around holes.
    """

    places: FloatArray
    first: IntArray
    areas: FloatArray


def layer_contours(layers: Layers, number: int) -> LayerContours:
    """Contours of a layer, by number; threads may call it at once."""
    values, pixel = np.zeros(layers.shape), layers.pixel
    beside = layers.layers[number].beside
    spread_values(layers.solid(number), beside, _CLEAR * pixel, pixel, values)
    places, first = Tracer(layers.shape).polygons(values)
    places = layers.lower[:2] + pixel * places
    return LayerContours(places, first, enclosed_areas(places, first))


def contour_volume(layers: Layers) -> float:
    """Volume that the contours of all layers enclose, mm^3."""

    def area(number: int) -> float:
        return float(layer_contours(layers, number).areas.sum())

    return layers.height * sum(in_threads(area, range(len(layers.layers))))

"""A cell family with smooth joints from any graph of nodes and struts."""

from __future__ import annotations

from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from gradedesign import CellFamily, PluginError
from gradedesign.fields import Field, FloatArray, graph_segments, periodic_spline, segment_symmetry
from gradedesign_cells_convolution.line_convolution import line_convolution

SOURCE = "Gaussian line convolution (Tang et al., CAD'19, 69-74) of "

#: Default width of the kernel, cell units.
_SIGMA = 0.05

#: Steps of the table over sigma: it moves surfaces by up to 2e-4 sigma where struts are thinner
#: than 4 sigma, and by up to 0.02 sigma along the ridges of the voids.
STEPS = 4

#: Steps in a cell up to which the shape is tabulated. Narrower kernels have few struts in reach,
#: and their sums are as fast as a table.
MOST_STEPS = 120


def convolution_family(
    name: str, nodes: ArrayLike, edges: ArrayLike, *, sigma: float = _SIGMA, source: str = ""
) -> CellFamily:
    """Make a cell family of the convolution surfaces of a periodic graph.

    The shape is ``-sigma ln(F / F0)``, with F the field and ``F0 = sigma sqrt(2 pi)`` its value on
    the axis of an infinite strut alone: the surfaces of F itself, with values that neither crowd on
    the axes nor vanish in the voids. Level ``t`` is the iso-value ``F0 exp(-t / sigma)``; a strut
    alone has the radius ``sqrt(2 sigma t)``.

    Parameters
    ----------
    nodes : (n, 3) array_like, cell units
        Nodes a whole number of cells apart are copies of one node.
    edges : (m, 2) int array_like
        Struts; copies of one strut count once.
    sigma : float, cell units
        Default of the parameter ``sigma``. Larger ones move material from struts to joints; too
        large at a low density, struts part.
    source : str
        Where the graph comes from.

    Raises
    ------
    PluginError
        For a graph that is not one, see `gradedesign.fields.graph_segments`.

    Examples
    --------
    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> convolution_family("my-cubes", corner, [[0, 1], [0, 2], [0, 3]]).symmetry
    'cubic'
    """
    try:
        segments = graph_segments(nodes, edges)
    except PluginError as error:
        raise PluginError(f"cell '{name}': {error}") from error

    @lru_cache(maxsize=8)
    def of_width(width: float) -> Field:
        field = line_convolution(segments, width)
        alone = width * (2 * np.pi) ** 0.5

        def exact(u: FloatArray) -> FloatArray:
            return np.asarray(-width * np.log(field(u) / alone))

        steps = ceil(STEPS / width)
        if steps > MOST_STEPS:
            return exact
        axis = np.arange(steps) / steps
        return periodic_spline(exact(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))))

    def shape(u: FloatArray, *, sigma: float = sigma) -> FloatArray:
        return of_width(sigma)(u)

    return CellFamily(
        name=name,
        shape=shape,
        source=SOURCE + (source or "a graph"),
        parameters={"sigma": sigma},
        symmetry=segment_symmetry(segments),
    )

"""A cell family from any graph of nodes and struts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gradedesign import CaseError, CellFamily, PluginError, StrutAxes
from gradedesign.fields import (
    Field,
    FloatArray,
    graph_segments,
    periodic_distance_to_segments,
    periodic_filleted_segments,
    segment_symmetry,
)
from gradedesign_cells_strut.paths import PARAMETERS, bent_segments
from gradedesign_cells_strut.sections import SIDES, section_normals

Section = Literal["round", "square", "triangle"]
Path = Literal["straight", "wave", "helix"]


def strut_family(
    name: str,
    nodes: ArrayLike,
    edges: ArrayLike,
    *,
    section: Section = "round",
    path: Path = "straight",
    source: str = "",
) -> CellFamily:
    """Make a cell family of the struts of a periodic graph.

    The level is the radius of the struts in cell units: of the circle, or of the circle inscribed
    in a square or triangle, one side of which faces as `section_normals` says.

    Parameters
    ----------
    nodes : (n, 3) array_like, cell units
        Nodes a whole number of cells apart are copies of one node.
    edges : (m, 2) int array_like
        Struts; copies of one strut count once.
    section : {"round", "square", "triangle"}
    path : {"straight", "wave", "helix"}
        Bent struts are round.
    source : str
        Where the graph comes from.

    Returns
    -------
    CellFamily
        With the parameter ``node_ratio``: balls at the nodes have this many times the radius of
        the struts, at least 1 (the default: none protrude; the shape is a true distance then).
        Straight round struts have ``fillet``: radius of the fillets where they meet by that of the
        struts, 0 (the default) to 2. Bent struts have ``amplitude`` (cell units) and ``waves`` or
        ``turns`` (whole numbers).

    Raises
    ------
    PluginError
        For a graph that is not one, see `gradedesign.fields.graph_segments`, or an unknown
        section or path.

    Examples
    --------
    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> family = strut_family("my-cubes", corner, [[0, 1], [0, 2], [0, 3]])
    >>> float(family.shape(np.array([0.5, 0.25, 0.0]))), family.symmetry
    (0.25, 'cubic')
    """
    if section not in SIDES or path not in PARAMETERS or (section, path) not in _POSSIBLE:
        raise PluginError(
            f"cell '{name}': section '{section}' with path '{path}' is not there; possible are "
            + ", ".join(f"{s} {p}" for s, p in _POSSIBLE)
        )
    try:
        segments = graph_segments(nodes, edges)
    except PluginError as error:
        raise PluginError(f"cell '{name}': {error}") from error
    bending = PARAMETERS[path]
    fillets = {"fillet": 0.0} if (section, path) == ("round", "straight") else {}
    settings = tuple(bending.values()) or (0.0, 1.0)
    normals = section_normals(segments, section)
    return CellFamily(
        name=name,
        shape=_shape(segments, section, path),
        source=source,
        parameters={"node_ratio": 1.0, **fillets, **bending},
        distance=section == "round",
        struts=_axes(segments, path) if section == "round" else None,
        symmetry=segment_symmetry(bent_segments(segments, path, *settings), normals=normals),
    )


def section_families(
    name: str, nodes: ArrayLike, edges: ArrayLike, source: str
) -> Iterator[CellFamily]:
    """Families of one graph with round, square and triangular struts."""
    yield strut_family(name, nodes, edges, source=source)
    for section in ("square", "triangle"):
        yield strut_family(f"{name}-{section}", nodes, edges, section=section, source=source)


def path_families(
    name: str, nodes: ArrayLike, edges: ArrayLike, source: str
) -> Iterator[CellFamily]:
    """Families of one graph with wavy and helical struts."""
    for path in ("wave", "helix"):
        yield strut_family(f"{name}-{path}", nodes, edges, path=path, source=source)


_POSSIBLE = (*((section, "straight") for section in SIDES), ("round", "wave"), ("round", "helix"))


def with_balls(struts: Field, balls: Field, node_ratio: float) -> Field:
    """Struts and balls at their nodes.

    Parameters
    ----------
    struts : callable
        Distance to the struts.
    balls : callable
        Distance to the nodes.
    node_ratio : float
        Radius of a ball by that of a strut, 1 to 4.

    Raises
    ------
    CaseError
        If the ratio is out of range.
    """
    if not 1 <= node_ratio <= 4:
        raise CaseError(
            f"balls at nodes have {node_ratio:g} times the radius of struts; use 1 to 4"
        )
    if node_ratio == 1:
        return struts
    return lambda u: np.minimum(struts(u), balls(u) / node_ratio)


def _node_places(segments: FloatArray) -> FloatArray:
    """Ends of segments, one of each set of copies, ``(b, 3)``, cell units."""
    return np.unique(np.round(np.mod(segments.reshape(-1, 3), 1.0), 9) % 1.0, axis=0)


def node_distance(segments: FloatArray) -> Field:
    """Distance to the ends of segments of period 1, cell units."""
    ends = _node_places(segments)
    return periodic_distance_to_segments(np.stack([ends, ends], axis=1))


def _axes(segments: FloatArray, path: str) -> Callable[..., StrutAxes | None]:
    """Axes of round struts by the parameters of their family; None where they have fillets."""

    def axes(*, node_ratio: float = 1.0, fillet: float = 0.0, **bending: float) -> StrutAxes | None:
        if fillet:
            return None
        settings = tuple(bending[name] for name in PARAMETERS[path])
        return StrutAxes(
            segments=bent_segments(segments, path, *(settings or (0.0, 1.0))),
            balls=_node_places(segments),
            ball_ratio=node_ratio,
        )

    return axes


def _shape(segments: FloatArray, section: str, path: str) -> Callable[..., FloatArray]:
    """Shape function of a graph; its tables are built when first needed."""

    @lru_cache(maxsize=32)
    def struts(amplitude: float, turns: float) -> Field:
        bent = bent_segments(segments, path, amplitude, turns)
        return periodic_distance_to_segments(bent, normals=section_normals(bent, section))

    @lru_cache(maxsize=32)
    def filleted(fillet: float) -> Field:
        try:
            return periodic_filleted_segments(segments, fillet)
        except PluginError as error:
            raise CaseError(str(error)) from error

    @cache
    def balls() -> Field:
        return node_distance(segments)

    def balls_at(u: FloatArray) -> FloatArray:
        return balls()(u)

    def prisms(u: FloatArray, *, node_ratio: float = 1.0) -> FloatArray:
        return with_balls(struts(0.0, 1.0), balls_at, node_ratio)(u)

    def straight(u: FloatArray, *, node_ratio: float = 1.0, fillet: float = 0.0) -> FloatArray:
        bars = filleted(fillet) if fillet else struts(0.0, 1.0)
        return with_balls(bars, balls_at, node_ratio)(u)

    def wave(
        u: FloatArray, *, node_ratio: float = 1.0, amplitude: float = 0.0, waves: float = 1.0
    ) -> FloatArray:
        return with_balls(struts(amplitude, waves), balls_at, node_ratio)(u)

    def helix(
        u: FloatArray, *, node_ratio: float = 1.0, amplitude: float = 0.0, turns: float = 1.0
    ) -> FloatArray:
        return with_balls(struts(amplitude, turns), balls_at, node_ratio)(u)

    if section != "round":
        return prisms
    round_struts: dict[str, Callable[..., FloatArray]] = {
        "straight": straight, "wave": wave, "helix": helix
    }  # fmt: skip
    return round_struts[path]

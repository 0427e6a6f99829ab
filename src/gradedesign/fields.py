"""The algebra of implicit fields, and distances to level sets and graphs that cells need."""

from __future__ import annotations

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.geometry.fields._graph_kernels import in_cell
from gradedesign.geometry.fields.algebra import (
    blend_intersection,
    blend_union,
    complement,
    difference,
    gradient,
    intersection,
    offset,
    r_intersection,
    r_union,
    shell,
    union,
)
from gradedesign.geometry.fields.compiled_values import compiled_values
from gradedesign.geometry.fields.graph import bond_graph, graph_segments, segment_symmetry
from gradedesign.geometry.fields.level_set import level_set_points, periodic_distance_to_level_set
from gradedesign.geometry.fields.near_segments import (
    NearSegments,
    near_segments,
    nearest_candidates,
)
from gradedesign.geometry.fields.periodic_spline import Interpolation, periodic_spline
from gradedesign.geometry.fields.segment_distance import (
    periodic_distance_to_graph,
    periodic_distance_to_segments,
    periodic_filleted_segments,
)

__all__ = [
    "BoolArray", "Field", "FloatArray", "IntArray", "Interpolation", "NearSegments",
    "blend_intersection", "blend_union", "bond_graph", "compiled_values", "complement",
    "difference", "gradient", "graph_segments", "in_cell", "intersection", "level_set_points",
    "near_segments", "nearest_candidates", "offset", "periodic_distance_to_graph",
    "periodic_distance_to_level_set", "periodic_distance_to_segments", "periodic_filleted_segments",
    "periodic_spline", "r_intersection", "r_union", "segment_symmetry", "shell", "union",
]  # fmt: skip

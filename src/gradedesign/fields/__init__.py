"""The algebra of implicit fields, and distances to level sets and graphs that cells need."""

from __future__ import annotations

from gradedesign.arrays import Field, FloatArray
from gradedesign.fields.algebra import (
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
from gradedesign.fields.level_set import level_set_points, periodic_distance_to_level_set

__all__ = [
    "Field",
    "FloatArray",
    "blend_intersection",
    "blend_union",
    "complement",
    "difference",
    "gradient",
    "intersection",
    "level_set_points",
    "offset",
    "periodic_distance_to_level_set",
    "r_intersection",
    "r_union",
    "shell",
    "union",
]

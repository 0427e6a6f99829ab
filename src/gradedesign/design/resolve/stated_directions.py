"""Directions for the axes of cells that a case states by a formula or a file."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.density_value import formula_field
from gradedesign.geometry.lattice.field_reader import FieldReader
from gradedesign.geometry.maps.orientation_schema import OrientationSpec


def stated_directions(
    spec: OrientationSpec | None,
    distance: Field,
    memory: int,
    registry: Registry,
    where: Where,
) -> Field | None:
    """Tensors whose principal directions a case states, without any analysis.

    Returns callable or None: points ``(3, ...)`` mm to tensors ``(3, 3, ...)``; None where the case
    states none, or those of an analysis. Raises CaseError or PluginError if a file cannot be used,
    or nothing installed reads it.

    ``distance``: signed distance of the part. ``memory``, bytes: that a file may take.
    """
    if spec is None:
        return None
    if spec.direction is not None:
        parts = [formula_field(parse_formula(text), distance) for text in spec.direction]

        def along(points: FloatArray) -> FloatArray:
            v = np.stack([np.broadcast_to(part(points), points.shape[1:]) for part in parts])
            size = np.maximum(np.sqrt((v**2).sum(axis=0)), 1e-300)
            return np.asarray(v[:, None] * v[None] / size)

        return along
    if spec.vtu is None:
        return None
    with locating(where, "lattice.orientation.vtu"):
        reader: FieldReader = lookup(registry, "field_readers", "vtu")
        if reader.tensors is None:
            raise CaseError(f"the field reader '{reader.name}' reads no directions")
        return reader.tensors(spec.vtu, spec.field, memory)

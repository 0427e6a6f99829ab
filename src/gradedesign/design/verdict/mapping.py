"""Words and data on a density that was mapped from the stress of the solid part."""

from __future__ import annotations

from collections.abc import Mapping

from gradedesign.arrays import FloatArray
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec


def mapping_data(lattice: LatticeSpec, variables: FloatArray) -> dict[str, float]:
    """Factor on the stress of the solid part; nothing where another method sized."""
    if not lattice.by_stress:
        return {}
    return {"stress_factor": float(variables[0])}


def with_method(reason: str, mapping: Mapping[str, float]) -> str:
    """A sentence with the method that sized, where it was the plain one.

    Examples
    --------
    >>> with_method("every limit holds", {"stress_factor": 1.25})
    'every limit holds; sized by stress-to-density: stress of the solid part times 1.25'
    >>> with_method("every limit holds", {})
    'every limit holds'
    """
    if not mapping:
        return reason
    factor = mapping["stress_factor"]
    return f"{reason}; sized by stress-to-density: stress of the solid part times {factor:.3g}"

"""Edge of the part's tetrahedra where the case states none."""

from __future__ import annotations

import math

import numpy as np

from gradedesign.design.resolve.predicted_part_mesh import least_part_dofs, predicted_part_dofs
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.triangles.surface_mesh import corner_points

#: Quadratic tetrahedra across the mean thickness of the part, 2 V / A. Chosen, not measured.
ACROSS = 1.5
#: Unknowns that a part has at least, so that a lump gets a field of densities, and at most unless
#: its own facets ask for more: solved in seconds.
LEAST_DOFS, MOST_DOFS = 30_000, 200_000
#: One size over the next finer one that is tried. Chosen, not measured.
_STEP = 1.1


def with_mesh_size(spec: PartSpec, part: Part, most: float, needed: float = math.inf) -> PartSpec:
    """``[part]`` with the edge of its tetrahedra, as stated or as `_default_mesh_size`."""
    if spec.mesh_size is not None:
        return spec
    return _with(spec, _default_mesh_size(spec, part, most, needed))


def _default_mesh_size(spec: PartSpec, part: Part, most: float, needed: float) -> float:
    """Edge of the part's tetrahedra, mm, two figures.

    Stress and displacement of the solid need elements that follow its thickness; densities vary
    from cell to cell and members lie among them, so elements are no larger than those.

    Parameters
    ----------
    spec : PartSpec
        Without a mesh size.
    most : float, mm
        Largest edge, but for parts that would have too many unknowns with it.
    needed : float, mm
        Largest edge whatever they are.
    """
    a, b, c = np.moveaxis(corner_points(part.surface), 1, 0)
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    thickness = 2.0 * part.volume / area
    size = min(thickness / ACROSS, most)
    while least_part_dofs(_with(spec, size), part) < LEAST_DOFS:
        size /= _STEP
    while predicted_part_dofs(_with(spec, size), part) > MOST_DOFS and size < thickness:
        size *= _STEP
    size = min(size, needed)
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{unit * math.floor(size / unit):.2g}")


def _with(spec: PartSpec, size: float) -> PartSpec:
    return spec.model_copy(update={"mesh_size": size})

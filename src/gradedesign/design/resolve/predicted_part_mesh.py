"""Edge of the part's tetrahedra where the case states none, and unknowns before any mesh."""

from __future__ import annotations

import math

import numpy as np

from gradedesign.common.values.locate import Where
from gradedesign.errors import ResourceError
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.part_mesh import box_planes
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.tets.long_edges import least_count
from gradedesign.geometry.tets.meshed_surface import LONGEST_EDGE
from gradedesign.geometry.triangles.surface_mesh import corner_points
from gradedesign.mechanics.fe.solve import predict_memory_bytes

#: Unknowns of quadratic elements per tetrahedron of a bulky part, at least.
_DOFS_PER_TET = 4.0
#: The mesher's tetrahedra over the fewest that keep the asked length: of the volume, and of each
#: facet of the surface, which stays where it is smaller than that length.
_OF_VOLUME, _OF_FACET = 2.5, 4.0


def least_part_dofs(spec: PartSpec, part: Part) -> float:
    """Unknowns that the part's mesh has at least; of a box, those that it has."""
    size = spec.element_size
    if spec.bricks is not None:
        planes = box_planes(spec.bricks, size, [region.corners for region in part.regions.values()])
        return 3.0 * math.prod(2.0 * len(along) - 1.0 for along in planes)
    return _DOFS_PER_TET * least_count(part.volume, LONGEST_EDGE * size)


def predicted_part_dofs(spec: PartSpec, part: Part) -> int:
    """Unknowns that the part's mesh will have, exact for a box, else within a factor of two."""
    if spec.bricks is not None:
        return int(least_part_dofs(spec, part))
    size = spec.element_size
    a, b, c = np.moveaxis(corner_points(part.surface), 1, 0)
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    facets = float(np.maximum(areas / (0.433 * size**2), 1.0).sum())
    tets = _OF_VOLUME * least_count(part.volume, LONGEST_EDGE * size) + _OF_FACET * facets
    return int(_DOFS_PER_TET * tets)


def require_mesh_fits(spec: PartSpec, part: Part, memory: int, where: Where) -> None:
    """Refuse a mesh size whose analysis cannot fit the memory, bytes.

    Raises ResourceError, naming file, line, the unknowns at least and a mesh size that fits.
    """
    dofs = least_part_dofs(spec, part)
    need, limit = predict_memory_bytes(int(dofs), 2), memory
    if need <= limit:
        return
    base = predict_memory_bytes(0)
    fitting = max((limit - base) / (predict_memory_bytes(1) - base), 1.0)
    size = spec.element_size * (dofs / fitting) ** (1 / 3)
    thickness = float(np.ptp(part.surface.vertices, axis=0).min())
    remedy = f"take {_rounded_up(size)} mm or more, or raise memory"
    if 2.0 * size > thickness:
        # Elements as large as the part say nothing of it.
        remedy = f"raise memory to {_rounded_up(need / 1e9)} GB or more"
    raise ResourceError(
        f"{where('part.mesh_size')}: found {spec.element_size:g} mm, which cuts the "
        f"{part.volume:.4g} mm^3 of the part into at least {dofs:.2g} unknowns, about "
        f"{need / 1e9:.2g} GB; expected at most the {limit / 1e9:.2g} GB of [run] memory: "
        f"{remedy}"
    )


def _rounded_up(value: float) -> str:
    """Two figures, not below the value."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{step * math.ceil(1.02 * value / step):g}"


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

    ``spec``: without a mesh size; ``most``, float, mm: largest edge, but for parts that would have
    too many unknowns with it; ``needed``, float, mm: largest edge whatever they are.
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

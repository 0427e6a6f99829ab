"""Densities and directions that a case names by files, as functions of place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gradedesign import DensityRequest, tet_density, tet_tensors
from gradedesign.fields import Field
from gradedesign_volumes.image_stack import read_image_stack
from gradedesign_volumes.point_cloud import point_density, read_points, remap_points
from gradedesign_volumes.voxel_density import (
    BYTES_PER_VOXEL,
    densities,
    place_voxels,
    read_voxel_array,
    voxel_density,
)
from gradedesign_volumes.vtu_fields import read_vtu_field, read_vtu_tensor


def of_points(request: DensityRequest) -> Field:
    """Scattered points, mapped on a grid of half a cell unless the case states another."""
    spec, memory = request.spec, request.memory_limit_bytes
    points, values = read_points(spec.points, memory_limit_bytes=memory)
    mapped = remap_points(
        points,
        values,
        spec.spacing or 0.5 * request.cell_size,
        method="maximum" if spec.method == "maximum" else "weights",
        oversize=spec.oversize,
        outside=spec.outside,
        memory_limit_bytes=memory,
    )
    return point_density(mapped)


def of_vtu(request: DensityRequest) -> Field:
    """A field on tetrahedra."""
    spec, memory = request.spec, request.memory_limit_bytes
    mesh, values, at = read_vtu_field(spec.vtu, spec.field, memory_limit_bytes=memory)
    return tet_density(
        mesh,
        values,
        at=at,
        spacing=request.spacing,
        reach=0.5 * request.cell_size + 3 * request.spacing,
        memory_limit_bytes=memory,
    )


def directions_of_vtu(path: Path, field: str | None, memory_limit_bytes: int) -> Field:
    """Tensors, or directions, on tetrahedra."""
    return tet_tensors(*read_vtu_tensor(path, field, memory_limit_bytes=memory_limit_bytes))


def of_voxels(request: DensityRequest) -> Field:
    """An array of voxels."""
    memory = request.memory_limit_bytes
    return _placed(request, read_voxel_array(request.spec.voxels, memory_limit_bytes=memory))


def of_images(request: DensityRequest) -> Field:
    """A folder of slices."""
    raw = read_image_stack(
        request.spec.images,
        memory_limit_bytes=request.memory_limit_bytes,
        bytes_per_value=BYTES_PER_VOXEL,
    )
    return _placed(request, raw)


def _placed(request: DensityRequest, raw: NDArray[np.generic]) -> Field:
    """Voxels where the case places them."""
    spec = request.spec
    start, edges = place_voxels(
        raw.shape, request.lower, request.upper, voxel_size=spec.voxel_size, origin=spec.origin
    )
    return voxel_density(densities(raw, request.grey), start, edges)

"""The part from a scanned volume: the smoothed surface of its solid voxels."""

from __future__ import annotations

import logging
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import CaseError, PartError, ResourceError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.raw_triangles import UNIT_MM, RawTriangles, raw_triangles
from gradedesign.geometry.part.voxel_volume import BYTES_PER_VOXEL, VoxelVolume
from gradedesign.geometry.part.voxels_schema import VoxelsSpec
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, enclosed_volume

log = logging.getLogger(__name__)

#: The surface encloses the volume of the voxels within this share; better where it is reached soon.
#: Chosen, not measured.
VOLUME_TOLERANCE, _VOLUME_AIM = 5e-3, 1e-3
#: Shifts of the surface, by the volume over the shift before. Chosen, not measured.
_SHIFTS = 5
#: Width of the smoothing, over how far the surface may move. Chosen, not measured.
_SIGMA = 1.0
#: Empty voxels around the part, so that its surface closes.
_MARGIN = 2


def voxel_triangles(
    volume: VoxelVolume, part: PartSpec, memory_limit_bytes: int, source: str
) -> RawTriangles:
    """The surface of the solid voxels of a scan.

    The signed distance to the faces of the voxels, linear between their centres, is smoothed by a
    Gaussian, held within the tolerance of what it was, and shifted until it encloses the volume of
    the voxels. So the surface moves by the tolerance at most.

    Parameters
    ----------
    volume : VoxelVolume
    part : PartSpec
        Threshold, spacing and tolerance, and the unit of the file.
    memory_limit_bytes : int
    source : str
        Name of the file, for messages.

    Raises
    ------
    CaseError
        If threshold, spacing or unit are missing.
    PartError
        If no voxel is solid, values are not finite, or the volume cannot be held.
    ResourceError
        If the grid of the surface takes more memory.
    """
    spec = VoxelsSpec() if part.voxels is None else part.voxels
    spacing, unit, notes = _spacing(volume, spec, part.units, source)
    solid = _solid(volume, spec, source)
    need = solid.size * BYTES_PER_VOXEL
    if need > memory_limit_bytes:
        raise ResourceError(
            f"{source}: a surface of {solid.size:.4g} voxels takes about {need / 1e9:.3g} GB; "
            f"found run.memory of {memory_limit_bytes / 1e9:.3g} GB; raise it or write a coarser "
            f"volume"
        )
    tolerance = 0.5 * min(spacing) if spec.tolerance is None else spec.tolerance
    target = float(np.count_nonzero(solid)) * float(np.prod(spacing))
    report_step("surface of the voxels")
    surface = _smoothed_surface(solid, np.array(spacing), tolerance, target, source)
    change = enclosed_volume(surface) / target - 1.0
    notes.append(
        f"{source}: {np.count_nonzero(solid)} solid voxels of "
        f"{' x '.join(f'{e:.4g}' for e in spacing)} mm became {len(surface.faces)} triangles "
        f"within {tolerance:.3g} mm of their faces, {change:+.2%} of volume"
    )
    log.info("%s", notes[-1])
    corners = surface.vertices[surface.faces] / UNIT_MM[unit]
    return raw_triangles(corners, source=source, unit=unit, warnings=[*volume.warnings, *notes])


def _spacing(
    volume: VoxelVolume, spec: VoxelsSpec, units: str | None, source: str
) -> tuple[tuple[float, float, float], str, list[str]]:
    """Edges of a voxel in mm, the unit of the triangles, and remarks."""
    if volume.spacing is not None and not all(isfinite(e) and e > 0 for e in volume.spacing):
        raise PartError(f"{source}: voxels of {volume.spacing}; expected edges of more than 0")
    unit = units or volume.unit
    if spec.spacing is not None:
        notes = []
        if volume.spacing is not None and unit is not None:
            own = np.array(volume.spacing) * UNIT_MM[unit]
            if not np.allclose(own, spec.spacing, rtol=1e-3):
                notes.append(
                    f"{source}: [part.voxels] spacing is taken, though the file has "
                    f"{' x '.join(f'{e:.4g}' for e in own)} mm"
                )
        return spec.spacing, unit or "mm", notes
    if volume.spacing is None:
        raise CaseError(
            f"part.voxels.spacing: missing; {source} does not say how large a voxel is, state "
            f'spacing = "0.1 mm" in [part.voxels]'
        )
    if unit is None:
        raise CaseError(
            f"part.units: missing; {source} carries no unit, state one of {', '.join(UNIT_MM)}"
        )
    x, y, z = (e * UNIT_MM[unit] for e in volume.spacing)
    return (x, y, z), unit, []


def _solid(volume: VoxelVolume, spec: VoxelsSpec, source: str) -> BoolArray:
    """Solid voxels, with empty ones around them."""
    values: NDArray[Any] = volume.values
    if values.dtype.kind == "b":
        threshold = 0.5 if spec.threshold is None else spec.threshold
        values = values.view(np.uint8)
    elif spec.threshold is None:
        raise CaseError(
            f"part.voxels.threshold: missing; {source} holds values from {values.min():.6g} to "
            f"{values.max():.6g}, state above which of them a voxel is solid"
        )
    else:
        threshold = spec.threshold
    if values.dtype.kind not in "fiu":
        raise PartError(f"{source}: values of type {values.dtype}; expected numbers")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise PartError(
            f"{source}: {np.count_nonzero(~np.isfinite(values))} of {values.size} voxels are not "
            f"finite; export it again"
        )
    chosen = values < threshold if spec.below else values > threshold
    if not chosen.any():
        raise PartError(
            f"{source}: no voxel is {'below' if spec.below else 'above'} the threshold of "
            f"{threshold:g}; its values go from {values.min():.6g} to {values.max():.6g}"
        )
    return np.pad(chosen, _MARGIN)


def _smoothed_surface(
    solid: BoolArray, spacing: FloatArray, tolerance: float, target: float, source: str
) -> SurfaceMesh:
    """The surface within a tolerance of the voxels' that encloses their volume."""
    near = 0.5 * spacing.min()
    distance = distance_transform_edt(~solid, sampling=spacing).astype(np.float32)
    distance -= distance_transform_edt(solid, sampling=spacing).astype(np.float32)
    distance -= np.sign(distance) * np.float32(near)
    smooth = gaussian_filter(distance, _SIGMA * tolerance / spacing, mode="nearest")
    shift, volume, slope = 0.0, 0.0, 0.0
    tried: list[tuple[float, float]] = []
    for _ in range(_SHIFTS):
        shifted = np.clip(smooth - np.float32(shift), distance - tolerance, distance + tolerance)
        surface = extract_surface(
            _interpolated(shifted, spacing),
            # Half a step inside the first centre: nodes then fall on the centres of voxels.
            (0.5 - _MARGIN) * spacing + 0.5 * spacing.min(),
            (np.array(solid.shape) - _MARGIN - 1) * spacing,
            float(spacing.min()),
        )
        volume = enclosed_volume(surface)
        if abs(volume - target) <= _VOLUME_AIM * target:
            return surface
        if len(tried) == 0:
            slope = float(np.linalg.norm(area_vectors(surface), axis=1).sum())
        elif shift != tried[-1][0]:
            slope = (volume - tried[-1][1]) / (shift - tried[-1][0])
        tried.append((shift, volume))
        if slope <= 0.0:  # all of the surface is held
            break
        shift += (target - volume) / slope
    if abs(volume - target) <= VOLUME_TOLERANCE * target:
        return surface
    raise PartError(
        f"{source}: a surface within {tolerance:.3g} mm of the voxels encloses {volume:.6g} mm^3, "
        f"the voxels {target:.6g} mm^3; expected the same within {VOLUME_TOLERANCE:.1%}: their "
        f"walls are too thin or their corners too many; state another [part.voxels] tolerance, or "
        f"scan it finer"
    )


def _interpolated(values: FloatArray, spacing: FloatArray) -> Field:
    """Trilinear between the centres of voxels, the first of which is `_MARGIN` voxels outside."""

    def field(points: FloatArray) -> FloatArray:
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        index = flat / spacing[:, None] + (_MARGIN - 0.5)
        interpolated = map_coordinates(values, index, order=1, mode="nearest", output=np.float64)
        return np.asarray(interpolated).reshape(points.shape[1:])

    return field

"""The part from a scanned volume: the smoothed surface of its solid voxels."""

from __future__ import annotations

import logging
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter
from skimage.filters import threshold_otsu
from skimage.measure import marching_cubes, mesh_surface_area

from gradedesign import (
    UNIT_MM,
    CaseError,
    FileRequest,
    PartError,
    RawTriangles,
    ResourceError,
    raw_triangles,
    report_step,
)
from gradedesign.fields import BoolArray, FloatArray
from gradedesign_volumes.voxel_volume import BYTES_PER_VOXEL, VoxelVolume
from gradedesign_volumes.voxels_schema import VoxelsSpec

log = logging.getLogger(__name__)

#: The surface encloses the volume of the voxels within this share; better where it is reached soon.
#: Chosen, not measured.
_VOLUME_TOLERANCE, _VOLUME_AIM = 5e-3, 1e-3
#: Shifts of the surface, by the volume over the shift before. Chosen, not measured.
_SHIFTS = 5
#: Width of the smoothing, over how far the surface may move. Chosen, not measured.
_SIGMA = 1.0
#: Empty voxels around the part, so that its surface closes.
_MARGIN = 2
#: Value of a node that lies on the surface, mm: below what float32 tells apart in any part.
_OFF = np.float32(1e-7)


def voxel_triangles(volume: VoxelVolume, request: FileRequest, source: str) -> RawTriangles:
    """The surface of the solid voxels of a scan.

    The signed distance to the faces of the voxels, linear between their centres, is smoothed by a
    Gaussian, held within the tolerance of what it was, and shifted until it encloses the volume of
    the voxels. So the surface moves by the tolerance at most.

    Parameters
    ----------
    request : FileRequest
        With a `VoxelsSpec` or none.
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
    spec: VoxelsSpec = VoxelsSpec() if request.table is None else request.table
    spacing, unit, notes = _spacing(volume, spec, request.units, source)
    solid = _solid(volume, spec, source)
    need = solid.size * BYTES_PER_VOXEL
    if need > request.memory_limit_bytes:
        raise ResourceError(
            f"{source}: a surface of {solid.size:.4g} voxels takes about {need / 1e9:.3g} GB; "
            f"found run.memory of {request.memory_limit_bytes / 1e9:.3g} GB; raise it or write a "
            f"coarser volume"
        )
    tolerance = 0.5 * min(spacing) if spec.tolerance is None else spec.tolerance
    target = float(np.count_nonzero(solid)) * float(np.prod(spacing))
    report_step("surface of the voxels")
    corners, held = _smoothed_surface(solid, np.array(spacing), tolerance, target, source)
    notes.append(
        f"{source}: {np.count_nonzero(solid)} solid voxels of "
        f"{' x '.join(f'{e:.4g}' for e in spacing)} mm became {len(corners)} triangles "
        f"within {tolerance:.3g} mm of their faces, {held / target - 1.0:+.2%} of volume"
    )
    log.info("%s", notes[-1])
    warnings = [*volume.warnings, *notes]
    return raw_triangles(corners / UNIT_MM[unit], source=source, unit=unit, warnings=warnings)


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
            f"{values.max():.6g}, state above which of them a voxel is solid{_told(values)}"
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


def _told(values: NDArray[Any]) -> str:
    """The threshold between two kinds of grey by Otsu (1979), for a message; empty without any."""
    finite = values[np.isfinite(values)] if values.dtype.kind in "fiu" else np.zeros(0)
    if finite.size == 0 or finite.min() == finite.max():
        return ""
    return f"; between two kinds of grey lies {threshold_otsu(finite):.6g} (Otsu)"


def _smoothed_surface(
    solid: BoolArray, spacing: FloatArray, tolerance: float, target: float, source: str
) -> tuple[FloatArray, float]:
    """Triangles ``(m, 3, 3)`` mm within a tolerance of the voxels, and their volume, mm^3."""
    near = 0.5 * spacing.min()
    distance = distance_transform_edt(~solid, sampling=spacing).astype(np.float32)
    distance -= distance_transform_edt(solid, sampling=spacing).astype(np.float32)
    distance -= np.sign(distance) * np.float32(near)
    smooth = gaussian_filter(distance, _SIGMA * tolerance / spacing, mode="nearest")
    shift, volume, slope = 0.0, 0.0, 0.0
    tried: list[tuple[float, float]] = []
    for _ in range(_SHIFTS):
        shifted = np.clip(smooth - np.float32(shift), distance - tolerance, distance + tolerance)
        if shifted.min() >= 0.0:
            volume = 0.0
            break
        shifted[shifted == 0.0] = _OFF  # a node on the surface would leave triangles without area
        vertices, faces, _, _ = marching_cubes(shifted, 0.0, spacing=tuple(spacing))
        vertices = vertices.astype(np.float64) + (0.5 - _MARGIN) * spacing
        corners = vertices[faces]
        a, b, c = np.moveaxis(corners, 1, 0)
        volume = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
        if abs(volume - target) <= _VOLUME_AIM * target:
            return corners, volume
        if len(tried) == 0:
            slope = float(mesh_surface_area(vertices, faces))
        elif shift != tried[-1][0]:
            slope = (volume - tried[-1][1]) / (shift - tried[-1][0])
        tried.append((shift, volume))
        if slope <= 0.0:  # all of the surface is held
            break
        shift += (target - volume) / slope
    if abs(volume - target) <= _VOLUME_TOLERANCE * target:
        return corners, volume
    raise PartError(
        f"{source}: a surface within {tolerance:.3g} mm of the voxels encloses {volume:.6g} mm^3, "
        f"the voxels {target:.6g} mm^3; expected the same within {_VOLUME_TOLERANCE:.1%}: their "
        f"walls are too thin or their corners too many; state another [part.voxels] tolerance, or "
        f"scan it finer"
    )

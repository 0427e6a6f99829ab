"""Volumes and fields for gradedesign: parts from scans, densities and directions from files.

Parts are read from NRRD, NPY and NPZ files and stacks of images; densities from arrays, images,
scattered points and VTU.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from gradedesign import (
    IMAGES,
    FieldReader,
    FileRequest,
    PartReader,
    RawTriangles,
    hookimpl,
)
from gradedesign_volumes.density_maps import (
    directions_of_vtu,
    of_images,
    of_points,
    of_voxels,
    of_vtu,
)
from gradedesign_volumes.voxel_files import (
    read_image_volume,
    read_npy_volume,
    read_npz_volume,
    read_nrrd_volume,
)
from gradedesign_volumes.voxel_volume import VoxelVolume
from gradedesign_volumes.voxels_schema import VoxelsSpec

__all__ = ["gradedesign_field_readers", "gradedesign_readers"]

#: Readers of volumes, by name, and the endings of their files.
_READERS: dict[str, tuple[Callable[[Path, int], VoxelVolume], tuple[str, ...]]] = {
    "npy": (read_npy_volume, (".npy",)),
    "npz": (read_npz_volume, (".npz",)),
    "nrrd": (read_nrrd_volume, (".nrrd",)),
    "images": (read_image_volume, IMAGES),
}


def _triangles(
    read: Callable[[Path, int], VoxelVolume], path: Path, request: FileRequest
) -> RawTriangles:
    """Surface of the solid voxels of a file."""
    from gradedesign_volumes.voxel_part import voxel_triangles  # scikit-image takes a second

    return voxel_triangles(read(path, request.memory_limit_bytes), request, path.name)


@hookimpl
def gradedesign_readers() -> Iterator[PartReader]:
    """Register the readers of volumes, which bring the table ``[part.voxels]``."""
    for name, (read, suffixes) in _READERS.items():
        yield PartReader(
            name=name,
            suffixes=suffixes,
            read=partial(_triangles, read),
            key="voxels",
            table=VoxelsSpec,
        )


@hookimpl
def gradedesign_field_readers() -> Iterator[FieldReader]:
    """Register the sources of ``[lattice.density_map]``, and of ``[lattice.orientation]``."""
    yield FieldReader(name="images", density=of_images)
    yield FieldReader(name="points", density=of_points)
    yield FieldReader(name="voxels", density=of_voxels)
    yield FieldReader(name="vtu", density=of_vtu, tensors=directions_of_vtu)

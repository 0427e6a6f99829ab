"""Parts from volumes of voxels for gradedesign: NRRD, NPY and NPZ files, stacks of images."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import IMAGES, PartReader, hookimpl
from gradedesign_volumes.voxel_files import (
    read_image_volume,
    read_npy_volume,
    read_npz_volume,
    read_nrrd_volume,
)

__all__ = ["gradedesign_readers"]


@hookimpl
def gradedesign_readers() -> Iterator[PartReader]:
    """Register the readers of volumes."""
    yield PartReader(name="npy", suffixes=(".npy",), read=read_npy_volume, sampled=True)
    yield PartReader(name="npz", suffixes=(".npz",), read=read_npz_volume, sampled=True)
    yield PartReader(name="nrrd", suffixes=(".nrrd",), read=read_nrrd_volume, sampled=True)
    yield PartReader(name="images", suffixes=IMAGES, read=read_image_volume, sampled=True)

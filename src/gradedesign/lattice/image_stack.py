"""A folder of grey images as a voxel array."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gradedesign.errors import CaseError, ResourceError

if TYPE_CHECKING:
    from PIL.Image import Image

SUFFIXES = (".png", ".tif", ".tiff")
#: Voxels of the largest stack.
MOST_VOXELS = 1_000_000_000
#: Pillow's names of grey pixels, and what they are as numbers.
_TYPES = {"L": np.uint8, "I;16": np.uint16, "I;16B": np.uint16, "I;16L": np.uint16, "F": np.float32}


def read_image_stack(folder: Path) -> NDArray[np.generic]:
    """Read slices along z, lowest first, ordered by name with numbers as numbers.

    Columns of an image go along x; its last row has the lowest y, as on paper.

    Parameters
    ----------
    folder : Path
        Of PNG or TIFF images with one frame each; other files are not looked at.

    Returns
    -------
    (nx, ny, nz) array
        ``uint8``, ``uint16`` or ``float32``.

    Raises
    ------
    CaseError
        If there is no image, one cannot be read, is not grey, or has another size or depth than
        the first.
    ResourceError
        If the stack is too large.
    """
    files = sorted(
        (p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and p.is_file()),
        key=lambda p: _natural(p.name),
    )
    if not files:
        raise CaseError(f"{folder.name} holds no image; expected {', '.join(SUFFIXES)} files")
    first = _read(files[0])
    if first.size * len(files) > MOST_VOXELS:
        raise ResourceError(
            f"{folder.name} holds {len(files)} images of {first.shape[1]} x {first.shape[0]} "
            f"pixels, more than {MOST_VOXELS:.3g} voxels; scale them down"
        )
    stack = np.zeros((*first.shape, len(files)), dtype=first.dtype)
    for number, file in enumerate(files):
        pixels = first if number == 0 else _read(file)
        if pixels.shape != first.shape or pixels.dtype != first.dtype:
            raise CaseError(
                f"{file.name} has {_described(pixels)}, but {files[0].name} has "
                f"{_described(first)}; all images of a stack must agree"
            )
        stack[:, :, number] = pixels
    return np.ascontiguousarray(stack[::-1].transpose(1, 0, 2))


def _read(file: Path) -> NDArray[np.generic]:
    """Grey values of one image, ``(rows, columns)``."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(file) as image:
            return _grey(file, image)
    except (
        OSError,
        SyntaxError,  # what Pillow calls a broken PNG
        ValueError,
        UnidentifiedImageError,
        Image.DecompressionBombError,
    ) as error:
        raise CaseError(f"{file.name} cannot be read as an image: {error}") from error


def _grey(file: Path, image: Image) -> NDArray[np.generic]:
    if getattr(image, "n_frames", 1) != 1:
        raise CaseError(f"{file.name} has several frames; expected one image for each slice")
    if image.mode not in _TYPES:
        raise CaseError(
            f"{file.name} has pixels of kind {image.mode}; expected grey images of 8 or 16 bit "
            f"or 32 bit floats: convert it to grey"
        )
    return np.asarray(image).astype(_TYPES[image.mode])


def _described(pixels: NDArray[np.generic]) -> str:
    return f"{pixels.shape[1]} x {pixels.shape[0]} pixels of {pixels.dtype}"


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Sort key in which slice 2 comes before slice 10."""
    pieces = re.split(r"(\d+)", name.lower())
    return [(1, int(p), "") if p.isdecimal() else (0, 0, p) for p in pieces]

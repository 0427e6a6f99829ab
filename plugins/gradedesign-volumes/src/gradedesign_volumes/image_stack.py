"""A folder of grey images as a voxel array."""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError, ResourceError, natural

if TYPE_CHECKING:
    from PIL.Image import Image

_SUFFIXES = (".png", ".tif", ".tiff")
_FORMATS = ("PNG", "TIFF")
#: Exceptions of Pillow for damaged PNG and TIFF files, found by altering whole ones.
_DAMAGED = (
    OSError,
    SyntaxError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    EOFError,
    OverflowError,
    ZeroDivisionError,
    RuntimeError,
    UserWarning,
    struct.error,
    zlib.error,
)
#: Pillow's names of grey pixels, and what they are as numbers.
_TYPES = {"L": np.uint8, "I;16": np.uint16, "I;16B": np.uint16, "I;16L": np.uint16, "F": np.float32}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """Format and size that all images of a stack share."""

    columns: int
    rows: int
    dtype: np.dtype[Any]

    def __str__(self) -> str:
        return f"{self.columns} x {self.rows} pixels of {self.dtype}"


def read_image_stack(
    folder: Path, *, memory_limit_bytes: int, bytes_per_value: int
) -> NDArray[np.generic]:
    """Read slices along z, lowest first, ordered by name with numbers as numbers.

    Columns of an image go along x; its last row has the lowest y, as on paper.

    Parameters
    ----------
    folder : Path
        Of PNG or TIFF images with one frame each; other files are not looked at.
    memory_limit_bytes : int
        Bytes that reading and using the stack may take.
    bytes_per_value : int
        Bytes that using it takes, beside the array itself.

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
        If the stack takes more memory: found out before anything is decompressed.
    """
    try:
        images = [p for p in folder.iterdir() if p.suffix.lower() in _SUFFIXES and p.is_file()]
    except OSError as error:
        raise CaseError(f"{folder.name} cannot be read as a folder: {error.strerror}") from error
    files = sorted(images, key=lambda p: natural(p.name))
    if not files:
        raise CaseError(f"{folder.name} holds no image; expected {', '.join(_SUFFIXES)} files")
    return read_images(
        files, memory_limit_bytes=memory_limit_bytes, bytes_per_value=bytes_per_value
    )


def read_images(
    files: Sequence[Path], *, memory_limit_bytes: int, bytes_per_value: int
) -> NDArray[np.generic]:
    """Read slices from the lowest to the highest; as `read_image_stack`, whose errors it raises."""
    first = _kind(files[0])
    name = files[0].parent.name
    _require_memory(name, first, len(files), memory_limit_bytes, bytes_per_value)
    stack = np.zeros((first.rows, first.columns, len(files)), dtype=first.dtype)
    for number, file in enumerate(files):
        stack[:, :, number] = _pixels(file, first, files[0].name)
    return np.ascontiguousarray(stack[::-1].transpose(1, 0, 2))


def _require_memory(
    name: str, kind: _Kind, count: int, memory_limit_bytes: int, bytes_per_value: int
) -> None:
    pixels, size = kind.columns * kind.rows, kind.dtype.itemsize
    # The stack, its copy along x, y, z, and what is made of it; of one image three copies.
    need = pixels * (count * (2 * size + bytes_per_value) + 3 * size)
    if need > memory_limit_bytes:
        raise ResourceError(
            f"{name} holds {count} images of {kind.columns} x {kind.rows} pixels, which take about "
            f"{need / 1e9:.3g} GB; found run.memory of {memory_limit_bytes / 1e9:.3g} GB; raise it "
            f"or scale the images down"
        )


def _kind(file: Path) -> _Kind:
    """Size and type of an image, from its header."""
    with _opened(file) as image:
        return _kind_of(file, image)


def _pixels(file: Path, kind: _Kind, first: str) -> NDArray[np.generic]:
    """Grey values of one image, ``(rows, columns)``; decoded once its header is found to agree."""
    with _opened(file) as image:
        own = _kind_of(file, image)
        if own != kind:
            raise CaseError(
                f"{file.name} has {own}, but {first} has {kind}; all images of a stack must agree"
            )
        return np.asarray(image).astype(own.dtype)


@contextmanager
def _opened(file: Path) -> Iterator[Image]:
    """An image while it is read; whatever Pillow says of a damaged one names the file."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            # Of a large image: the memory is what counts, and is asked for by its header.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            # Of damage that it reads around: a plausible wrong density.
            warnings.simplefilter("error", UserWarning)
            with Image.open(file, formats=_FORMATS) as image:
                yield image
    except Image.DecompressionBombError as error:
        raise ResourceError(
            f"{file.name} is too large an image ({error}); scale the images down"
        ) from error
    except UnidentifiedImageError as error:
        raise CaseError(
            f"{file.name} cannot be read as an image: its content is neither PNG nor TIFF; write "
            f"it again"
        ) from error
    except _DAMAGED as error:
        raise CaseError(
            f"{file.name} cannot be read as an image: {error or type(error).__name__}; it is "
            f"truncated or altered, write it again"
        ) from error


def _kind_of(file: Path, image: Image) -> _Kind:
    if getattr(image, "n_frames", 1) != 1:
        raise CaseError(f"{file.name} has several frames; expected one image for each slice")
    if image.mode not in _TYPES:
        raise CaseError(
            f"{file.name} has pixels of kind {image.mode}; expected grey images of 8 or 16 bit "
            f"or 32 bit floats: convert it to grey"
        )
    return _Kind(columns=image.width, rows=image.height, dtype=np.dtype(_TYPES[image.mode]))

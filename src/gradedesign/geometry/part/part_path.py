"""Files that a case may name: those below its own folder, unless the user allows others."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath, PureWindowsPath

from gradedesign.common.values.suggest import instead, listed, shown

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
#: Argument of what reads a case; a command says its option, see `commands.options`.
_ARGUMENT = "allow_outside=True"
#: Suffixes of images, of which one stands for its stack.
IMAGES = (".png", ".tif", ".tiff")


def resolve_part_file(text: str, *, folder: Path, allow_outside: bool) -> Path:
    """Turn the text of ``file`` into the path of an existing part file.

    Returns Path: absolute, with links resolved. Raises ValueError if the path leaves the folder, is
    an address or abbreviation, does not exist, is no file, or has no suffix: which ones are read is
    the installed readers' to say.

    ``text``: as written in the case. ``folder``: folder of the case; relative paths start there.
    ``allow_outside``: whether the file may lie elsewhere.
    """
    path, exists, is_file = _followed(text, folder=folder, allow_outside=allow_outside)
    if not PurePosixPath(text).suffix:
        raise ValueError(
            f'found {shown(text)}; expected a name with a suffix, such as "bracket.stl", which '
            f"says how it is read"
        )
    if not exists:
        near = instead(text, _beside(folder), label="files in the folder of the case")
        raise ValueError(f"found {shown(text)}, which does not exist; {near}")
    if not is_file:
        raise ValueError(f"found {shown(text)}, which is not a regular file")
    return path


def resolve_data_file(
    text: str, *, folder: Path, allow_outside: bool, suffixes: tuple[str, ...]
) -> Path:
    """Turn the name of a data file, such as a density map, into its path.

    Raises `ValueError` as for `resolve_part_file`.

    Parameters
    ----------
    text : str
        As written in the case.
    folder, allow_outside
        As for `resolve_part_file`.
    suffixes : tuple of str
        Lower case; others are refused.
    """
    path, exists, is_file = _followed(text, folder=folder, allow_outside=allow_outside)
    if PurePosixPath(text).suffix.lower() not in suffixes:
        raise ValueError(f"found {shown(text)}, not such a file; readable: {listed(suffixes)}")
    if not exists:
        near = _neighbours(text, folder, suffixes)
        raise ValueError(f"found {shown(text)}, which does not exist; {near}")
    if not is_file:
        raise ValueError(f"found {shown(text)}, which is not a regular file")
    return path


def resolve_data_folder(text: str, *, folder: Path, allow_outside: bool) -> Path:
    """Turn the name of a folder of data, such as an image stack, into its path.

    Raises `ValueError` as for `resolve_data_file`.
    """
    path, exists, is_file = _followed(text, folder=folder, allow_outside=allow_outside)
    if not exists or is_file:
        description = "a file" if exists else "which does not exist"
        raise ValueError(f"found {shown(text)}, {description}; expected a folder")
    return path


def natural(name: str) -> list[tuple[int, int, str]]:
    """Sort key in which slice 2 comes before slice 10.

    Examples
    --------
    >>> sorted(["slice10.png", "slice2.png"], key=natural)
    ['slice2.png', 'slice10.png']
    """
    pieces = re.split(r"(\d+)", name.lower())
    return [(1, int(p), "") if p.isdecimal() else (0, 0, p) for p in pieces]


def slices_with(file: Path) -> list[Path]:
    """The image stack that one image belongs to: files whose names differ in numbers only.

    Parameters
    ----------
    file : Path
        Of a suffix in `IMAGES`; for others the file alone is returned.

    Returns
    -------
    list of Path
        In the order of their numbers.

    Examples
    --------
    >>> slices_with(Path("part.stl"))  # no image: it is no slice of a stack
    [PosixPath('part.stl')]
    """
    if file.suffix.lower() not in IMAGES:
        return [file]
    form = _without_numbers(file.name)
    slices = [p for p in file.parent.iterdir() if _without_numbers(p.name) == form and p.is_file()]
    return sorted(slices, key=lambda p: natural(p.name))


def _without_numbers(name: str) -> str:
    return re.sub(r"\d+", "#", name.lower())


def _followed(text: str, *, folder: Path, allow_outside: bool) -> tuple[Path, bool, bool]:
    """Path of an allowed text, whether it exists, and whether it is a regular file."""
    _check_form(text)
    if not allow_outside:
        _check_inside(text)
    try:
        path = (folder / text).resolve()
        outside = not path.is_relative_to(folder.resolve())
        exists, is_file = path.exists(), path.is_file()
    except (OSError, RuntimeError) as error:
        # RuntimeError is a loop of links; OSError a name too long or a folder not readable
        raise ValueError(f"found {shown(text)}, which cannot be followed: {error}") from None
    if outside and not allow_outside:
        raise ValueError(
            f"found {shown(text)}, a link that leads outside the folder of the case; copy the "
            f"part there, or allow it with {_ARGUMENT}"
        )
    return path, exists, is_file


def _check_form(text: str) -> None:
    if not text.strip() or not text.isprintable() or len(text) > 1000:
        raise ValueError(f'found {shown(text)}; expected a file name such as "bracket.stl"')
    if text.startswith("~"):
        raise ValueError(
            f"found {shown(text)}; ~ is not expanded: write a path below the folder of the case, "
            f"or a full path together with {_ARGUMENT}"
        )
    drive = re.match(r"[A-Za-z]:[\\/]", text) is not None
    if _SCHEME.match(text) and not drive:
        raise ValueError(
            f"found {shown(text)}, an address; expected a path below the folder of the case, or "
            f"a full path together with {_ARGUMENT}"
        )


def _check_inside(text: str) -> None:
    windows, posix = PureWindowsPath(text), PurePosixPath(text)
    rooted = posix.is_absolute() or bool(windows.drive) or bool(windows.root)
    if rooted or ".." in posix.parts or ".." in windows.parts:
        raise ValueError(
            f"found {shown(text)}, which leads outside the folder of the case; copy the part "
            f"there, or allow it with {_ARGUMENT}"
        )


def _beside(folder: Path) -> list[str]:
    """Files in the folder of a case that may be parts."""
    return sorted(p.name for p in folder.iterdir() if p.is_file() and p.suffix != ".toml")


def _neighbours(text: str, folder: Path, suffixes: tuple[str, ...]) -> str:
    names = sorted(p.name for p in folder.iterdir() if p.suffix.lower() in suffixes)
    return instead(text, names, label="such files in the folder of the case")

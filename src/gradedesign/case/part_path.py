"""Which part files a case may name: those below its own folder, unless the user allows others."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath, PureWindowsPath

from gradedesign.case.suggest import instead, listed, shown

_READ = (".stl",)
_PLANNED = (".3mf", ".step", ".stp")
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_OPTION = "--allow-outside"


def resolve_part_file(text: str, *, folder: Path, allow_outside: bool) -> Path:
    """Turn the text of ``file`` into the path of an existing part file.

    Parameters
    ----------
    text : str
        As written in the case.
    folder : Path
        Folder of the case; relative paths start there.
    allow_outside : bool
        Whether the file may lie elsewhere.

    Returns
    -------
    Path
        Absolute, with links resolved.

    Raises
    ------
    ValueError
        If the path leaves the folder, is an address or abbreviation, does not exist, is no file,
        or has a suffix that is not read.
    """
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
            f"part there, or run with {_OPTION}"
        )
    _check_suffix(text)
    if not exists:
        raise ValueError(f"found {shown(text)}, which does not exist; {_neighbours(text, folder)}")
    if not is_file:
        raise ValueError(f"found {shown(text)}, which is not a regular file")
    return path


def _check_form(text: str) -> None:
    if not text.strip() or not text.isprintable() or len(text) > 1000:
        raise ValueError(f'found {shown(text)}; expected a file name such as "bracket.stl"')
    if text.startswith("~"):
        raise ValueError(
            f"found {shown(text)}; ~ is not expanded: write a path below the folder of the case, "
            f"or a full path together with {_OPTION}"
        )
    drive = re.match(r"[A-Za-z]:[\\/]", text) is not None
    if _SCHEME.match(text) and not drive:
        raise ValueError(
            f"found {shown(text)}, an address; expected a path below the folder of the case, or "
            f"a full path together with {_OPTION}"
        )


def _check_inside(text: str) -> None:
    windows, posix = PureWindowsPath(text), PurePosixPath(text)
    rooted = posix.is_absolute() or bool(windows.drive) or bool(windows.root)
    if rooted or ".." in posix.parts or ".." in windows.parts:
        raise ValueError(
            f"found {shown(text)}, which leads outside the folder of the case; copy the part "
            f"there, or run with {_OPTION}"
        )


def _check_suffix(text: str) -> None:
    suffix = PurePosixPath(text).suffix.lower()
    if suffix in _READ:
        return
    state = "not there yet" if suffix in _PLANNED else "not a part file"
    raise ValueError(f"found {shown(text)}, {state}; readable: {listed(_READ)}")


def _neighbours(text: str, folder: Path) -> str:
    names = sorted(p.name for p in folder.iterdir() if p.suffix.lower() in _READ)
    return instead(text, names, what="part files in the folder of the case")

"""Parts from STEP and IGES files, triangulated by OpenCASCADE in a process of its own.

A damaged file may crash OpenCASCADE, or keep it busy for ever: then its process ends, and the case
with a named error.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign import ExactSurface, FileFaces, PartError, RawTriangles, raw_triangles

#: Seconds that a file may take.
TIME_LIMIT_S = 600
#: Memory that a file may take, bytes.
_MEMORY_LIMIT = 12 * 2**30
#: Letters of the process' last words in a message.
_LAST_WORDS = 300


def read_step(path: Path, chord_tolerance: float | None = None) -> RawTriangles:
    """Read the solids of a STEP file (AP203, AP214, AP242).

    Parameters
    ----------
    chord_tolerance : float, mm, optional
        Largest distance of the triangles from the faces; by default a ten-thousandth of the
        diagonal.

    Raises
    ------
    PartError
        If the file is missing, damaged, empty, holds no closed solid, or cannot be triangulated.
    """
    return _read(path, "step", chord_tolerance)


def read_iges(path: Path, chord_tolerance: float | None = None) -> RawTriangles:
    """Read the solids of an IGES file; loose faces are sewn where they close one.

    Parameters and errors as `read_step`.
    """
    return _read(path, "iges", chord_tolerance)


def _read(path: Path, form: str, chord_tolerance: float | None) -> RawTriangles:
    try:
        with path.open("rb") as file:
            start = file.read(4096)
    except OSError as error:
        raise PartError(f"{path}: cannot be read ({error.strerror}); check the name") from error
    if form == "step" and b"ISO-10303-21" not in start:
        raise PartError(
            f"{path.name}: not a STEP file, it does not begin with ISO-10303-21; export it as "
            "AP214 or AP242"
        )
    with tempfile.TemporaryDirectory(prefix="gradedesign-step-") as folder:
        request = {
            "path": str(path.absolute()),
            "form": form,
            "chord_tolerance": chord_tolerance,
            "memory_limit": _MEMORY_LIMIT,
        }
        (Path(folder) / "request.json").write_text(json.dumps(request), encoding="utf-8")
        _run(folder, path.name)
        answer = json.loads((Path(folder) / "answer.json").read_text(encoding="utf-8"))
        if "error" in answer:
            raise PartError(f"{path.name}: {answer['error']}")
        with np.load(Path(folder) / "triangles.npz") as arrays:
            return _triangles(path.name, arrays, answer)


def _run(folder: str, source: str) -> None:
    """Let the process read, and blame the file for its end."""
    paths = [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    try:
        ended = subprocess.run(
            [sys.executable, "-m", "gradedesign_step._process", folder],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            timeout=TIME_LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise PartError(
            f"{source}: OpenCASCADE has not read it after {TIME_LIMIT_S} s; simplify the part, or "
            "state a larger [part] chord_tolerance"
        ) from error
    if ended.returncode != 0:
        words = ended.stderr.decode("utf-8", "replace").strip()[-_LAST_WORDS:]
        raise PartError(
            f"{source}: OpenCASCADE ended with code {ended.returncode} while reading it"
            f"{f' ({words})' if words else ''}; the file is damaged or too large: export it again"
        )


def _triangles(source: str, arrays: Mapping[str, Any], answer: Mapping[str, Any]) -> RawTriangles:
    """Triangles and faces as the core takes them."""
    faces = FileFaces(
        label=arrays["label"],
        names={int(number): name for number, name in answer["names"].items()},
        colors={int(number): color for number, color in answer["colors"].items()},
        surfaces={
            int(number): ExactSurface(
                kind=entry["kind"],
                axis=entry.get("axis"),
                point=entry.get("point"),
                diameter=entry.get("diameter"),
            )
            for number, entry in answer["surfaces"].items()
        },
    )
    return raw_triangles(
        arrays["corners"],
        source=source,
        unit=answer["unit"],
        faces=faces,
        warnings=answer["warnings"],
        chord_tolerance=answer["chord_tolerance"],
    )

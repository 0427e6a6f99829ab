"""The process that reads one CAD file: request.json in, answer.json and triangles.npz out."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

#: Length of one unit of the core, mm.
_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}


def main(folder: Path) -> None:
    """Read the file of a request."""
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    _limit_memory(request["memory_limit"])
    try:
        answer = _answer(request, folder)
    except _refusals() as error:
        answer = {"error": str(error)}
    (folder / "answer.json").write_text(json.dumps(answer), encoding="utf-8")


def _refusals() -> tuple[type[Exception], ...]:
    """Errors that a message answers: the binding is missing, or the file is refused."""
    try:
        from gradedesign_step._solids import FileRefused
    except ImportError:
        return (ImportError,)
    return (FileRefused,)


def _answer(request: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Write the triangles; return what is known about their faces."""
    try:
        from gradedesign_step._solids import read_solids
        from gradedesign_step._triangles import triangulate
    except ImportError as error:
        raise ImportError(
            f"reading it needs OpenCASCADE, which cannot be imported ({error}); "
            "pip install cadquery-ocp-novtk"
        ) from error
    solids = read_solids(request["path"], request["form"])
    mesh = triangulate(solids, request["chord_tolerance"])
    scale = 1.0 / _UNITS[solids.unit]
    np.savez(folder / "triangles.npz", corners=mesh.corners * scale, label=mesh.label)
    surfaces = {
        number: {key: _scaled(key, value, scale) for key, value in entry.items()}
        for number, entry in mesh.surfaces.items()
    }
    return {
        "unit": solids.unit,
        "names": {k: face.name for k, face in enumerate(solids.faces, 1) if face.name},
        "colors": {k: face.color for k, face in enumerate(solids.faces, 1) if face.color},
        "surfaces": surfaces,
        "warnings": list(solids.warnings),
        "chord_tolerance": mesh.chord_tolerance,
    }


def _scaled(key: str, value: Any, scale: float) -> Any:
    """Lengths of a surface in the file's unit."""
    if key == "point":
        return [entry * scale for entry in value]
    return value * scale if key == "diameter" else value


def _limit_memory(limit: int) -> None:
    """Let the system end the process beyond a limit, where it can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


if __name__ == "__main__":
    main(Path(sys.argv[1]))

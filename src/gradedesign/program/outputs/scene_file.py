"""``scene.json``: the scene of a run, which its report and `gradedesign preview` show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gradedesign.design.verdict.result import RunResult
from gradedesign.design.verdict.shown import Shown
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.mechanics.explicit.analysis import SurfaceFields
from gradedesign.mechanics.explicit.explicit import governing_load_case
from gradedesign.program.pictures.run_scene import RunShown, run_scene
from gradedesign.program.store.run_folder import RunFolder

_SCENE_NAME = "scene.json"


def write_scene(
    out: RunFolder, run: RunShown, title: str, files: dict[str, str]
) -> tuple[str, ...]:
    """Write the scene of a run; like a picture it never fails one."""
    try:
        data = run_scene(run, title)
    except GradeDesignError as cause:
        return (f"{_SCENE_NAME}: not written: {cause}",)
    out.write_text(_SCENE_NAME, json.dumps(data, separators=(",", ":"), allow_nan=False))
    files["scene"] = _SCENE_NAME
    return ()


def stored_scene(folder: Path) -> dict[str, Any]:
    """The scene that the run of a folder has written.

    Raises `CaseError` if it has written none.
    """
    try:
        data: dict[str, Any] = json.loads((folder / _SCENE_NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise CaseError(
            f"{folder} holds no {_SCENE_NAME}: its run has not ended, failed, or is of an earlier "
            f"version; run the case again, or preview the case"
        ) from None
    return data


def stored_still(result: RunResult) -> bytes | None:
    """PNG of the printed body of a stored run, or of what it came to; None without any."""
    pictures = (result.files.get(name, "") for name in ("lattice", "density", "loads"))
    still = next((path for name in pictures if (path := result.folder / name).is_file()), None)
    return None if still is None else still.read_bytes()


def fields_by_case(shown: Shown) -> dict[str, SurfaceFields]:
    """Fields of the analysed surface in every load case, the governing one first."""
    result = shown.analysed.result
    first = governing_load_case(result)
    others = (name for name in result.solved.load_cases if name != first)
    return {first: shown.fields} | {name: result.solved.surface_fields(name) for name in others}

"""Arrays as a page carries them: whole numbers, their differences, deflated, in base64.

The page unpacks them with the browser's ``DecompressionStream``, see ``page/scene.js``.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Steps into which the range of each column is divided: what 16 bits hold.
_STEPS = 65535
#: Of zlib: higher ones take several times as long for a few per cent. Chosen, not measured.
_EFFORT = 6


def packed(values: NDArray[Any], bits: int) -> dict[str, Any]:
    """Pack whole numbers ``(n,)`` or ``(n, k)`` of ``bits`` bits, not negative.

    Each column is stored as differences of neighbours, wrapped around, and each byte of a
    difference in a run of its own: neighbours are alike, so most high bytes are zero.
    """
    table = _columns(np.asarray(values))
    columns = np.ascontiguousarray(table.T).astype(f"<u{bits // 8}")
    differences = columns.copy()
    differences[:, 1:] -= columns[:, :-1]
    planes = differences.view(np.uint8).reshape(*columns.shape, bits // 8).transpose(0, 2, 1)
    deflated = zlib.compress(np.ascontiguousarray(planes).tobytes(), _EFFORT)
    data = base64.b64encode(deflated).decode("ascii")
    return {"bits": bits, "rows": len(table), "columns": table.shape[1], "data": data}


def quantised(values: FloatArray) -> dict[str, Any]:
    """Pack values ``(n,)`` or ``(n, k)`` to 65,536 levels between the ends of each column."""
    table = _columns(np.asarray(values, dtype=np.float64))
    lower = table.min(axis=0) if len(table) else np.zeros(table.shape[1])
    reach = np.ptp(table, axis=0) if len(table) else np.zeros(table.shape[1])
    step = reach / _STEPS
    levels = np.rint((table - lower) / np.where(step > 0, step, 1.0))
    return {"lower": lower.tolist(), "step": step.tolist(), **packed(levels.astype(np.int64), 16)}


def _columns(values: NDArray[Any]) -> NDArray[Any]:
    """Values as a table, one column where they are a list."""
    return values if values.ndim == 2 else values[:, None]


def packed_mesh(surface: SurfaceMesh) -> dict[str, Any]:
    """Pack a surface: its vertices within half a step of its box, its triangles as they are."""
    return {"vertices": quantised(surface.vertices), "triangles": packed(surface.faces, 32)}


def packed_corners(corners: FloatArray) -> dict[str, Any]:
    """Pack triangles ``(m, 3, 3)``, mm, whose equal corners become one vertex."""
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return packed_mesh(SurfaceMesh(vertices=vertices, faces=index.reshape(-1, 3)))

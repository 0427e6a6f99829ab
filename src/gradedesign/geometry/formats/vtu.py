"""Fields on tetrahedra and hexahedra as VTU files, for ParaView and its relatives."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.atomic import replacing
from gradedesign.geometry.tets.tet_mesh import TetMesh

_NAME = re.compile(r"\S.* \[\S+( \S+)*\]")
_CELL_TYPES = {4: "tetra", 8: "hexahedron", 10: "tetra10", 27: "hexahedron27"}


def write_vtu(
    path: Path,
    mesh: TetMesh | tuple[FloatArray, IntArray],
    *,
    point_data: Mapping[str, ArrayLike] | None = None,
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write tetrahedra or hexahedra with fields, atomically; fields are stored as float32.

    Raises ValueError if a field's name lacks its unit, as in ``"displacement [mm]"`` (``[-]`` for
    none), or its last axis does not match the mesh. Raises CaseError or ResourceError if the file
    cannot be written.

    ``mesh``: TetMesh or (points, elements); points ``(3, N)`` mm and elements ``(k, M)`` in VTK's
    order of nodes: tetrahedra of 4 or 10 (the last six on the edges 01, 12, 02, 03, 13, 23),
    hexahedra of 8 or 27. ``point_data``: field name to values ``(..., N)``, components first.
    ``cell_data``: field name to values ``(..., M)``.
    """
    import meshio

    points, elements = (mesh.points, mesh.tets) if isinstance(mesh, TetMesh) else mesh
    if points.ndim != 2 or len(points) != 3 or len(elements) not in _CELL_TYPES:
        raise ValueError(
            f"points {points.shape} and elements {elements.shape}: expected (3, N) and (k, M) "
            f"with k one of {', '.join(map(str, _CELL_TYPES))}"
        )
    at_points = _fields(point_data or {}, points.shape[1], "points")
    in_cells = _fields(cell_data or {}, elements.shape[1], "elements")
    grid = meshio.Mesh(
        np.ascontiguousarray(points.T),
        [(_CELL_TYPES[len(elements)], np.ascontiguousarray(elements.T))],
        point_data=at_points,
        cell_data={name: [values] for name, values in in_cells.items()},
    )
    # Opened first: it reports a folder that is missing or read-only as the case's error. The writer
    # takes a name, and empties and fills the same file.
    with replacing(path) as target:
        meshio.vtu.write(target.name, grid, header_type="UInt64")


def _as_attribute(name: str) -> str:
    """A name escaped for an XML attribute in ASCII, which the writer does not do."""
    escaped = escape(name, {'"': "&quot;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"})
    return escaped.encode("ascii", "xmlcharrefreplace").decode("ascii")


def _fields(
    data: Mapping[str, ArrayLike], count: int, where: str
) -> dict[str, NDArray[np.float32]]:
    """Fields as ``(count,)`` or ``(count, components)`` float32 arrays."""
    fields = {}
    for name, array in data.items():
        values = np.asarray(array, dtype=np.float32)
        if not _NAME.fullmatch(name):
            raise ValueError(f"field '{name}' lacks its unit; write for example '{name} [mm]'")
        if values.ndim == 0 or values.shape[-1] != count:
            raise ValueError(
                f"field '{name}' has shape {values.shape}, expected (..., {count}) for {where}"
            )
        flat = values.reshape(-1, count).T
        fields[_as_attribute(name)] = np.ascontiguousarray(flat[:, 0] if values.ndim == 1 else flat)
    return fields

"""Reading back the fields of a VTU file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import ParseError

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import CaseError
from gradedesign.mesh.tet_mesh import TetMesh, signed_volumes


def read_vtu_field(
    path: Path, name: str | None = None
) -> tuple[TetMesh, FloatArray, Literal["points", "elements"]]:
    """Read one scalar field on tetrahedra; of quadratic ones the corners.

    Parameters
    ----------
    path : Path
    name : str, optional
        Of the field; not needed where there is only one.

    Returns
    -------
    mesh : TetMesh
    values : (n,) array
    at : {"points", "elements"}
        What the values belong to.

    Raises
    ------
    CaseError
        If the file cannot be read, has no tetrahedra, or no such scalar field.
    """
    return _read(path, name, ())


def read_vtu_tensor(
    path: Path, name: str | None = None
) -> tuple[TetMesh, FloatArray, Literal["points", "elements"]]:
    """Read one field of symmetric tensors, or of directions, on tetrahedra.

    Parameters
    ----------
    path : Path
    name : str, optional
        Of the field; not needed where there is only one.

    Returns
    -------
    mesh : TetMesh
    values : (n, 3, 3) array
        From 9 components row by row, from 6 in VTK's order xx, yy, zz, xy, yz, xz, or from a
        direction v of 3 components, ``v v^T / |v|``.
    at : {"points", "elements"}
        What the values belong to.

    Raises
    ------
    CaseError
        As `read_vtu_field`.
    """
    mesh, values, at = _read(path, name, (3, 6, 9))
    if values.shape[1] == 9:
        full = values.reshape(-1, 3, 3)
        return mesh, 0.5 * (full + full.transpose(0, 2, 1)), at
    if values.shape[1] == 6:
        return mesh, values[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]], at
    size = np.maximum(np.linalg.norm(values, axis=1), 1e-300)
    return mesh, values[:, :, None] * values[:, None, :] / size[:, None, None], at


def _read(
    path: Path, name: str | None, widths: tuple[int, ...]
) -> tuple[TetMesh, FloatArray, Literal["points", "elements"]]:
    """Read one field of scalars, or of one of some numbers of components."""
    import meshio

    try:
        grid = meshio.vtu.read(path)
    except (OSError, ParseError, ValueError, KeyError, IndexError, meshio.ReadError) as error:
        raise CaseError(f"{path.name} cannot be read as VTU: {error}") from error
    found = [(i, block) for i, block in enumerate(grid.cells) if block.type in ("tetra", "tetra10")]
    if not found:
        kinds = ", ".join(sorted({block.type for block in grid.cells})) or "nothing"
        raise CaseError(f"{path.name} holds {kinds}; expected tetrahedra")
    fields: dict[tuple[str, Literal["points", "elements"]], FloatArray] = {}
    for key, data in grid.point_data.items():
        if _fits(data, widths):
            fields[key, "points"] = np.asarray(data, dtype=np.float64)
    for key, blocks in grid.cell_data.items():
        if all(_fits(blocks[i], widths) for i, _ in found):
            fields[key, "elements"] = np.concatenate(
                [np.asarray(blocks[i], dtype=np.float64) for i, _ in found]
            )
    chosen = [key for key in fields if name is None or key[0] == name]
    if len(chosen) != 1:
        names = ", ".join(f"'{key}' at {at}" for key, at in fields) or "none"
        kind = "scalar field" if not widths else "field of 3, 6 or 9 components"
        wanted = f"one {kind}" if name is None else f"the {kind} '{name}'"
        raise CaseError(f"{path.name}: expected {wanted}; it has: {names}; name it with field")
    corners = np.concatenate([block.data[:, :4] for _, block in found]).astype(np.int64)
    values = fields[chosen[0]]
    used = np.unique(corners)
    packed = np.searchsorted(used, corners)
    try:
        mesh = TetMesh(points=np.asarray(grid.points, dtype=np.float64)[used].T, tets=packed.T)
    except ValueError as error:
        raise CaseError(f"{path.name}: {error}") from error
    mesh = _turned(mesh, path.name)
    return mesh, values[used] if chosen[0][1] == "points" else values, chosen[0][1]


def _fits(data: FloatArray, widths: tuple[int, ...]) -> bool:
    """Whether values are scalars, or have one of some numbers of components."""
    if not widths:
        return data.ndim == 1
    return data.ndim == 2 and data.shape[1] in widths


def _turned(mesh: TetMesh, name: str) -> TetMesh:
    """Tetrahedra with positive volume; other programs number their corners either way."""
    volume = signed_volumes(mesh)
    if not (np.abs(volume) > 0).all():
        raise CaseError(f"{name}: {np.count_nonzero(volume == 0)} tetrahedra have no volume")
    tets = np.where(volume < 0, mesh.tets[[1, 0, 2, 3]], mesh.tets)
    return TetMesh(points=mesh.points, tets=tets)

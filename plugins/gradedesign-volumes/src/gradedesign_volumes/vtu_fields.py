"""Reading back the fields of a VTU file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError, TetMesh, signed_volumes
from gradedesign.fields import BoolArray, FloatArray
from gradedesign_volumes._vtu_arrays import VtuPiece, read_vtu_pieces

#: VTK's numbers of tetrahedra of 4 and 10 points, and of other cells, for messages.
_LINEAR = 10
_TETRAHEDRA = (_LINEAR, 24)
_OTHERS = {
    1: "vertex",
    3: "line",
    5: "triangle",
    9: "quad",
    11: "voxel",
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    22: "triangle6",
    25: "hexahedron20",
}
#: Largest coordinate, mm. No printable part reaches this far, as in `raw_triangles`.
_FARTHEST = 1e7
#: Bytes that reading a file may take, unless the case says so. The default of `[run] memory`.
_MEMORY = 8_000_000_000


def read_vtu_field(
    path: Path, name: str | None = None, *, memory_limit_bytes: int = _MEMORY
) -> tuple[TetMesh, FloatArray, Literal["points", "elements"]]:
    """Read one scalar field on tetrahedra; of quadratic ones the corners.

    Parameters
    ----------
    name : str, optional
        Of the field; not needed where there is only one.
    memory_limit_bytes : int
        What reading may take.

    Returns
    -------
    values : (n,) array
    at : {"points", "elements"}
        What the values belong to.

    Raises
    ------
    CaseError
        If the file cannot be read, has no tetrahedra, or no such scalar field.
    ResourceError
        If reading it takes more memory.
    """
    return _read(path, name, (), memory_limit_bytes)


def read_vtu_tensor(
    path: Path, name: str | None = None, *, memory_limit_bytes: int = _MEMORY
) -> tuple[TetMesh, FloatArray, Literal["points", "elements"]]:
    """Read one field of symmetric tensors, or of directions, on tetrahedra.

    Parameters
    ----------
    name : str, optional
        Of the field; not needed where there is only one.
    memory_limit_bytes : int
        What reading may take.

    Returns
    -------
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
    mesh, values, at = _read(path, name, (3, 6, 9), memory_limit_bytes)
    if values.shape[1] == 9:
        full = values.reshape(-1, 3, 3)
        return mesh, 0.5 * (full + full.transpose(0, 2, 1)), at
    if values.shape[1] == 6:
        return mesh, values[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]], at
    size = np.maximum(np.linalg.norm(values, axis=1), 1e-300)
    return mesh, values[:, :, None] * values[:, None, :] / size[:, None, None], at


def _read(
    path: Path, name: str | None, widths: tuple[int, ...], memory_limit_bytes: int
) -> tuple[TetMesh, FloatArray, Literal["points", "elements"]]:
    """Read one field of scalars, or of one of some numbers of components."""
    pieces = read_vtu_pieces(path, memory_limit_bytes)
    tets = [np.isin(piece.types, list(_TETRAHEDRA)) for piece in pieces]
    if not any(chosen.any() for chosen in tets):
        types = sorted({int(number) for piece in pieces for number in np.unique(piece.types)})
        kinds = ", ".join(_OTHERS.get(number, f"cells of type {number}") for number in types)
        raise CaseError(f"{path.name} holds {kinds or 'nothing'}; expected tetrahedra")
    fields = _joined_fields(pieces, tets, widths)
    chosen = [key for key in fields if name is None or key[0] == name]
    if len(chosen) != 1:
        names = ", ".join(f"'{key}' at {at}" for key, at in fields) or "none"
        kind = "scalar field" if not widths else "field of 3, 6 or 9 components"
        wanted = f"one {kind}" if name is None else f"the {kind} '{name}'"
        raise CaseError(f"{path.name}: expected {wanted}; it has: {names}; name it with field")
    values = fields[chosen[0]]
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    corners = np.concatenate(
        [
            _corners(piece, mask, path.name) + start
            for piece, mask, start in zip(pieces, tets, starts, strict=False)
        ]
    )
    points = np.concatenate([piece.points.astype(np.float64) for piece in pieces])
    used = np.unique(corners)
    if not (np.abs(points[used]) <= _FARTHEST).all():  # also where one is not finite
        raise CaseError(
            f"{path.name}: a point lies at {np.abs(points[used]).max():.4g} mm; expected "
            f"coordinates of at most {_FARTHEST:g} mm"
        )
    packed = np.searchsorted(used, corners)
    try:
        mesh = TetMesh(points=points[used].T, tets=packed.T)
    except ValueError as error:
        raise CaseError(f"{path.name}: {error}") from error
    mesh = _turned(mesh, path.name)
    return mesh, values[used] if chosen[0][1] == "points" else values, chosen[0][1]


def _joined_fields(
    pieces: list[VtuPiece], tets: list[BoolArray], widths: tuple[int, ...]
) -> dict[tuple[str, Literal["points", "elements"]], FloatArray]:
    """Fields that every piece has; those of elements on tetrahedra only."""
    fields: dict[tuple[str, Literal["points", "elements"]], FloatArray] = {}
    for key in pieces[0].point_data:
        at_points = [piece.point_data.get(key) for piece in pieces]
        joined = _joined([d for d in at_points if d is not None], len(pieces), widths)
        if joined is not None:
            fields[key, "points"] = joined
    for key in pieces[0].cell_data:
        in_cells = [
            data[mask]
            for piece, mask in zip(pieces, tets, strict=True)
            if (data := piece.cell_data.get(key)) is not None
        ]
        joined = _joined(in_cells, len(pieces), widths)
        if joined is not None:
            fields[key, "elements"] = joined
    return fields


def _joined(parts: list[NDArray[Any]], count: int, widths: tuple[int, ...]) -> FloatArray | None:
    """The values of all pieces, if every piece has some that fit."""
    if len(parts) != count or not all(_fits(part, widths) for part in parts):
        return None
    if len({part.shape[1:] for part in parts}) != 1:
        return None
    return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])


def _corners(piece: VtuPiece, mask: BoolArray, name: str) -> NDArray[np.int64]:
    """Corners ``(m, 4)`` of the tetrahedra of a piece."""
    start = np.concatenate([[0], piece.offsets[:-1]])[mask] if len(mask) else piece.offsets
    size = piece.offsets[mask] - start
    wanted = np.where(piece.types[mask] == _LINEAR, 4, 10)
    if (size != wanted).any():
        raise CaseError(
            f"{name} cannot be read as VTU: {np.count_nonzero(size != wanted)} tetrahedra do not "
            f"have 4, or of quadratic ones 10, points"
        )
    return piece.connectivity[start[:, None] + np.arange(4)]


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

"""Parts from OBJ, PLY, OFF and GLB files, decoded by trimesh behind checks of our own.

trimesh forgives much: it drops faces that it does not understand, and takes indices from the end of
an array. So each file is checked before, and the number of triangles after.
"""

from __future__ import annotations

import io
import re
import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign import FileFaces, PartError, RawTriangles, raw_triangles
from gradedesign.fields import FloatArray, IntArray
from gradedesign_formats.glb_plain import plain_glb
from gradedesign_formats.obj_plain import plain_obj

#: glTF 2.0, 3.4: all linear distances are in metres, and +Y is up.
_GLB_UNIT = "m"
#: Exceptions of decoding a damaged file. Lack of memory is left to whoever watches it.
_DAMAGE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    NameError,
    NotImplementedError,
    RecursionError,
    TypeError,
    ValueError,
    Warning,
    struct.error,
)
_COUNTS = re.compile(r"^\s*C?OFF\s+(\d+)\s+(\d+)(\s+\d+)?\s*$", flags=re.MULTILINE)


def read_obj(path: Path) -> RawTriangles:
    """Read the triangles of an OBJ file; groups, objects or materials are its faces.

    Colours of vertices count where all three of a triangle agree; files of materials are not read.

    Raises
    ------
    PartError
        If the file is missing, damaged, or holds faces that are not triangles.
    """
    with _decoding(path, "an OBJ file"):
        text, names, count = plain_obj(_bytes(path).decode("utf-8", "replace"), path.name)
        scene = _scene(text.encode(), "obj", split_groups=True) if count else None
        return _triangles(path, scene, count, name_of=names.get)


def read_ply(path: Path) -> RawTriangles:
    """Read the triangles of a PLY file; those of one colour are one face.

    Raises
    ------
    PartError
        As `read_obj`.
    """
    data = _bytes(path)
    with _decoding(path, "a PLY file"):
        scene = _scene(data, "ply")
        (mesh,) = scene.geometry.values()
        element = mesh.metadata["_ply_raw"]["face"]
        _require_three_corners(element["data"], path.name)
        return _triangles(path, scene, element["length"])


def read_off(path: Path) -> RawTriangles:
    """Read the triangles of an ASCII OFF file; it has no names, and its colours are not read.

    Raises
    ------
    PartError
        As `read_obj`.
    """
    data = _bytes(path)
    with _decoding(path, "an OFF file"):
        text = re.sub(r"#[^\n]*", "", data.decode("utf-8", "replace"))
        text = "\n".join(line for line in text.splitlines() if line.strip())
        counts = _COUNTS.match(text)
        if counts is None:
            raise PartError(f"{path.name}: not OFF, it does not begin with OFF and its counts")
        return _triangles(path, _scene(text.encode(), "off"), int(counts[2]))


def read_glb(path: Path) -> RawTriangles:
    """Read the triangles of a GLB file, in metres; bodies of one name and colour are one face.

    What is up in the file, its +Y, is +z of the part.

    Raises
    ------
    PartError
        If the file is missing, damaged, compressed, or refers to other files.
    """
    data = _bytes(path)
    with _decoding(path, "a GLB file"):
        plain, names, remarks = plain_glb(data, path.name)
        scene = _scene(plain, "glb")
        return _triangles(path, scene, None, name_of=names.get, unit=_GLB_UNIT, remarks=remarks)


def y_up(points: FloatArray) -> FloatArray:
    """Points ``(..., 3)`` in the axes of glTF, whose Y is our z."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x, z, -y], axis=-1)


def _z_up(points: FloatArray) -> FloatArray:
    """Points ``(..., 3)`` of glTF in our axes."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x, -z, y], axis=-1)


def _require_three_corners(data: Any, source: str) -> None:
    """Refuse lists of other than three corners in binary PLY, which trimesh reads as if equal."""
    for name in getattr(getattr(data, "dtype", None), "names", None) or ():
        if data.dtype[name].names and name.startswith("vertex") and (data[name]["f0"] != 3).any():
            raise PartError(f"{source}: faces must be triangles; export it triangulated")


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise PartError(f"{path}: cannot be read ({error.strerror}); check the name") from error


@contextmanager
def _decoding(path: Path, format_name: str) -> Iterator[None]:
    """Turn whatever decoding raises into one error that names the file."""
    import trimesh  # noqa: F401 - what importing it warns of is no damage

    try:
        with warnings.catch_warnings(), np.errstate(invalid="ignore", over="ignore"):
            warnings.simplefilter("error")
            yield
    except _DAMAGE as error:
        raise PartError(
            f"{path.name}: damaged, or not {format_name} ({type(error).__name__}: "
            f"{str(error)[:120]}); export or copy it again"
        ) from error


def _scene(data: bytes, kind: str, **options: Any) -> Any:
    """Decode without merging, reordering, or reading another file."""
    import trimesh

    return trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **options)


def _triangles(
    path: Path,
    scene: Any,
    count: int | None,
    *,
    name_of: Callable[[str], str | None] | None = None,
    unit: str | None = None,
    remarks: tuple[str, ...] = (),
) -> RawTriangles:
    """Triangles of every body where it is placed; ``count`` of them, where that is known."""
    corners, label = [np.zeros((0, 3, 3))], [np.zeros(0, dtype=np.int64)]
    marks: dict[tuple[str | None, str | None], int] = {}
    nodes = [] if scene is None else list(scene.graph.nodes_geometry)
    if name_of is not None:  # groups and bodies are numbered in the order of the file
        nodes.sort(key=lambda node: int(node.partition("_")[0]))
    for node in nodes:
        matrix, body = scene.graph[node]
        mesh = scene.geometry[body]
        faces = np.asarray(mesh.faces)
        if faces.size and not 0 <= faces.min() <= faces.max() < len(mesh.vertices):
            raise PartError(
                f"{path.name}: faces use the vertices {faces.min()} to {faces.max()}, "
                f"{len(mesh.vertices)} are there; export or copy the file again"
            )
        placed = np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        placed = placed if unit is None else _z_up(placed)
        turned = faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else faces
        corners.append(placed[turned])
        if mesh.metadata.get("from_gltf_primitive"):
            node = scene.graph.transforms.parents[node]
        name = None if name_of is None else name_of(body if unit is None else node)
        label.append(_labels(name, _colors(mesh), marks))
    soup = np.concatenate(corners)
    if count is not None and len(soup) != count:
        raise PartError(
            f"{path.name}: declares {count} faces, {len(soup)} triangles are there; export it "
            "triangulated, or copy the file again"
        )
    faces_of_file = None
    if set(marks) - {(None, None)}:
        faces_of_file = FileFaces(
            label=np.concatenate(label),
            names={n: name for (name, _), n in marks.items() if name is not None},
            colors={n: color for (_, color), n in marks.items() if color is not None},
        )
    return raw_triangles(soup, source=path.name, unit=unit, faces=faces_of_file, warnings=remarks)


def _labels(
    name: str | None, colors: IntArray, marks: dict[tuple[str | None, str | None], int]
) -> IntArray:
    """Numbers of faces for colours ``(m,)`` of a body; a new name and colour gets the next."""
    values, first, index = np.unique(colors, return_index=True, return_inverse=True)
    order = np.argsort(first)
    values, index = values[order], np.argsort(order)[index.ravel()]
    pairs = [(name, None if value < 0 else f"#{value:06x}") for value in values.tolist()]
    numbers = np.array([marks.setdefault(pair, len(marks)) for pair in pairs], dtype=np.int64)
    return np.asarray(numbers[index])


def _colors(mesh: Any) -> IntArray:
    """Colour of every triangle as one number, ``(m,)``; -1 where it has none or several."""
    visual = mesh.visual
    none = np.full(len(mesh.faces), -1, dtype=np.int64)
    if visual.kind == "texture":
        factor = getattr(visual.material, "baseColorFactor", None)
        return none if factor is None else np.full_like(none, _number(np.asarray(factor)))
    if visual.kind == "face":
        return _number(np.asarray(visual.face_colors))
    if visual.kind == "vertex":
        corners = _number(np.asarray(visual.vertex_colors))[mesh.faces]
        return np.where((corners == corners[:, :1]).all(axis=1), corners[:, 0], none)
    return none


def _number(colors: FloatArray) -> IntArray:
    """Colours ``(..., 3 or 4)`` of 0 to 255 as one number each; alpha is ignored."""
    red, green, blue = np.moveaxis(np.asarray(colors)[..., :3].astype(np.int64), -1, 0)
    return np.asarray((red << 16) + (green << 8) + blue)

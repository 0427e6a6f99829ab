"""A GLB file reduced to its triangles, names and plain colours, checked before it is decoded."""

from __future__ import annotations

import json
import struct
from typing import Any, NoReturn

from gradedesign import PartError

_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"
#: Bytes of a number, and numbers in an item, by the codes of glTF 2.0 (3.6.2.2).
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
#: glTF 2.0, table in 3.6.2.2: numbers in an item of each type.
_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
#: Modes of a primitive in glTF 2.0 (5.24.4).
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_KEPT = ("asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "materials")
#: An assembly that repeats its bodies may grow to no more triangles. Chosen, not measured.
_MOST_TRIANGLES = 20_000_000


def plain_glb(data: bytes, source: str) -> tuple[bytes, dict[str, str], tuple[str, ...]]:
    """Rewrite a GLB file without all that is no solid: textures, cameras, lines, extensions.

    Returns
    -------
    data : bytes
        Of a GLB file in which every node is named by its number.
    names : dict of str to str
        Names of bodies by that number: of the node, else of its mesh.

    Raises
    ------
    PartError
        If the file is damaged, refers to another file, needs an extension, or declares more than
        it holds.
    KeyError, TypeError, ValueError, ...
        Where its description is malformed.
    """
    header, binary = _chunks(data, source)
    required = header.get("extensionsRequired")
    if required:
        _refuse(source, f"needs the extensions {', '.join(map(str, required))}; export it plain")
    if any("uri" in buffer for buffer in header.get("buffers", [])):
        _refuse(source, "keeps its triangles in another file; export it as one GLB file")
    plain = {key: header[key] for key in _KEPT if key in header}
    plain.setdefault("materials", [])
    plain["buffers"] = [{"byteLength": len(binary)}] * bool(binary)
    _require_within_file(plain, len(binary), source)
    dropped = _only_triangles(plain, source)
    names = _number_nodes(plain, source)
    warnings = (f"{source}: {dropped} sets of lines or points ignored",) if dropped else ()
    return _joined(plain, binary), names, warnings


def _refuse(source: str, why: str) -> NoReturn:
    raise PartError(f"{source}: {why}")


def _chunks(data: bytes, source: str) -> tuple[dict[str, Any], bytes]:
    """Description and binary chunk of a GLB file."""
    if data[:4] != _MAGIC:
        _refuse(source, "not GLB, it does not begin with glTF; export the part as binary glTF")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2 or length != len(data):
        _refuse(
            source,
            f"declares glTF {version} and {length} bytes, holds {len(data)}; expected glTF 2 and "
            "the size of the file; export or copy it again",
        )
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at < len(data):
        size, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + size > len(data):
            _refuse(source, f"a chunk of {size} bytes is cut; export or copy the file again")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    header = json.loads(chunks[_JSON])
    if not isinstance(header, dict):
        _refuse(source, "its description is no table; export it again")
    return header, chunks.get(_BIN, b"")


def _require_within_file(plain: dict[str, Any], byte_count: int, source: str) -> None:
    """Refuse views and accessors that reach beyond the bytes of the file."""
    views = plain.get("bufferViews", [])
    for view in views:
        start, size = view.get("byteOffset", 0), view["byteLength"]
        if view["buffer"] != 0 or not 0 <= start <= start + size <= byte_count:
            _refuse(
                source, f"a view reaches to byte {start + size} of {byte_count}; export it again"
            )
    for number, accessor in enumerate(plain.get("accessors", [])):
        if "bufferView" not in accessor or "sparse" in accessor:
            _refuse(source, f"accessor {number} is sparse or compressed; export it plain")
        view = views[accessor["bufferView"]]
        count, start = accessor["count"], accessor.get("byteOffset", 0)
        item = _BYTES[accessor["componentType"]] * _NUMBERS[accessor["type"]]
        stride = view.get("byteStride", item)
        if not isinstance(count, int) or not (count > 0 and start >= 0 and stride >= item):
            _refuse(source, f"accessor {number} counts {count} items from byte {start}; damaged")
        if start + (count - 1) * stride + item > view["byteLength"]:
            _refuse(
                source,
                f"accessor {number} declares {count} items, its view holds {view['byteLength']} "
                "bytes; export or copy the file again",
            )


def _only_triangles(plain: dict[str, Any], source: str) -> int:
    """Reduce materials and primitives; returns how many sets of lines and points are left out."""
    plain["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": base["baseColorFactor"]}}
        if "baseColorFactor" in (base := material.get("pbrMetallicRoughness", {}))
        else {}
        for material in plain["materials"]
    ]
    dropped = 0
    for mesh in plain.get("meshes", []):
        primitives = []
        for triangles in mesh["primitives"]:
            mode = triangles.get("mode", _TRIANGLES)
            if mode == _FAN or triangles.get("extensions"):
                _refuse(source, "holds triangle fans or compressed triangles; export it plain")
            if mode not in (_TRIANGLES, _STRIP):
                dropped += 1
                continue
            attributes = triangles["attributes"]
            lean = {
                "mode": mode,
                "attributes": {
                    k: attributes[k] for k in ("POSITION", "COLOR_0") if k in attributes
                },
            }
            if "indices" in triangles:
                lean["indices"] = triangles["indices"]
            material = triangles.get("material")
            if material is not None and plain["materials"][material]:
                lean["material"] = material
                lean["attributes"].pop("COLOR_0", None)
            primitives.append(lean)
        mesh["primitives"] = primitives
        mesh.pop("extras", None)
        mesh.pop("extensions", None)
    return dropped


def _number_nodes(plain: dict[str, Any], source: str) -> dict[str, str]:
    """Name nodes by their number; returns their own names. Refuses cycles and shared nodes."""
    nodes = plain.get("nodes", [])
    meshes = plain.get("meshes", [])
    children = [child for node in nodes for child in node.get("children", [])]
    children += [root for scene in plain.get("scenes", [])[:1] for root in scene.get("nodes", [])]
    if len(set(children)) != len(children) or any(
        not isinstance(child, int) or not 0 <= child < len(nodes) for child in children
    ):
        _refuse(source, "its bodies are not placed in a tree; export it again")
    plain["scene"] = 0
    names, total = {}, 0
    for number, node in enumerate(nodes):
        mesh = meshes[node["mesh"]] if "mesh" in node else {"primitives": []}
        name = node.get("name") or mesh.get("name")
        if isinstance(name, str) and name.strip():
            names[str(number)] = name.strip()
        for triangles in mesh["primitives"]:
            at = triangles.get("indices", triangles["attributes"]["POSITION"])
            total += plain["accessors"][at]["count"] // 3
        node_keys = ("children", "matrix", "translation", "rotation", "scale", "mesh")
        nodes[number] = {key: node[key] for key in node_keys if key in node} | {"name": str(number)}
    if total > _MOST_TRIANGLES:
        _refuse(
            source,
            f"its bodies have {total} triangles where they are placed, at most {_MOST_TRIANGLES} "
            "are read; export it coarser",
        )
    return names


def _joined(plain: dict[str, Any], binary: bytes) -> bytes:
    """Bytes of a GLB file."""
    text = json.dumps(plain).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    body = struct.pack("<I4s", len(text), _JSON) + text
    if binary:
        body += struct.pack("<I4s", len(binary), _BIN) + binary
    return _MAGIC + struct.pack("<II", 2, 12 + len(body)) + body

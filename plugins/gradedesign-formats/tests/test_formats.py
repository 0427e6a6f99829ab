"""OBJ, PLY, OFF and GLB: what is read, what is written, and what is refused by name."""

import json
import struct

import numpy as np
import pytest
import trimesh

from gradedesign.errors import PartError
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign_formats.read_trimesh import read_glb, read_obj, read_off, read_ply
from gradedesign_formats.write_ply import export_ply
from gradedesign_formats.write_trimesh import export_glb, export_obj, export_off

READ = {"obj": read_obj, "ply": read_ply, "off": read_off, "glb": read_glb}
WRITE = {"obj": export_obj, "ply": export_ply, "off": export_off, "glb": export_glb}
#: 10 x 5 x 2 mm.
BOX = trimesh.creation.box((10.0, 5.0, 2.0))


def volume(corners):
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def store(folder, kind, data):
    path = folder / f"part.{kind}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def painted(colors):
    mesh = BOX.copy()
    mesh.visual.face_colors = colors
    return mesh


TWO = painted([[255, 0, 0, 255]] * 4 + [[0, 128, 255, 255]] * 8)
OBJ = """
mtllib ../../etc/passwd
o body
v 0 0 0 # corner
v 6 0 0
v 0 6 0
v 0 0 6
vn 0 0 1
g skirt
usemtl red
f 1 3 2
f 1/1 2/2/1 4//1
g bolt hole
f 1 4 \\
3
g
usemtl blue
f 2 3 4
"""


@pytest.mark.parametrize("kind", READ)
def test_what_is_written_is_read_and_says_what_it_is(tmp_path, kind):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=7.0)
    surface = SurfaceMesh(vertices=ball.vertices + np.array([30.0, 0.0, 0.0]), faces=ball.faces)
    lattice = PrintedLattice(
        surface=surface,
        name="b\nall",
        version="0.1.0",
        case_hash="abc",
        material="PA12",
        mass_g=1.5,
    )
    path = tmp_path / f"lattice.{kind}"
    WRITE[kind](path, lattice)
    raw = READ[kind](path)
    assert raw.unit == ("m" if kind == "glb" else None)
    scale = 1000.0 if kind == "glb" else 1.0
    assert volume(raw.corners * scale) == pytest.approx(enclosed_volume(surface), rel=1e-5)
    np.testing.assert_allclose(
        raw.corners * scale, surface.vertices[surface.faces], rtol=0, atol=4e-6
    )
    head = path.read_bytes()[:4000].decode("utf-8", "replace")
    for words in ("PA12", "0.1.0", "abc", "1.5"):
        assert words in head
    # Another reader takes it too.
    other = trimesh.load_mesh(path).volume
    assert other * scale**3 == pytest.approx(enclosed_volume(surface), rel=1e-5)


def test_glb_is_in_metres_with_y_up(tmp_path):
    """glTF 2.0, 3.4: what is up in the case, +z, is +y of the file, right-handed still."""
    block = trimesh.creation.box((10.0, 20.0, 40.0))
    block.apply_translation((105.0, 210.0, 320.0))
    surface = SurfaceMesh(vertices=block.vertices, faces=block.faces)
    path = tmp_path / "block.glb"
    export_glb(path, PrintedLattice(surface=surface, name="block"))
    other = trimesh.load_mesh(path)
    np.testing.assert_allclose(
        other.bounds, [[0.100, 0.300, -0.220], [0.110, 0.340, -0.200]], rtol=0, atol=1e-7
    )
    assert other.volume == pytest.approx(8000.0e-9, rel=1e-5)
    raw = read_glb(path)
    np.testing.assert_allclose(raw.corners * 1000.0, block.vertices[block.faces], rtol=0, atol=4e-5)


@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_colours_of_ply_are_its_faces(tmp_path, encoding):
    raw = read_ply(store(tmp_path, "ply", TWO.export(file_type="ply", encoding=encoding)))
    assert raw.unit is None
    assert volume(raw.corners) == pytest.approx(100.0)
    assert raw.faces.label.tolist() == [0] * 4 + [1] * 8
    assert dict(raw.faces.colors) == {0: "#ff0000", 1: "#0080ff"}
    assert not raw.faces.names


def test_colours_of_vertices_count_where_a_triangle_has_one(tmp_path):
    mesh = BOX.copy()
    mesh.visual.vertex_colors = [[255, 0, 0, 255]] * 7 + [[0, 0, 0, 255]]
    one = ~(mesh.faces == 7).any(axis=1)
    for kind in ("ply", "obj"):
        raw = READ[kind](store(tmp_path, kind, mesh.export(file_type=kind)))
        (number,) = raw.faces.colors
        assert raw.faces.colors[number] == "#ff0000"
        np.testing.assert_array_equal(raw.faces.label == number, one)


def test_groups_objects_and_materials_of_obj_are_its_faces(tmp_path):
    raw = read_obj(store(tmp_path, "obj", OBJ))
    assert volume(raw.corners) == pytest.approx(36.0)
    assert [raw.faces.names[n] for n in raw.faces.label] == ["skirt"] * 2 + ["bolt hole", "body"]
    only = OBJ.replace("o body\n", "").replace("g skirt\n", "").replace("g bolt hole\n", "")
    raw = read_obj(store(tmp_path, "obj", only))
    assert [raw.faces.names[n] for n in raw.faces.label] == ["red"] * 3 + ["blue"]
    assert read_obj(store(tmp_path, "obj", BOX.export(file_type="obj"))).faces is None


def scene(**nodes):
    whole = trimesh.Scene()
    red = trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 0, 0, 255], doubleSided=True)
    for name, matrix in nodes.items():
        mesh = trimesh.Trimesh(BOX.vertices, BOX.faces, process=False)
        mesh.visual = trimesh.visual.TextureVisuals(material=red)
        whole.add_geometry(mesh, node_name=name, geom_name=f"of {name}", transform=matrix)
    return whole.export(file_type="glb")


MIRRORED = np.diag([-1.0, 2.0, 1.0, 1.0])
MIRRORED[0, 3] = 50.0


def test_bodies_of_glb_are_placed_named_and_coloured(tmp_path):
    raw = read_glb(store(tmp_path, "glb", scene(bolt=np.eye(4), lug=MIRRORED)))
    assert raw.unit == "m"
    assert volume(raw.corners) == pytest.approx(300.0)
    assert dict(raw.faces.names) == {0: "bolt", 1: "lug"}
    assert set(raw.faces.colors.values()) == {"#ff0000"}
    lug = raw.corners[raw.faces.label == 1].reshape(-1, 3)
    # Of the file 45 to 55, -5 to 5, -1 to 1; its y is up.
    np.testing.assert_allclose([lug.min(0), lug.max(0)], [[45, -1, -5], [55, 1, 5]])
    assert volume(raw.corners[raw.faces.label == 1]) == pytest.approx(200.0)  # still outward


def edited(change, data=None):
    """A GLB file with another description."""
    data = scene(bolt=np.eye(4), lug=MIRRORED) if data is None else data
    size = struct.unpack_from("<I", data, 12)[0]
    tree = json.loads(data[20 : 20 + size])
    change(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = struct.pack("<I4s", len(text), b"JSON") + text + data[20 + size :]
    return b"glTF" + struct.pack("<II", 2, 12 + len(rest)) + rest


def set_at(*path, value):
    def change(tree):
        for key in path[:-1]:
            tree = tree[key]
        tree[path[-1]] = value

    return change


def loop(tree):
    tree["nodes"] = [{"mesh": 0, "children": [1]}, {"children": [0]}]
    tree["scenes"] = [{"nodes": [0]}]


GLB = {
    "external": (set_at("buffers", value=[{"uri": "/etc/passwd"}]), "in another file"),
    "extension": (set_at("extensionsRequired", value=["KHR_draco"]), "needs the ext.*KHR_draco"),
    "no bytes": (set_at("accessors", 0, value={"count": 10**12, "type": "VEC3"}), "compressed"),
    "huge": (set_at("accessors", 0, "count", value=10**12), "declares 1000000000000 items"),
    "negative": (set_at("accessors", 0, "count", value=-1), "counts -1"),
    "view": (set_at("bufferViews", 0, "byteLength", value=10**9), "reaches to byte"),
    "fan": (set_at("meshes", 0, "primitives", 0, "mode", value=6), "fans"),
    "loop": (loop, "tree"),
    "root": (set_at("scenes", 0, "nodes", value=[99]), "tree"),
    "text": (set_at("nodes", value="none"), "damaged, or not a GLB file"),
}


@pytest.mark.parametrize(("change", "words"), GLB.values(), ids=GLB)
def test_a_wrong_glb_is_refused_by_name(tmp_path, change, words):
    with pytest.raises(PartError, match=f"part.glb: .*{words}"):
        read_glb(store(tmp_path, "glb", edited(change)))


def test_an_assembly_that_grows_too_large_is_refused_before_it_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr("gradedesign_formats.glb_plain._MOST_TRIANGLES", 23)
    with pytest.raises(PartError, match=r"have 24 triangles where they are placed, at most 23"):
        read_glb(store(tmp_path, "glb", scene(bolt=np.eye(4), lug=MIRRORED)))


def test_lines_of_a_glb_are_left_out_aloud(tmp_path):
    data = edited(set_at("meshes", 0, "primitives", 0, "mode", value=1))
    raw = read_glb(store(tmp_path, "glb", data))
    assert len(raw.corners) == 12
    assert raw.warnings == ("part.glb: 1 sets of lines or points ignored",)


def text(kind, mesh=BOX):
    data = mesh.export(file_type=kind, **({"encoding": "ascii"} if kind == "ply" else {}))
    return data if isinstance(data, str) else data.decode()


QUAD = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
PLY_QUAD = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
1 1 0
0 1 0
4 0 1 2 3
"""
REFUSED = {
    "obj quad": ("obj", "v 0 0 0\nf 1 1 1 1\n", "obj:2: a face of 4 corners; export it triang"),
    "obj relative": ("obj", "v 0 0 0\nf -1 -1 -1\n", "obj:2: a face of corners -1 -1 -1"),
    "obj beyond": ("obj", "v 0 0 0\nf 1 1 2\n", "uses vertex 2, the file holds 1"),
    "obj words": ("obj", "v 0 x 0\nf 1 1 1\n", "damaged, or not an OBJ file"),
    "obj flat": ("obj", "v 0 0\nf 1 1 1\n", "obj:1: a vertex of 2 numbers"),
    "obj none": ("obj", "solid\n", "no triangles"),
    "obj nan": ("obj", "v nan 0 0\nf 1 1 1\n", "NaN or infinite"),
    "off quad": ("off", QUAD, "declares 1 faces, 2 triangles are there"),
    "off cut": ("off", text("off")[:-12], "declares 12 faces, 10 triangles"),
    "off not": ("off", "PLY 1 2 3", "not OFF"),
    "off count": ("off", text("off").replace("8 12", "8000000000000 12"), "damaged"),
    "ply quad": ("ply", PLY_QUAD, "declares 1 faces, 2 triangles are there"),
    "ply many": ("ply", text("ply").replace("vertex 8", "vertex 900000000000"), "damaged"),
    "ply not": ("ply", "solid x", "damaged, or not a PLY file"),
    "ply empty": ("ply", "", "damaged, or not a PLY file"),
    "glb not": ("glb", "solid x", "not GLB"),
    "glb cut": ("glb", scene(bolt=np.eye(4))[:-8], "holds"),
}


@pytest.mark.parametrize(("kind", "data", "words"), REFUSED.values(), ids=REFUSED)
def test_damaged_files_are_refused_by_name(tmp_path, kind, data, words):
    with pytest.raises(PartError, match=words) as told:
        READ[kind](store(tmp_path, kind, data))
    assert f"part.{kind}" in str(told.value)


@pytest.mark.parametrize("kind", READ)
def test_a_missing_file_is_named(tmp_path, kind):
    with pytest.raises(PartError, match="cannot be read"):
        READ[kind](tmp_path / f"absent.{kind}")


BLOCK = """
[case]
name = "block"
[part]
file = "block.ply"
units = "mm"
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.3
[output]
formats = ["stl", "obj", "ply", "off", "glb"]
"""


def test_a_block_is_read_from_ply_and_its_lattice_written_in_every_format(tmp_path, cli):
    painted = trimesh.creation.box(bounds=[[0, 0, 0], [10, 5, 5]])
    painted.visual.face_colors = [[255, 0, 0, 255]] * 12
    (tmp_path / "block.ply").write_bytes(painted.export(file_type="ply"))
    (tmp_path / "case.toml").write_text(BLOCK, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    for name in ("stl", *WRITE):
        mesh = trimesh.load_mesh(tmp_path / "out" / f"lattice.{name}")
        scale = 1e9 if name == "glb" else 1.0  # metres
        assert mesh.volume * scale == pytest.approx(result["measures"]["volume_mm3"], rel=1e-4)
        assert mesh.is_watertight or name == "glb"

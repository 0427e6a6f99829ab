"""Density maps that are damaged, or state more than there is, end in an error that names them."""

import base64
import io
import struct
import zlib

import meshio
import numpy as np
import pytest
import pyvista
from oracles.peak_memory import peak_memory_bytes
from PIL import Image

from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.formats.vtu import write_vtu
from gradedesign.geometry.lattice.density_source import sample_density
from gradedesign.geometry.lattice.tet_density import tet_density
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign_volumes.image_stack import read_image_stack
from gradedesign_volumes.point_cloud import read_points, remap_points
from gradedesign_volumes.voxel_density import read_voxel_array
from gradedesign_volumes.vtu_fields import read_vtu_field

GB = 10**9
VOXELS = np.linspace(0.1, 0.5, 24).reshape(4, 3, 2)


def npy(values, *, version=(1, 0)):
    file = io.BytesIO()
    np.lib.format.write_array(file, values, version=version, allow_pickle=True)
    return file.getvalue()


def header(text):
    text = text.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


@pytest.mark.parametrize(
    "values",
    [VOXELS, np.asfortranarray(VOXELS), VOXELS.astype(">f4"), (VOXELS * 99).astype(np.uint16)],
    ids=["c", "fortran", "big-endian", "grey"],
)
@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_arrays_are_read_as_numpy_reads_them(tmp_path, values, version):
    (tmp_path / "a.npy").write_bytes(npy(values, version=version))
    found = read_voxel_array(tmp_path / "a.npy", memory_limit_bytes=GB)
    assert found.dtype == values.dtype
    np.testing.assert_array_equal(found, values)


DAMAGED = {
    "zip": (b"PK\x03\x04" + bytes(60), "archive"),
    "text": (b"0.1 0.2", "numpy.save"),
    "empty": (b"", "numpy.save"),
    "version": (b"\x93NUMPY\x09\x00" + bytes(99), "version 9"),
    "cut header": (npy(VOXELS)[:9], "header is damaged"),
    "open brace": (header("{'descr': '<f8', 'shape': ((((((("), "header is damaged"),
    "nothing": (header(""), "header is damaged"),
    "keys": (header("{'descr': '<f8'}"), "expected the keys"),
    "objects": (npy(np.array([{}], dtype=object)), "type '|O'"),
    "type": (header("{'descr': '<f3', 'fortran_order': False, 'shape': (1, 1, 1)}"), "no type"),
    "shape": (
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 1, 1)}"),
        r"shape \(-1, 1, 1\)",
    ),
    "huge": (
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (9" + "0" * 40 + ", 1, 1)}"),
        "states the shape",
    ),
    "cut": (npy(VOXELS)[:-1], r"states 4 x 3 x 2 .* 192 bytes, but 191 bytes follow"),
    "longer": (npy(VOXELS) + b"x", "193 bytes follow"),
}


@pytest.mark.parametrize(("content", "words"), DAMAGED.values(), ids=DAMAGED)
def test_damaged_arrays_are_named(tmp_path, content, words):
    (tmp_path / "a.npy").write_bytes(content)
    for read in (read_voxel_array, read_points):
        with pytest.raises(CaseError, match=rf"a\.npy cannot .*{words}"):
            read(tmp_path / "a.npy", memory_limit_bytes=GB)


def test_a_claim_of_1e15_values_is_compared_with_the_file(tmp_path):
    # Before the mend: "use a coarser mesh", as of any lack of memory.
    claim = header("{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 100000, 100000)}")
    (tmp_path / "a.npy").write_bytes(claim + bytes(64))
    with pytest.raises(CaseError, match=r"1e\+15 values .* 8e\+15 bytes, but 64 bytes follow"):
        read_voxel_array(tmp_path / "a.npy", memory_limit_bytes=GB)


def test_an_array_larger_than_the_budget_is_refused_unread(tmp_path):
    (tmp_path / "a.npy").write_bytes(npy(VOXELS))
    with pytest.raises(ResourceError, match=r"4 x 3 x 2 .* found run\.memory of 1e-07 GB"):
        read_voxel_array(tmp_path / "a.npy", memory_limit_bytes=100)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,0,0,0.2\n1,1,1," + "9" * 131_073 + "\n", r"p\.csv:2: found a line of more than"),
        ("0,0,0,0.2\n" + "1 " * 1000 + "\n", r"p\.csv:2: found a line of more than"),
        ("0,0,0,0.2\n1e300,1,1,0.3\n", "point 2 lies at"),
        ("0,0,0,0.2\n1,1,1,1e999\n", "point 2 is not finite"),
    ],
    ids=["csv-field", "columns", "far", "infinite"],
)
def test_odd_rows_of_points_are_named(tmp_path, text, words):
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(CaseError, match=words):
        read_points(tmp_path / "p.csv", memory_limit_bytes=GB)


def test_points_count_against_the_memory(tmp_path):
    (tmp_path / "p.csv").write_text("0,0,0,0.2\n1,1,1,0.3\n")
    with pytest.raises(ResourceError, match=r"p\.csv has .* found run\.memory"):
        read_points(tmp_path / "p.csv", memory_limit_bytes=100)
    points, values = read_points(tmp_path / "p.csv", memory_limit_bytes=GB)
    with pytest.raises(ResourceError, match=r"run\.memory of 0\.1 GB .* larger spacing"):
        remap_points(points, values, 0.001, memory_limit_bytes=GB // 10)


def test_a_density_grid_counts_against_the_memory():
    with pytest.raises(ResourceError, match=r"run\.memory of 0\.1 GB"):
        sample_density(
            lambda p: 0 * p[0] + 0.3,
            lambda p: p[0] - 1,
            [0, 0, 0],
            [100, 100, 100],
            spacing=0.5,
            window=(0.1, 0.5),
            quantity="test",
            memory_limit_bytes=GB // 10,
        )


def png(columns, rows):
    """A grey image of any size in some kB: rows of zeros, compressed."""

    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    packer = zlib.compressobj(9)
    row = bytes(columns + 1)
    data = b"".join(packer.compress(row) for _ in range(rows)) + packer.flush()
    head = struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def test_an_image_that_unfolds_beyond_the_memory_is_refused_before_it_does(tmp_path):
    # 13,000 x 13,000 pixels in 0.2 MB; before the mend they took 1.7 GB.
    (tmp_path / "a.png").write_bytes(png(13_000, 13_000))
    assert (tmp_path / "a.png").stat().st_size < 200_000
    before = peak_memory_bytes()
    with pytest.raises(ResourceError, match=r"13000 x 13000 pixels.*about 3\.\d+ GB.*of 1 GB"):
        read_image_stack(tmp_path, memory_limit_bytes=GB, bytes_per_value=18)
    assert peak_memory_bytes() - before < 50_000_000


def test_a_later_image_of_another_size_is_not_decoded(tmp_path):
    (tmp_path / "a.png").write_bytes(png(5, 4))
    (tmp_path / "b.png").write_bytes(png(12_000, 9_000))
    before = peak_memory_bytes()
    with pytest.raises(CaseError, match=r"b\.png has 12000 x 9000"):
        read_image_stack(tmp_path, memory_limit_bytes=GB, bytes_per_value=18)
    assert peak_memory_bytes() - before < 50_000_000


@pytest.mark.parametrize("compression", ["raw", "tiff_lzw", "tiff_adobe_deflate"])
def test_cut_tiff_files_are_named(tmp_path, compression):
    whole = io.BytesIO()
    values = np.random.default_rng(3).integers(0, 60_000, (30, 20)).astype(np.uint16)
    Image.fromarray(values).save(whole, "TIFF", compression=compression)
    for length in (0, 4, 7, 9, 30, 200, 700, len(whole.getvalue()) - 90):
        (tmp_path / "a.tif").write_bytes(whole.getvalue()[:length])
        with pytest.raises(CaseError, match=r"a\.tif cannot be read as an image"):
            read_image_stack(tmp_path, memory_limit_bytes=GB, bytes_per_value=18)


def test_other_files_named_like_images_are_not_run(tmp_path):
    # Pillow would hand this one to Ghostscript.
    (tmp_path / "a.png").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n")
    with pytest.raises(CaseError, match="neither PNG nor TIFF"):
        read_image_stack(tmp_path, memory_limit_bytes=GB, bytes_per_value=18)


TET = TetMesh(
    points=np.array([[0, 10, 0, 0, 10], [0, 0, 10, 0, 10], [0, 0, 0, 10, 10.0]]),
    tets=np.array([[0, 1], [1, 4], [2, 2], [3, 3]]),
)


def vtu(folder, *, mode, compressor):
    """Written by VTK itself, in each of its ways."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    cells = np.column_stack([np.full(2, 4), TET.tets.T]).ravel()
    grid = pyvista.UnstructuredGrid(cells, np.full(2, 10, np.uint8), TET.points.T)
    grid.cell_data["rho"] = np.array([0.2, 0.4])
    grid.point_data["at points"] = np.linspace(0.1, 0.5, 5)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(folder / "a.vtu"))
    writer.SetInputData(grid)
    getattr(writer, f"SetDataModeTo{mode.split()[0]}")()
    writer.SetEncodeAppendedData("base64" in mode)
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    assert writer.Write()
    return folder / "a.vtu"


MODES = [
    ("Ascii", "None"),
    *(
        (m, c)
        for m in ("Binary", "Appended base64", "Appended raw")
        for c in ("None", "ZLib", "LZMA")
    ),
]


@pytest.mark.parametrize(("mode", "compressor"), MODES)
def test_vtu_files_of_vtk_are_read_in_each_of_its_ways(tmp_path, mode, compressor):
    file = vtu(tmp_path, mode=mode, compressor=compressor)
    mesh, values, at = read_vtu_field(file, "rho")
    np.testing.assert_array_equal(mesh.tets, TET.tets)
    np.testing.assert_allclose(mesh.points, TET.points)
    np.testing.assert_allclose(values, [0.2, 0.4])
    assert at == "elements"
    np.testing.assert_allclose(read_vtu_field(file, "at points")[1], np.linspace(0.1, 0.5, 5))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"vtkZLibDataCompressor", b"vtkLZ4DataCompressor", "compressed by vtkLZ4"),
        (b"vtkZLibDataCompressor", b"vtkLZMADataCompressor", "cannot be decompressed"),
        (b'NumberOfCells="2"', b'NumberOfCells="7"', "of 7 cells"),
        (b'NumberOfPoints="5"', b'NumberOfPoints="x"', "NumberOfPoints is 'x'"),
        (b'type="Float64" Name="rho"', b'type="Float16" Name="rho"', "type 'Float16'"),
        (b"UnstructuredGrid>", b"StructuredGrid>", "cannot be read as VTU"),
        (b"<VTKFile", b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile', "document type"),
        (b"AQAAAA", b"AQ*AAA", "not in base64"),
        (b"AQAAAA", b"////fw", "says that it has"),
    ],
)
def test_damaged_vtu_files_are_named(tmp_path, old, new, words):
    file = vtu(tmp_path, mode="Binary", compressor="ZLib")
    whole = file.read_bytes()
    assert old in whole
    file.write_bytes(whole.replace(old, new))
    with pytest.raises((CaseError, ResourceError), match=rf"a\.vtu.*{words}"):
        read_vtu_field(file, "rho")


def test_a_vtu_file_that_unfolds_beyond_the_memory_is_refused(tmp_path):
    # 400 MB of zeros in 0.4 MB, which decompress in one block.
    packer = zlib.compressobj(9)  # piece by piece: the test itself is not to take the memory
    zeros = b"".join(packer.compress(bytes(1_000_000)) for _ in range(400)) + packer.flush()
    file = vtu(tmp_path, mode="Binary", compressor="ZLib")
    text = file.read_text()
    at = text.index(">", text.index('Name="rho"')) + 1
    head = struct.pack("<IIII", 1, 400_000_000, 400_000_000, len(zeros))
    data = (base64.b64encode(head) + base64.b64encode(zeros)).decode()
    assert 'header_type="UInt32"' in text
    file.write_text(text[:at] + data + text[text.index("</DataArray>", at) :])
    before = peak_memory_bytes()
    with pytest.raises(ResourceError, match=r"'rho' states 0\.4 GB.*run\.memory"):
        read_vtu_field(file, "rho", memory_limit_bytes=GB)
    assert peak_memory_bytes() - before < 100_000_000


def test_a_field_over_far_too_much_space_is_refused(tmp_path):
    # In metres times a thousand: before the mend a grid of 1e18 nodes.
    far = TetMesh(points=TET.points * 1e5, tets=TET.tets)
    write_vtu(tmp_path / "a.vtu", far, cell_data={"rho [-]": [0.2, 0.3]})
    mesh, values, at = read_vtu_field(tmp_path / "a.vtu")
    with pytest.raises(ResourceError, match=r"1e\+06 x 1e\+06 x 1e\+06 mm .* run\.memory of 1 GB"):
        tet_density(mesh, values, at=at, spacing=1.0, reach=5.0, memory_limit_bytes=GB)


@pytest.mark.parametrize("far", [1e12, 1e150, np.nan])
def test_a_point_at_no_place_is_named(tmp_path, far):
    # Before the mend one at 1e12 mm took 4.4 GB, one at 1e150 mm ended in a traceback.
    points = TET.points.T.copy()
    points[4, 0] = far
    mesh = meshio.Mesh(points, [("tetra", TET.tets.T)], cell_data={"rho": [np.full(2, 0.3)]})
    meshio.vtu.write(tmp_path / "a.vtu", mesh)
    with pytest.raises(CaseError, match=r"a\.vtu: a point lies at .* mm; expected"):
        read_vtu_field(tmp_path / "a.vtu")


@pytest.mark.parametrize("name", ["push & pull", 'a < b > "c"', "Träger μ", "it's"])
def test_names_that_mean_something_in_xml_are_read_back(tmp_path, name):
    key = f"displacement {name} [mm]"
    values = np.arange(15.0).reshape(3, 5)
    write_vtu(tmp_path / "a.vtu", TET, point_data={key: values}, cell_data={"rho [-]": [0.2, 0.3]})
    np.testing.assert_array_equal(meshio.read(tmp_path / "a.vtu").point_data[key], values.T)
    np.testing.assert_array_equal(pyvista.read(tmp_path / "a.vtu").point_data[key], values.T)
    np.testing.assert_allclose(read_vtu_field(tmp_path / "a.vtu")[1], [0.2, 0.3], rtol=1e-6)
    assert [p.name for p in tmp_path.iterdir()] == ["a.vtu"]

"""Parts from scanned volumes: every format, their surface and volume, and what is refused."""

import gzip
import io
import json
import random
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gradedesign.design.resolve.fitting_part import installed_part
from gradedesign.errors import CaseError, GradeDesignError, PartError, ResourceError
from gradedesign.geometry.part.reader import FileRequest
from gradedesign.program.host.read_case import load_case
from gradedesign.program.host.registry import build_registry
from gradedesign_volumes.voxel_files import (
    read_image_volume,
    read_npy_volume,
    read_npz_volume,
    read_nrrd_volume,
)
from gradedesign_volumes.voxel_part import voxel_triangles
from gradedesign_volumes.voxel_volume import VoxelVolume
from gradedesign_volumes.voxels_schema import VoxelsSpec

GB = 10**9
RADIUS = 4.0
CASE = """\
[case]
name = "scan"
[part]
file = "{file}"
{part}
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.4
"""


def ball(step=(0.5, 0.5, 0.5), shift=0.0):
    """Grey values of a ball in a box of 10 mm: 200 inside, 20 outside; its far x end is 9 mm."""
    axes = [(np.arange(round(10 / h)) + 0.5) * h for h in step]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    inside = (x - 5 - shift) ** 2 + (y - 5) ** 2 + (z - 5) ** 2 < RADIUS**2
    return np.where(inside, 200, 20).astype(np.uint8)


def nrrd(values, *fields, encoding="raw", kind="uint8", dimension=3):
    data = values.tobytes(order="F")
    head = [
        *("NRRD0004", "# made by hand", f"type: {kind}", f"dimension: {dimension}"),
        *(f"sizes: {' '.join(map(str, values.shape))}", f"encoding: {encoding}", "key:=value"),
        *fields,
    ]
    body = gzip.compress(data) if encoding == "gzip" else data
    return "\n".join([*head, "", ""]).encode() + body


def asked(units=None, **stated):
    return FileRequest(table=VoxelsSpec(**stated), units=units, memory_limit_bytes=GB)


def part_of(folder, name, part):
    (folder / "case.toml").write_text(CASE.format(file=name, part=part), encoding="utf-8")
    case = load_case(folder / "case.toml")
    return case, installed_part(case, build_registry())


def put(folder, kind):
    """A ball as a file of a kind; the name of the file and what [part] needs with it."""
    voxels, spaced = "[part.voxels]\nthreshold = 100\n", 'spacing = "0.5 mm"\n'
    values = ball()
    if kind == "npy":
        np.save(folder / "b.npy", values)
        return "b.npy", voxels + spaced
    if kind == "bool":
        np.save(folder / "b.npy", values > 100)
        return "b.npy", "[part.voxels]\n" + spaced
    if kind == "npz":
        np.savez_compressed(folder / "b.npz", scan=values, spacing=np.full(3, 0.05))
        return "b.npz", 'units = "cm"\n' + voxels
    if kind == "images":
        (folder / "s").mkdir()
        for n in range(values.shape[2]):
            Image.fromarray(values[:, ::-1, n].T).save(folder / "s" / f"slice{n + 1}.png")
        (folder / "s" / "other.png").write_bytes(b"no slice")
        return "s/slice1.png", voxels + spaced
    encoding = "gzip" if kind == "gzip" else "raw"
    fields = ('space units: "mm" "mm" "mm"', "spacings: 0.5 0.5 0.5")
    (folder / "b.nrrd").write_bytes(nrrd(values, *fields, encoding=encoding))
    return "b.nrrd", voxels


@pytest.mark.parametrize("kind", ["npy", "bool", "npz", "images", "nrrd", "gzip"])
def test_a_ball_comes_out_of_every_format_with_its_volume(tmp_path, kind):
    name, text = put(tmp_path, kind)
    _, part = part_of(tmp_path, name, text)
    voxels = np.count_nonzero(ball() > 100) * 0.125
    assert part.volume == pytest.approx(voxels, rel=2e-3)
    assert any("solid voxels of 0.5 x 0.5 x 0.5 mm" in w for w in part.report.warnings)
    far = np.linalg.norm(part.surface.vertices - 5.0, axis=1)
    # Half a voxel of tolerance, and half a diagonal of one between its faces and the ball.
    assert abs(far - RADIUS).max() < 0.25 + 0.5 * np.sqrt(3) * 0.5
    assert far.std() < 0.1


def test_steps_go_with_a_larger_tolerance():
    volume = VoxelVolume(values=ball(), spacing=(0.5, 0.5, 0.5), unit="mm")
    spread = []
    for tolerance in ("0.05 mm", "0.15 mm", "0.3 mm"):
        request = asked(threshold=100, tolerance=tolerance)
        corners = voxel_triangles(volume, request, "ball").corners
        spread.append(np.linalg.norm(corners.reshape(-1, 3) - 5.0, axis=1).std())
    assert spread[0] >= spread[1] > 1.5 * spread[2]


def test_unequal_edges_keep_the_volume_and_the_shape():
    step = (0.25, 0.25, 1.0)
    volume = VoxelVolume(values=ball(step), spacing=step, unit="mm")
    raw = voxel_triangles(volume, asked(threshold=100), "ball")
    flat = raw.corners.reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(flat, axis=0)[:2], 8.0, atol=0.4)
    assert np.ptp(flat[:, 2]) == pytest.approx(8.0, abs=1.1)


def test_a_solid_that_fills_its_box_is_closed_at_its_faces(tmp_path):
    np.save(tmp_path / "b.npy", np.ones((32, 24, 16), dtype=bool))
    _, part = part_of(tmp_path, "b.npy", '[part.voxels]\nspacing = "0.25 mm"')
    assert part.volume == pytest.approx(8 * 6 * 4, rel=5e-3)
    np.testing.assert_allclose(np.ptp(part.surface.vertices, axis=0), (8, 6, 4), atol=0.05)
    np.testing.assert_allclose(part.surface.vertices.min(axis=0), 0, atol=0.05)


def test_axes_that_run_backwards_are_turned_around():
    values = ball(shift=1.0)
    head = "space directions: (-0.5,0,0) (0,0.5,0) (0,0,0.5)"
    path_values = read(nrrd(values[::-1], head, 'space units: "mm" "mm" "mm"'))
    np.testing.assert_array_equal(path_values.values, values)
    assert path_values.spacing == (0.5, 0.5, 0.5)


def read(content):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "b.nrrd"
        file.write_bytes(content)
        return read_nrrd_volume(file, GB)


def test_types_and_byte_orders_of_nrrd():
    values = (ball().astype(np.float64) * 1000 - 3).astype(">i4")
    found = read(nrrd(values, "endian: big", kind="int"))
    np.testing.assert_array_equal(found.values, values)
    assert (found.spacing, found.unit) == (None, None)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"solid x", "not NRRD"),
        (b"NRRD0004\ntype: uint8\n", "no end"),
        (nrrd(ball(), "data file: other.raw"), "in the file itself"),
        (nrrd(ball(), "byte skip: -1"), "in the file itself"),
        (nrrd(ball(), encoding="bzip2"), "write raw or gzip"),
        (nrrd(ball(), dimension=4), "expected 3"),
        (nrrd(ball(), kind="block"), "is not read"),
        (nrrd(ball(), kind="short"), "endian"),
        (nrrd(ball())[:-7], "expected 8000"),
        (nrrd(ball()) + b"1", "more bytes"),
        (nrrd(ball(), encoding="gzip")[:-30], "truncated"),
        (nrrd(ball(), "spacings: 1 1"), "three numbers"),
        (nrrd(ball(), "spacings: 1 nan 1"), "three numbers"),
        (nrrd(ball(), "space directions: (1,0.5,0) (0,1,0) (0,0,1)"), "along x, y and z"),
        (nrrd(ball(), 'space units: "mm" "inch" "mm"'), "space units"),
        (nrrd(ball(), "type: uint8"), "damaged header"),
    ],
)
def test_nrrd_files_that_are_refused(content, words):
    with pytest.raises(PartError, match=words):
        read(content)


def test_a_volume_larger_than_it_says_or_than_the_memory_is_never_unpacked(tmp_path):
    bomb = nrrd(np.zeros((1, 1, 1), dtype=np.uint8), encoding="gzip")
    bomb = bomb[: bomb.index(b"\n\n") + 2] + gzip.compress(bytes(10**7))
    with pytest.raises(PartError, match="more bytes"):
        read(bomb)
    huge = nrrd(np.zeros((1, 1, 1), dtype=np.uint8)).replace(b"1 1 1", b"9999 9999 9999")
    with pytest.raises(ResourceError, match=r"run\.memory"):
        read(huge)
    np.savez_compressed(tmp_path / "b.npz", a=np.zeros((300, 300, 300), dtype=np.uint8))
    with pytest.raises(ResourceError):
        read_npz_volume(tmp_path / "b.npz", 10**8)
    np.savez(tmp_path / "two.npz", a=np.zeros(3), b=np.zeros(3))
    with pytest.raises(PartError, match="expected one volume"):
        read_npz_volume(tmp_path / "two.npz", GB)
    np.save(tmp_path / "flat.npy", np.zeros((3, 3)))
    with pytest.raises(PartError, match="nx, ny, nz"):
        read_npy_volume(tmp_path / "flat.npy", GB)
    Image.fromarray(ball()[0]).save(tmp_path / "alone1.png")
    with pytest.raises(PartError, match="found one image"):
        read_image_volume(tmp_path / "alone1.png", GB)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ('[part.voxels]\nspacing = "1 mm"', "threshold: missing; .* from 20 to 200.*grey lies"),
        ("[part.voxels]\nthreshold = 100", "spacing: missing"),
        ('[part.voxels]\nthreshold = 300\nspacing = "1 mm"', "no voxel is above"),
        ('[part.voxels]\nthreshold = 20\nbelow = true\nspacing = "1 mm"', "no voxel is below"),
        ('[run]\nmemory = "100 kB"\n[part.voxels]\nthreshold = 100\nspacing = "1 mm"', "memory"),
    ],
)
def test_what_a_scan_needs_is_asked_for(tmp_path, part, words):
    np.save(tmp_path / "b.npy", ball())
    with pytest.raises((CaseError, PartError, ResourceError), match=words):
        part_of(tmp_path, "b.npy", part)


def test_values_that_are_not_finite_are_refused(tmp_path):
    values = ball().astype(np.float32)
    values[0, 0, 0] = np.nan
    np.save(tmp_path / "b.npy", values)
    with pytest.raises(PartError, match="1 of 8000 voxels"):
        part_of(tmp_path, "b.npy", '[part.voxels]\nthreshold = 100\nspacing = "1 mm"')


def test_a_wall_of_one_voxel_that_smoothing_would_eat_is_kept_or_refused():
    values = np.zeros((20, 20, 20), dtype=bool)
    values[10] = True
    volume = VoxelVolume(values=values, spacing=(1.0, 1.0, 1.0), unit="mm")
    with pytest.raises(GradeDesignError):
        voxel_triangles(volume, asked(tolerance="3 mm"), "wall")
    raw = voxel_triangles(volume, asked(), "wall")
    a, b, c = np.moveaxis(raw.corners, 1, 0)
    held = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    assert held == pytest.approx(400.0, rel=5e-3)


def test_every_slice_counts_in_the_identity_of_the_case(tmp_path):
    name, text = put(tmp_path, "images")
    first, _ = part_of(tmp_path, name, text)
    again, _ = part_of(tmp_path, name, text)
    assert first.case_hash == again.case_hash
    Image.fromarray(np.full((20, 20), 21, dtype=np.uint8)).save(tmp_path / "s" / "slice1.png")
    other, _ = part_of(tmp_path, name, text)
    assert other.case_hash != first.case_hash


def test_a_scan_goes_through_check_and_generate(cli, tmp_path):
    name, text = put(tmp_path, "nrrd")
    (tmp_path / "case.toml").write_text(CASE.format(file=name, part=text), encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["relative_density"] == pytest.approx(0.4, abs=0.03)


def test_a_scanned_block_is_checked_with_regions_on_its_faces(cli, tmp_path):
    np.save(tmp_path / "b.npy", np.ones((32, 24, 16), dtype=bool))
    part = 'mesh_size = "1.5 mm"\n[part.voxels]\nspacing = "0.25 mm"'
    checked = CASE.format(file="b.npy", part=part).replace("density = 0.4", "density = [0.2, 0.6]")
    checked += (
        '[material]\nname = "Ti-6Al-4V"\n[region.low]\nfacing = "-z"\n[region.high]\n'
        'facing = "+z"\n[[load_case]]\nname = "press"\nfix = [{region = "low"}]\n'
        'load = [{region = "high", force = ["0 N", "0 N", "-10 N"]}]\n[limits]\nstress = "50 MPa"\n'
    )
    (tmp_path / "case.toml").write_text(checked, encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture")
    assert ended.code == 0, ended.err
    assert "solid voxels" in " ".join(ended.out.split())


def test_triangles_know_no_voxels(tmp_path):
    (tmp_path / "b.stl").write_bytes(b"x")
    with pytest.raises(CaseError, match="format takes no such table"):
        part_of(tmp_path, "b.stl", 'units = "mm"\n[part.voxels]\nthreshold = 1')


@pytest.mark.parametrize("kind", ["npz", "nrrd", "gzip"])
def test_altered_files_end_in_an_error_by_name_or_a_volume(tmp_path, kind):
    small = ball((2.0, 2.0, 2.0))
    whole = nrrd(small, "spacings: 1 1 1", encoding="gzip" if kind == "gzip" else "raw")
    if kind == "npz":
        stream = io.BytesIO()
        np.savez_compressed(stream, scan=small, spacing=np.ones(3))
        whole = stream.getvalue()
    reader = read_npz_volume if kind == "npz" else read_nrrd_volume
    file, rng = tmp_path / "b", random.Random(20_233)
    ends = {"volume": 0, "error": 0}
    for _ in range(400):
        content = bytearray(whole)
        for _ in range(rng.randrange(1, 6)):
            at = rng.randrange(len(content))
            content[at : at + rng.randrange(3)] = bytes(rng.randrange(256) for _ in range(2))
        file.write_bytes(bytes(content[: rng.choice([len(content), rng.randrange(len(content))])]))
        try:
            found = reader(file, 50_000_000)
        except GradeDesignError:
            ends["error"] += 1
        else:
            assert found.values.ndim == 3
            ends["volume"] += 1
    assert ends["error"] > 100


def test_archives_with_a_false_size_are_refused(tmp_path):
    stream = io.BytesIO()
    np.savez(stream, scan=ball())
    content = stream.getvalue()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = archive.infolist()[0].file_size
    (tmp_path / "b.npz").write_bytes(
        content.replace(size.to_bytes(4, "little"), (size - 5).to_bytes(4, "little"))
    )
    with pytest.raises(PartError):
        read_npz_volume(tmp_path / "b.npz", GB)


def test_the_surface_of_a_box_of_voxels_is_its_box():
    volume = VoxelVolume(values=np.ones((5, 5, 5), dtype=bool), spacing=(0.1, 0.1, 0.1))
    raw = voxel_triangles(volume, asked(units="inch"), "box")
    assert raw.unit == "inch"
    np.testing.assert_allclose(np.ptp(raw.corners.reshape(-1, 3), axis=0), 0.5, atol=0.03)

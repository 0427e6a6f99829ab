"""Thousands of altered cases and density maps: an error by name or a right answer, no traceback.

The seeds are fixed. A sample runs with every test, all of them where ``-m slow`` asks.
"""

import io
import random
import re
import shutil
from pathlib import Path

import meshio
import numpy as np
import pytest
from altered_files import NASTY, altered_bytes
from oracles.peak_memory import peak_memory_bytes
from PIL import Image

from gradedesign.common.values.formula import parse_formula
from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.resolve import lookup, resolve_material
from gradedesign.errors import GradeDesignError
from gradedesign.geometry.lattice.density_source import sample_density
from gradedesign.geometry.lattice.density_value import formula_field
from gradedesign.geometry.lattice.tet_density import tet_density
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.program.host.registry import build_registry
from gradedesign_volumes.image_stack import read_image_stack
from gradedesign_volumes.point_cloud import point_density, read_points, remap_points
from gradedesign_volumes.voxel_density import (
    densities,
    place_voxels,
    read_voxel_array,
    voxel_density,
)
from gradedesign_volumes.vtu_fields import read_vtu_field

CASES = Path(__file__).parents[2] / "cases"
ROUND = 50
MEMORY = 50_000_000

STATED = """
[case]
name = "fuzzed"
[part]
box = ["20 mm", "10 mm", "10 mm"]
[region.root]
plane = "x = min"
[[keep]]
region = "root"
margin = "1 mm"
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = [0.1, 0.5]
skin = {thickness = "1 mm"}
[lattice.density_map]
formula = "0.2 + 0.01 * x"
[print]
min_wall = "0.1 mm"
[run]
memory = "1 GB"
"""


def swapped(rng, items):
    first, second = rng.randrange(len(items)), rng.randrange(len(items))
    items[first], items[second] = items[second], items[first]


def altered_case(rng, text):
    """One to three changes of bytes, tokens, values, keys, lines or tables."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        kind, lines = rng.choice([0, 1, 1, 1, 2, 2, 3, 4, 5, 6, 7, 7, 7, 7]), text.split("\n")
        if kind == 0:
            data = bytearray(text.encode("utf-8", "surrogateescape"))
            for _ in range(rng.choice([1, 1, 4])):
                data[rng.randrange(len(data))] = rng.randrange(256)
            text = data.decode("utf-8", "surrogateescape")
        elif kind == 1:  # a value
            places = [n for n, line in enumerate(lines) if "=" in line]
            if places:
                n = rng.choice(places)
                lines[n] = f"{lines[n].split('=')[0]}= {rng.choice(NASTY)}"
            text = "\n".join(lines)
        elif kind == 2:  # a number or word inside a value
            found = list(re.finditer(r"-?\d[\w.]*|\b[a-zA-Z_]+\b", text))
            if found:
                at = rng.choice(found)
                new = rng.choice([rng.choice(NASTY).strip('"'), rng.choice(found)[0]])
                text = text[: at.start()] + new + text[at.end() :]
        elif kind == 3:
            swapped(rng, lines)
            text = "\n".join(lines)
        elif kind == 4:  # a table twice, or one less
            parts = re.split(r"(?m)^(?=\[)", text)
            n = rng.randrange(len(parts))
            parts[n : n + 1] = [parts[n]] * rng.choice([0, 2])
            text = "".join(parts)
        elif kind == 5:
            a, b = sorted(rng.randrange(len(text) + 1) for _ in range(2))
            text = text[:a] + text[b:] if rng.random() < 0.5 else text[:b] + text[a:]
        elif kind == 6:
            a = rng.randrange(len(text) + 1)
            text = text[:a] + rng.choice(NASTY) + text[a:]
        else:  # another number, which may well be allowed
            found = list(re.finditer(r"(?<=[ \"\[])\d+(\.\d+)?(?=[ \",\]\n])", text))
            if found:
                at = rng.choice(found)
                new = f"{float(at[0]) * rng.uniform(0.3, 3.0):.{rng.choice([0, 3])}f}"
                text = text[: at.start()] + new + text[at.end() :]
        text = text or " "
    return text


@pytest.fixture(scope="session")
def registry():
    return build_registry()


@pytest.fixture
def folders(tmp_path):
    """Every case, with the files it names, and one of a stated density."""
    found = []
    for source in sorted(CASES.iterdir()):
        if (source / "case.toml").is_file():
            folder = tmp_path / source.name
            folder.mkdir()
            for file in source.iterdir():
                if file.suffix in (".toml", ".stl"):
                    shutil.copy(file, folder)
            found.append((folder, (folder / "case.toml").read_text(encoding="utf-8")))
    folder = tmp_path / "stated"
    folder.mkdir()
    found += [(folder, STATED)] * 2
    return found


def look_at(folder, registry):
    """What ``check`` does up to the first mesh."""
    case = load_case(folder)
    registry = with_own_cell(case.lattice, registry, case.where)
    if case.material is not None:
        resolve_material(case.material, registry)
    lookup(registry, "cell_families", case.lattice.cell)
    if case.part.file is None:
        part = part_of(case, {s: r.read for r in registry.readers.values() for s in r.suffixes})
        assert np.isfinite(part.surface.vertices).all()
        assert part.volume > 0


def rounds(slow_from, to):
    """Numbers of rounds; only those below a number run with every test."""
    return [pytest.param(n, marks=[pytest.mark.slow] if n >= slow_from else []) for n in range(to)]


@pytest.mark.parametrize("number", rounds(6, 60))
def test_altered_cases(folders, registry, number):
    rng = random.Random(1000 + number)
    read = 0
    for n in range(ROUND):
        folder, text = rng.choice(folders)
        content = altered_case(rng, text).encode("utf-8", "surrogateescape")
        (folder / "case.toml").write_bytes(content)
        words = "read"
        try:
            look_at(folder, registry)
            read += 1
        except GradeDesignError as error:
            words = str(error).strip()
        except Exception as error:
            error.add_note(f"round {number}, case {n} from {folder.name}:\n{content!r}")
            raise
        assert words
    print(f"{read} of {ROUND} altered cases could be read")  # noqa: T201


TET = TetMesh(
    points=np.array([[0, 20, 0, 0, 20], [0, 0, 20, 0, 20], [0, 0, 0, 20, 20.0]]),
    tets=np.array([[0, 1], [1, 4], [2, 2], [3, 3]]),
)
UPPER = np.array([8.0, 6.0, 4.0])


def saved(write, *args, **options):
    file = io.BytesIO()
    write(file, *args, **options)
    return file.getvalue()


def image(values, kind, **options):
    file = io.BytesIO()
    Image.fromarray(values).save(file, kind, **options)
    return file.getvalue()


def grid(folder, **options):
    mesh = meshio.Mesh(TET.points.T, [("tetra", TET.tets.T)], cell_data={"rho": [[0.2, 0.4]]})
    mesh.cell_data["rho"] = [np.array([0.2, 0.4])]
    meshio.vtu.write(folder / "base.vtu", mesh, **options)
    return (folder / "base.vtu").read_bytes()


@pytest.fixture(scope="module")
def bases(tmp_path_factory):
    """Whole files of every format: name of the file and content."""
    folder = tmp_path_factory.mktemp("bases")
    rng = np.random.default_rng(17)
    values = rng.uniform(0.1, 0.5, (4, 3, 2))
    grey = rng.integers(0, 255, (12, 9)).astype(np.uint8)
    points = np.column_stack([rng.uniform(0, 8, (30, 3)), rng.uniform(0.1, 0.5, 30)])
    rows = "\n".join(",".join(f"{v:.4g}" for v in row) for row in points)
    return [
        ("voxels.npy", saved(np.save, values)),
        ("voxels.npy", saved(np.save, values.astype(">f4"))),
        ("voxels.npy", saved(np.save, (values * 400).astype(np.uint8))),
        ("voxels.npy", saved(np.savez, values)),
        ("points.npy", saved(np.save, points)),
        ("points.csv", f"x,y,z,rho\n{rows}\n".encode()),
        ("points.txt", rows.replace(",", " ").encode()),
        ("images/a.png", image(grey, "PNG")),
        ("images/a.png", image(grey.astype(np.uint16) * 200, "PNG")),
        ("images/a.tif", image(grey.astype(np.uint16), "TIFF")),
        ("images/a.tif", image(grey, "TIFF", compression="tiff_lzw")),
        ("images/a.tif", image(grey / np.float32(500), "TIFF", compression="tiff_adobe_deflate")),
        ("field.vtu", grid(folder, binary=True, compression="zlib")),
        ("field.vtu", grid(folder, binary=True, compression="lzma")),
        ("field.vtu", grid(folder, binary=True, compression=None)),
        ("formula", b"0.2 + 0.1 * sin(x / 4) * smoothstep(0, 2, d)"),
        ("formula", b"min(0.4, max(0.1, sqrt(x**2 + y**2) / 20))"),
    ]


def source_of(file):
    """As ``generate`` reads it; values of a whole file are compared with another reader."""
    if file.name == "formula":
        text = file.read_bytes().decode("utf-8", "replace")
        return formula_field(parse_formula(text), lambda p: -p[0])
    if file.name.startswith("points"):
        points, values = read_points(file, memory_limit_bytes=MEMORY)
        if file.suffix == ".npy":
            np.testing.assert_array_equal(np.load(file)[:, 3], values)
        return point_density(remap_points(points, values, 2.0, memory_limit_bytes=MEMORY))
    if file.suffix == ".vtu":
        mesh, values, at = read_vtu_field(file, memory_limit_bytes=MEMORY)
        return tet_density(mesh, values, at=at, spacing=1.0, reach=5.0, memory_limit_bytes=MEMORY)
    if file.suffix == ".npy":
        raw = read_voxel_array(file, memory_limit_bytes=MEMORY)
        np.testing.assert_array_equal(np.load(file), raw)
    else:
        raw = read_image_stack(file.parent, memory_limit_bytes=MEMORY, bytes_per_value=18)
    start, edges = place_voxels(raw.shape, [0, 0, 0], UPPER)
    return voxel_density(densities(raw, (0.1, 0.5)), start, edges)


@pytest.mark.parametrize("number", rounds(4, 40))
def test_altered_density_maps(tmp_path, bases, number):
    rng = random.Random(2000 + number)
    (tmp_path / "images").mkdir()
    before, read = peak_memory_bytes(), 0
    for n in range(ROUND):
        name, whole = rng.choice(bases)
        file = tmp_path / name
        content = altered_bytes(rng, whole, [content for _, content in bases])
        file.write_bytes(content)
        words = "read"
        try:
            found = sample_density(
                source_of(file),
                lambda p: (np.abs(p - UPPER[:, None] / 2) - UPPER[:, None] / 2).max(axis=0),
                [0, 0, 0],
                UPPER,
                spacing=1.0,
                window=(0.05, 0.9),
                quantity="map",
                memory_limit_bytes=MEMORY,
            )
            assert found.values.min() >= 0.05 - 1e-9
            assert found.values.max() <= 0.9 + 1e-9
            read += 1
        except GradeDesignError as error:
            words = str(error).strip()
        except Exception as error:
            error.add_note(f"round {number}, map {n}, {name}: {content!r}")
            raise
        finally:
            file.unlink()
        assert words
    # Beside what is allowed to a map, that of the libraries that are loaded with the first.
    assert peak_memory_bytes() - before < 400_000_000
    print(f"{read} of {ROUND} altered maps could be read")  # noqa: T201

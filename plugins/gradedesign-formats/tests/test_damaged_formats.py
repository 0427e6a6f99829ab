"""Damaged OBJ, PLY, OFF and GLB files: a part or an error of ours, never a traceback."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.errors import PartError
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign_formats.read_trimesh import read_glb, read_obj, read_off, read_ply

READ = {"obj": read_obj, "ply": read_ply, "off": read_off, "glb": read_glb}


def seeds():
    """Small files of every format; 10 x 5 x 2 mm."""
    box = trimesh.creation.box((10.0, 5.0, 2.0))
    painted = box.copy()
    painted.visual.face_colors = [[255, 0, 0, 255]] * 6 + [[0, 255, 0, 255]] * 6
    found = []
    for mesh in (box, painted):
        for kind, options in (
            ("obj", {}),
            ("off", {}),
            ("ply", {}),
            ("ply", {"encoding": "ascii"}),
            ("glb", {}),
        ):
            whole = trimesh.Scene(mesh) if kind == "glb" else mesh
            data = whole.export(file_type=kind, **options)
            found.append((kind, data if isinstance(data, bytes) else data.encode()))
    return found


SEEDS = seeds()


def read(kind, data):
    """Triangles of a file, or None where it is refused as it should be."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"part.{kind}"
        path.write_bytes(data)
        try:
            raw = READ[kind](path)
            return in_mm(raw, "mm", path.name)
        except PartError as error:
            assert str(error).startswith("part.")  # noqa: PT017 - both outcomes are right
            return None


@st.composite
def mutated(draw):
    kind, seed = draw(st.sampled_from(SEEDS))
    data = bytearray(seed)
    for _ in range(draw(st.integers(1, 4))):
        if not data:
            break
        # Most bytes are coordinates: half of the damage goes to the head.
        end = len(data) - 1 if draw(st.booleans()) else min(300, len(data) - 1)
        at = draw(st.integers(0, end))
        how = draw(st.sampled_from(["byte", "digit", "cut", "copy", "end"]))
        if how == "byte":
            data[at] = draw(st.integers(0, 255))
        elif how == "digit":
            data[at : at + 1] = draw(st.sampled_from([b"9", b"-", b"99999999999", b" ", b"e9"]))
        elif how == "cut":
            del data[at : at + draw(st.integers(1, 40))]
        elif how == "copy":
            data[at:at] = data[at : at + draw(st.integers(1, 40))]
        else:
            del data[at:]
    return kind, bytes(data)


@given(mutated())
@settings(max_examples=400, deadline=None)
def test_a_damaged_file_is_read_or_refused(case):
    raw = read(*case)
    assert raw is None or np.isfinite(raw.corners).all()


@given(st.sampled_from(sorted(READ)), st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_random_bytes(kind, data):
    heads = {"obj": b"v ", "ply": b"ply\nformat ", "off": b"OFF\n", "glb": b"glTF\2\0\0\0"}
    read(kind, data)
    read(kind, heads[kind] + data)


@pytest.mark.parametrize("number", range(len(SEEDS)))
def test_a_cut_file_is_whole_or_refused(number):
    kind, seed = SEEDS[number]
    for length in range(0, len(seed), max(1, len(seed) // 40)):
        raw = read(kind, seed[:length])
        if raw is not None:
            try:
                surface, _ = build_surface(raw.corners, repair="auto")
            except PartError:
                continue
            assert enclosed_volume(surface) == pytest.approx(100.0, rel=1e-3), length

"""Reading STL: rows 1 to 14 of the fault table, each with its answer."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from gradedesign.errors import CaseError, PartError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.triangles.surface_mesh import corner_points

BOX = corner_points(box_surface((10.0, 20.0, 30.0)))


def binary(corners, header: bytes = b"made by hand", count: int | None = None) -> bytes:
    """Write binary STL, one record at a time."""
    data = header.ljust(80) + struct.pack("<I", len(corners) if count is None else count)
    for triangle in corners:
        data += struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0)
    return data


def ascii_stl(corners, name: str = "box", number: str = "{:.9g}") -> str:
    """Write ASCII STL, one line at a time."""
    lines = [f"solid {name}"]
    for triangle in corners:
        lines += ["facet normal 0 0 0", "  outer loop"]
        lines += ["    vertex " + " ".join(number.format(v) for v in p) for p in triangle]
        lines += ["  endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""])


def patched(offset: int, value: bytes) -> bytes:
    data = bytearray(binary(BOX))
    data[offset : offset + len(value)] = value
    return bytes(data)


def read(tmp_path: Path, data: bytes | str, unit: str = "mm"):
    path = tmp_path / "part.stl"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return in_mm(read_stl(path), unit, path.name)


VALID = binary(BOX)
TEXT = ascii_stl(BOX)
FIRST_X = 84 + 12

REFUSED = {
    "row 1, empty": (b"", ["empty file", "0 bytes"]),
    "row 2, 50 bytes": (VALID[:50], ["truncated header", "50 bytes"]),
    "row 3, count 0": (VALID[:80] + bytes(4), ["no triangles"]),
    "row 4, cut in a record": (VALID[:-20], ["declares 12", "holds 11", "+30 bytes"]),
    "row 5, cut between records": (VALID[:-50], ["declares 12", "holds 11", "+0 bytes"]),
    "row 6, absurd count": (patched(80, b"\xff" * 4), ["declares 4294967295", "holds 12"]),
    "row 7, count far too small": (
        binary(np.tile(BOX, (4, 1, 1)), count=2),
        ["declares 2", "2300 bytes follow"],
    ),
    "row 9, cut in a facet": (TEXT[: TEXT.index("vertex") + 30], ["line 5", "inside a facet"]),
    "row 9, keyword missing": (TEXT.replace("endloop", "", 1), ["line 8", "'endfacet'"]),
    "row 9, number missing": (TEXT.replace("vertex 0 0 0", "vertex 0 0"), ["line 5", "a number"]),
    "row 9, not a number": (TEXT.replace("vertex 0 0 0", "vertex 0 0 1_0"), ["'1_0'"]),
    "row 9, text behind": (TEXT + "\nsmall print", ["line 88", "'small'", "'solid'"]),
    "row 10, decimal comma": (
        ascii_stl(BOX + 0.5).replace("0.5", "0,5"),
        ["line 4", "decimal comma", "'0,5'"],
    ),
    "row 11, HTML": ("<!DOCTYPE html><html>404</html>", ["not STL", "HTML"]),
    "row 11, OBJ": ("# made by\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", ["not STL", "OBJ"]),
    "row 11, PNG": (b"\x89PNG\r\n\x1a\n" + bytes(300), ["not STL", "PNG"]),
    "row 11, STEP": ("ISO-10303-21;\nHEADER;", ["not STL", "STEP"]),
    "row 11, plain text": ("please find attached\n" * 20, ["not STL", "text"]),
    "row 13, NaN": (patched(FIRST_X, struct.pack("<f", np.nan)), ["NaN", "facets 0"]),
    "row 13, signalling NaN": (patched(FIRST_X, b"\x01\x00\xa0\x7f"), ["NaN", "facets 0"]),
    "row 13, NaN in text": (TEXT.replace("vertex 0 0 0", "vertex nan 0 0", 1), ["NaN", "facets"]),
    "row 14, inf": (patched(FIRST_X + 50, struct.pack("<f", -np.inf)), ["infinite", "facets 1"]),
    "row 14, 1e12": (patched(FIRST_X, struct.pack("<f", 1e12)), ["absurdly far", "1e+12 mm"]),
    "row 14, 1e30": (patched(FIRST_X, struct.pack("<f", 1e30)), ["absurdly far", "facets 0"]),
    "row 14, overflow": (TEXT.replace("vertex 0 0 0", "vertex 1e999 0 0", 1), ["infinite"]),
    "tiny": (binary(BOX * 1e-6), ["absurdly small", "unit"]),
    "no facets": ("solid nothing\nendsolid nothing\n", ["no triangles"]),
}


@pytest.mark.parametrize(("data", "words"), REFUSED.values(), ids=REFUSED.keys())
def test_damaged_file_is_refused(tmp_path, data, words):
    with pytest.raises(PartError) as caught:
        read(tmp_path, data)
    assert caught.value.exit_code == 3
    assert "part.stl" in str(caught.value)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("inside", [b"3D/3dmodel.model", b"readme.txt"])
def test_zip_is_named(tmp_path, inside):
    path = tmp_path / "part.stl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(inside.decode(), "x" * 500)
    with pytest.raises(PartError, match="3MF" if b"3D" in inside else "zip archive"):
        read_stl(path)


def test_missing_file(tmp_path):
    with pytest.raises(PartError, match="cannot be read"):
        read_stl(tmp_path / "absent.stl")


ACCEPTED = {
    "binary": VALID,
    "row 8, binary starting with solid": binary(BOX, header=b"solid box"),
    "text": TEXT,
    "row 10, CRLF": TEXT.replace("\n", "\r\n"),
    "row 10, old Mac line ends": TEXT.replace("\n", "\r"),
    "row 10, tabs": TEXT.replace(" ", "\t").replace("solid\tbox", "solid box"),
    "row 10, upper case": TEXT.upper(),
    "row 10, exponents": ascii_stl(BOX, number="{:+.7E}"),
    "row 10, byte order mark": "\ufeff" + TEXT,
    "row 10, no name": ascii_stl(BOX, name=""),
    "row 10, nameless normal": TEXT.replace("normal 0 0 0", "normal nan nan nan"),
    "row 10, several solids": ascii_stl(BOX[:5], "one") + ascii_stl(BOX[5:], "facet two"),
}


@pytest.mark.parametrize("data", ACCEPTED.values(), ids=ACCEPTED.keys())
def test_unusual_file_is_read_exactly(tmp_path, data):
    raw = read(tmp_path, data)
    np.testing.assert_array_equal(raw.corners, BOX)  # small whole numbers are exact in float32
    assert raw.warnings == ()


def test_row_7_trailing_bytes_are_told(tmp_path):
    raw = read(tmp_path, VALID + bytes(77))
    np.testing.assert_array_equal(raw.corners, BOX)
    assert "77 trailing bytes" in raw.warnings[0]


def test_row_8_truncated_binary_starting_with_solid_is_not_taken_for_text(tmp_path):
    with pytest.raises(PartError, match="declares 12 triangles, holds 11"):
        read(tmp_path, binary(BOX, header=b"solid box")[:-50])


VOID = 0.5 * BOX[:, ::-1] + np.array([2.5, 5.0, 7.5])


def test_row_9_text_cut_between_two_shells_is_refused(tmp_path):
    """The box is whole and closed; only the missing ``endsolid`` tells that a void followed."""
    whole = ascii_stl(np.concatenate([BOX, VOID]))
    cut = "endfacet".join(whole.split("endfacet")[: len(BOX)]) + "endfacet\n"
    with pytest.raises(PartError, match=r"'endsolid' is missing after 12 facets.*two shells"):
        read(tmp_path, cut)
    np.testing.assert_array_equal(read(tmp_path, cut + "endsolid").corners, BOX)


@pytest.mark.parametrize("behind", [VOID, BOX + 100.0], ids=["void", "second body"])
def test_row_7_facets_behind_the_declared_ones_are_refused(tmp_path, behind):
    with pytest.raises(PartError, match="declares 12 triangles, but 12 more follow"):
        read(tmp_path, binary(np.concatenate([BOX, behind]), count=12))


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1), ("cm", 10), ("m", 1000), ("inch", 25.4)])
def test_units(tmp_path, unit, factor):
    np.testing.assert_allclose(read(tmp_path, VALID, unit).corners, BOX * factor, rtol=1e-15)


def test_unknown_unit_is_an_error_of_the_case(tmp_path):
    with pytest.raises(CaseError, match="furlong"):
        read(tmp_path, VALID, "furlong")


def test_fast_and_careful_text_parsers_agree():
    from gradedesign.geometry.formats._stl_ascii import _parse_fast, _parse_lines

    corners = np.random.default_rng(7).normal(size=(50, 3, 3))
    text = ascii_stl(corners, number="{!r}").replace("np.float64(", "").replace(")", "").encode()
    np.testing.assert_array_equal(_parse_fast(text), corners)
    np.testing.assert_array_equal(_parse_lines(text, "x"), corners)

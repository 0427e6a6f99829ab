"""Row 12 of the fault table: whatever the bytes, STL reading answers or refuses, and says so."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.errors import PartError
from gradedesign.geometry.formats.read_stl import parse_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.raw_triangles import in_mm, raw_triangles
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import (
    corner_points,
    enclosed_volume,
    open_edge_count,
)

BOX = corner_points(box_surface((10.0, 20.0, 30.0)))


def binary(corners) -> bytes:
    data = b"solid or not".ljust(80) + struct.pack("<I", len(corners))
    for triangle in corners:
        data += struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0)
    return data


def text(corners) -> bytes:
    lines = ["solid box"]
    for triangle in corners:
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += ["vertex " + " ".join(repr(float(v)) for v in p) for p in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid"]).encode()


SEEDS = (binary(BOX), text(BOX))
WORDS = (b"solid", b"endsolid", b"facet", b"\n", b" nan", b",", b"1e99", b"\x00", b"\xff" * 4)


HOLLOW = np.concatenate([BOX, 0.5 * BOX[:, ::-1] + np.array([2.5, 5.0, 7.5])])
HOLLOW_SEEDS = (binary(HOLLOW), text(HOLLOW))

HOLLOW_VOLUME = 6000.0 - 750.0


@st.composite
def mutated(draw, seeds=SEEDS, most=4) -> bytes:
    """A valid file with a few bytes changed, inserted, cut or repeated."""
    data = bytearray(draw(st.sampled_from(seeds)))
    for _ in range(draw(st.integers(1, most))):
        at = draw(st.integers(0, len(data)))
        kind = draw(st.sampled_from(["set", "insert", "cut", "repeat"]))
        if kind == "set":
            piece = draw(st.binary(min_size=1, max_size=6))
            data[at : at + len(piece)] = piece
        elif kind == "insert":
            data[at:at] = draw(st.sampled_from(WORDS))
        elif kind == "cut":
            del data[at : at + draw(st.integers(1, 300))]
        else:
            data[at:at] = data[at : at + draw(st.integers(1, 300))]
    return bytes(data)


def check(data: bytes) -> None:
    """Either a PartError, or finite corners; then either a PartError, or a closed solid."""
    try:
        corners, warnings = parse_stl(data, "fuzz")
        raw = in_mm(raw_triangles(corners, source="fuzz", warnings=warnings), "mm", "fuzz")
    except PartError as error:
        assert str(error).startswith("fuzz")  # noqa: PT017 - both outcomes are right
        return
    assert raw.corners.shape[1:] == (3, 3)
    assert np.isfinite(raw.corners).all()
    try:
        surface, report = build_surface(raw.corners, repair="auto", bodies="all")
    except PartError:
        return
    assert enclosed_volume(surface) > 0.0
    assert report.touching_edges or open_edge_count(surface) == 0


@given(st.binary(max_size=400))
@settings(max_examples=150, deadline=None)
def test_random_bytes(data):
    check(data)


@given(mutated())
@settings(max_examples=250, deadline=None)
def test_mutated_files(data):
    check(data)


def keeps_its_void(data: bytes) -> None:
    """Whatever is answered is within 1 % of the box less its void, or refused."""
    try:
        raw = in_mm(raw_triangles(parse_stl(data, "fuzz")[0], source="fuzz"), "mm", "fuzz")
        surface, _ = build_surface(raw.corners, repair="auto")
    except PartError:
        return
    np.testing.assert_allclose(enclosed_volume(surface), HOLLOW_VOLUME, rtol=0.01)


@given(mutated(HOLLOW_SEEDS, 2))
@settings(max_examples=250, deadline=None)
def test_a_mutated_file_does_not_lose_its_void(data):
    keeps_its_void(data)


@given(st.integers(0, len(binary(HOLLOW)) - 1), st.integers(0, 24))
@settings(max_examples=100, deadline=None)
def test_a_cut_or_miscounted_binary_file_is_refused(end, count):
    data = binary(HOLLOW)
    for damaged in (data[:end], data[:80] + struct.pack("<I", count) + data[84:]):
        if count == len(HOLLOW) and len(damaged) == len(data):
            continue
        with pytest.raises(PartError, match="fuzz"):
            parse_stl(damaged, "fuzz")


def test_bytes_put_in_between_are_damage():
    """Three bytes before the facets of the void shift them to numbers next to zero."""
    data = binary(HOLLOW)
    at = 84 + 50 * len(BOX)
    with pytest.raises(PartError, match="12 facets have coordinates that no program writes"):
        parse_stl(data[:at] + bytes(3) + data[at:], "fuzz")


@given(st.permutations(range(12)), st.lists(st.booleans(), min_size=12, max_size=12))
@settings(max_examples=50, deadline=None)
def test_order_and_direction_of_facets_do_not_matter(order, flips):
    corners = np.array([BOX[k][::-1] if flips[k] else BOX[k] for k in order])
    surface, _ = build_surface(corners)
    assert open_edge_count(surface) == 0
    assert abs(enclosed_volume(surface) - 6000.0) < 1e-9


@given(
    st.floats(0.01, 100.0),
    st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    st.integers(2, 10_000),
)
@settings(max_examples=50, deadline=None)
def test_volume_follows_scale_place_and_turn(scale, shift, seed):
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]  # may mirror
    surface, report = build_surface((BOX * scale) @ turn.T + np.array(shift))
    np.testing.assert_allclose(enclosed_volume(surface), 6000.0 * scale**3, rtol=1e-6)
    assert report.facets_kept == 12

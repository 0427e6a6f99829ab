"""`gradedesign coupon`: the plate, its numbers in the metal, and its sheet."""

from __future__ import annotations

import csv
import json
from functools import partial

import numpy as np
import pytest

from gradedesign import CaseError, SurfaceMesh, load_case
from gradedesign.commands import build_registry, difference
from gradedesign_laboratory import coupon_plate, coupon_shapes
from gradedesign_laboratory.coupons import CouponPlan, Struts, planned_coupons

#: How digits look, drawn by hand.
DRAWN = {
    "0": "### #.# #.# #.# ###", "1": "..# ..# ..# ..# ..#", "2": "### ..# ### #.. ###",
    "3": "### ..# ### ..# ###", "4": "#.# #.# ### ..# ..#", "5": "### #.. ### ..# ###",
    "6": "### #.. ### #.# ###", "7": "### ..# ..# ..# ..#", "8": "### #.# ### #.# ###",
    "9": "### #.# ### ..# ###",
}  # fmt: skip


def volume(surface):
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    return np.einsum("mi,mi->", a, np.cross(b, c)) / 6.0


def is_closed(surface):
    """Whether every directed edge has its opposite exactly once."""
    ends = surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forth = {tuple(edge) for edge in ends.tolist()}
    return len(forth) == len(ends) and all((b, a) in forth for a, b in forth)


def depth_below(surface, points, top):
    """How far below the height ``top`` the topmost triangle over each point of a plane lies."""
    corners = surface.vertices[surface.faces]
    a, b, c = np.moveaxis(corners[:, :, :2], 1, 0)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    up = area > 1e-9
    found = []
    for point in points:
        v = corners[up]
        p, q, r = (v[:, k, :2] - point for k in range(3))

        def cross(m, n):
            return m[:, 0] * n[:, 1] - m[:, 1] * n[:, 0]

        weights = np.stack([cross(q, r), cross(r, p), cross(p, q)]) / area[up]
        over = (weights >= 0).all(axis=0)
        heights = np.einsum("km,mk->m", weights[:, over], v[over][:, :, 2])
        found.append(top - heights.max())
    return np.array(found)


@pytest.mark.parametrize("number", [1, 23, 46, 58, 79, 90])
def test_a_number_is_engraved_as_it_is_read(number):
    block = coupon_shapes._surface(coupon_shapes._box((0, 0, 0), (12, 12, 5)))
    numbered = difference(block, coupon_shapes.engraving(number, (6.0, 6.0), 5.0), subject="test")
    assert is_closed(numbered)
    stroke = coupon_shapes.STROKE
    left, low = 6.0 - 3.5 * stroke, 6.0 - 3.5 * stroke
    rows = []
    for row in range(6, -1, -1):
        places = [(left + (k + 0.5) * stroke, low + (row + 0.5) * stroke) for k in range(7)]
        deep = depth_below(numbered, places, 5.0)
        assert np.isin(np.round(deep, 9), [0.0, coupon_shapes.DEPTH]).all()
        rows.append("".join("#" if d > 0.1 else "." for d in deep))
    tens, ones = (DRAWN[digit].split() for digit in f"{number:02d}")
    assert rows == [*(f"{a}.{b}" for a, b in zip(tens, ones, strict=True)), ".......", "#######"]
    squares = sum(row.count("#") for row in rows)
    assert 720.0 - volume(numbered) == pytest.approx(squares * stroke**2 * coupon_shapes.DEPTH)


@pytest.mark.parametrize("inclination", [0.0, 12.0, 35.0, 60.0, 90.0])
@pytest.mark.parametrize("width", [0.3, 1.1])
def test_struts_have_the_width_and_the_inclination_that_are_stated(inclination, width):
    made = coupon_shapes.strut_coupon(
        Struts(number=7, inclination=inclination, width=width, count=4)
    )
    assert is_closed(made)
    np.testing.assert_allclose(made.vertices.min(axis=0), 0.0, atol=1e-6)
    # Cut across the axis, clear of base and posts: four sections of the circle's area.
    base = max(2.0, 1.5 * width + 0.5)
    angle = np.radians(inclination)
    along = np.array([np.cos(angle), 0.0, np.sin(angle)])
    spans = inclination < 20.0
    far = made.vertices @ along
    if spans:
        post = max(1.5, width)
        middle = coupon_shapes.NUMBER_SIZE[0] + 2.0 + post + 0.5 * max(4.0 * width, 3.0)
        start = np.array([middle, 0.0, base + 2.0 + width / 2.0])
        start[2] += np.tan(angle) * (0.5 * post + 0.5 * max(4.0 * width, 3.0))
        at = start @ along
    else:
        at = far.max() - 1.0
    sections = area_across(made, along, at, above=base + 1e-3)
    circle = np.pi * width**2 / 4.0
    assert sections == pytest.approx(4.0 * circle, rel=1e-3)
    # The same section by the horizontal plane is longer by 1 / sin.
    if not spans:
        flat = area_across(made, np.array([0.0, 0.0, 1.0]), made.vertices[:, 2].max() - 1.5)
        assert flat == pytest.approx(4.0 * circle / np.sin(angle), rel=1e-3)


def area_across(surface, normal, at, above=-np.inf):
    """Area that a plane cuts of a closed surface, above a height."""
    from manifold3d import Manifold, Mesh64

    solid = Manifold(
        Mesh64(
            vert_properties=np.array(surface.vertices),
            tri_verts=surface.faces.astype(np.uint64),
        )
    )
    thin = 1e-3
    if np.isfinite(above):
        solid = solid.trim_by_plane([0.0, 0.0, 1.0], above)
    slab = solid.trim_by_plane(list(normal), at - thin).trim_by_plane(list(-normal), -at - thin)
    return slab.volume() / (2.0 * thin)


def test_coupons_are_numbered_once_each_and_refused_beyond_two_digits():
    plan = CouponPlan(
        densities=[0.2, 0.3], sizes=[3.0, 4.0], cells=4, copies=3, inclinations=[0.0, 90.0],
        widths=[0.5], struts=5,
    )  # fmt: skip
    blocks, struts = planned_coupons(plan)
    assert [one.number for one in (*blocks, *struts)] == list(range(1, 15))
    assert {(b.density, b.size) for b in blocks} == {(r, s) for r in (0.2, 0.3) for s in (3, 4)}
    with pytest.raises(CaseError, match="would hold 102 coupons, expected at most 99"):
        planned_coupons(
            CouponPlan(
                densities=[0.2, 0.3], sizes=[4.0], cells=4, copies=50, inclinations=[0.0, 90.0],
                widths=[0.5], struts=5,
            )
        )  # fmt: skip


WORDS = (
    "coupon", "bcc", "--process", "m290-ti64", "--material", "Ti-6Al-4V", "--density", "0.3",
    "--size", "4.5 mm", "--cells", "2", "--copies", "2", "--inclination", "45", "--struts", "3",
    "--width", "0.8 mm",
)  # fmt: skip


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return tmp_path_factory.mktemp("coupons")


def test_the_plate_holds_every_coupon_and_the_sheet_a_row_for_each(cli, plate, monkeypatch):
    # On coarse voxels: the ratio has tests of its own.
    coarse = partial(coupon_plate.compressed_ratio, pairs=[(12, 16)])
    monkeypatch.setattr(coupon_plate, "compressed_ratio", coarse)
    ended = cli(*WORDS, "-o", plate, "--json")
    assert ended.code == 0, ended.err
    data = json.loads(ended.out)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    stored = np.frombuffer((plate / "plate.stl").read_bytes(), dtype=record, offset=84)
    corners = stored["corners"].astype(float).reshape(-1, 3)
    vertices, numbers = np.unique(corners, axis=0, return_inverse=True)
    surface = SurfaceMesh(vertices=vertices, faces=numbers.reshape(-1, 3))
    assert is_closed(surface)
    rho = 4.41e-3  # g/mm^3, Ti-6Al-4V of the library
    struts = coupon_shapes.strut_coupon(Struts(number=3, inclination=45.0, width=0.8, count=3))
    blocks = sum(block["mass_g"] for block in data["blocks"])
    assert volume(surface) == pytest.approx(blocks / rho + volume(struts), rel=1e-4)
    # Plates of 2 x 1.5 mm below and above 9 mm of cells at 0.3, within the 1 % of every surface.
    assert blocks / 2 / rho == pytest.approx(9**2 * (3.0 + 0.3 * 9.0) - 15.0, rel=0.015)
    assert all(block["as_built_g"] is None for block in data["blocks"])
    rows = list(csv.DictReader((plate / "sheet.csv").read_text().splitlines()[8:]))
    assert [(row["coupon"], row["strut"], row["kind"]) for row in rows] == [
        ("1", "", "block"), ("2", "", "block"),
        ("3", "1", "strut"), ("3", "2", "strut"), ("3", "3", "strut"),
    ]  # fmt: skip
    assert all(1.0 < float(row["compressed_ratio"]) < 1.6 for row in rows[:2])
    assert all(row[name] == "" for row in rows for name in ("width_mm", "mass_g", "modulus_MPa"))
    # A block is a case of its own.
    assert load_case(plate / "block-0.3-4.5mm.toml").lattice.density == 0.3


def test_a_sheet_that_may_be_filled_in_is_not_replaced(cli, plate):
    ended = cli(*WORDS, "-o", plate)
    assert ended.code == 2
    assert "is there already and may be filled in" in ended.err


def test_the_case_of_a_block_names_a_process_of_the_library():
    from gradedesign_laboratory.coupon_plate import block_case
    from gradedesign_laboratory.coupons import Block

    name = next(iter(build_registry().processes))
    block = Block(number=1, density=0.2, size=4.0, cells=4)
    data = block_case(block, cell="bcc", material="Ti-6Al-4V", process=name)
    assert data["process"] == {"name": name}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--width", "0.5"), 'found "0.5" without a unit; expected a length in quotes'),
        (("--width", "9 mm"), "--width"),
        (("--inclination", "91"), "expected degrees between 0"),
        (("--density", "1.2"), "expected a relative density between 0 and 1"),
        (("--density", "0.3"), "is given twice"),
        (("--process", "M290 Ti"), "lower case with dashes"),
        (("--cells", "1"), "expected 2 to 12 along a block"),
        (("--struts", "0"), "expected 1 to 9"),
        (("--size", "3 mm", "--cells", "2"), "its number needs 7.9 mm"),
        (("--material", "Ti64"), "Ti-6Al-4V"),
        (("--density", "0.9"), "no law for cell 'bcc' is supported between densities 0.9 and 0.9"),
    ],
)
def test_impossible_requests_are_refused(cli, tmp_path, words, message):
    ended = cli(*WORDS, *words, "-o", tmp_path / "plate")
    assert ended.code == 2
    assert message in " ".join(ended.err.split())
    assert "Traceback" not in ended.err
    assert not (tmp_path / "plate" / "sheet.csv").exists()


def test_a_cell_that_repeats_after_several_needs_a_multiple_of_them(cli, tmp_path):
    words = ("coupon", "voronoi-open", "--process", "x", "--material", "PA12", "--cells", "4")
    ended = cli(*words, "-o", tmp_path)
    assert ended.code == 2
    assert "--cells 4: cell 'voronoi-open' repeats after 5 cells" in " ".join(ended.err.split())

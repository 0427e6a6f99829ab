"""A thousand parts damaged by script: each is answered rightly, or refused by name.

Every part is one of five clean solids with one damage, of which the right answers are known: the
volume (of the solid, or of what the damage made of it), a refusal, or either of both where the
damage decides by chance. Volumes come from the Boolean kernel manifold3d on undamaged solids.
"""

from __future__ import annotations

import json
import re
from itertools import pairwise
from typing import NamedTuple

import manifold3d
import numpy as np
import pytest
from damaged_shapes import ANNULUS, binary, corners_of, cube, ring, rod, swept, text

from gradedesign.errors import PartError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.part.raw_triangles import in_mm
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume

COUNT = 1000
#: A volume this far off, told or not, is wrong.
TOLERANCE = 0.01


class Clean(NamedTuple):
    """An undamaged solid."""

    solid: manifold3d.Manifold
    bodies: str = "one"


class Damaged(NamedTuple):
    """A file, the options of the case, the volumes that are right and what may answer it."""

    data: bytes
    volumes: tuple[float, ...]
    answer: str = "volume"  # or "refusal", "either"
    bodies: str = "one"
    repair: str = "safe"


def angle() -> manifold3d.Manifold:
    body = cube(40, 20, 6) + cube(6, 20, 30)
    for y in (6, 14):
        body -= rod(20, 2.5).translate((28, y, -5))
    return body


CLEAN = {
    "box": Clean(cube(30, 20, 10).refine(3)),
    "drilled": Clean(rod(12, 15, 48) - rod(20, 5, 24).translate((0, 0, -2))),
    "angle": Clean(angle()),
    "ball": Clean(manifold3d.Manifold.sphere(10, 32) ^ cube(20, 20, 16).translate((-10, -10, -8))),
    "pair": Clean(cube(20, 10, 10) + cube(10, 10, 15).translate((30, 0, 0)), "all"),
}


def some(rng, corners, least=1, most=4) -> np.ndarray:
    return rng.choice(len(corners), int(rng.integers(least, most + 1)), replace=False)


def inner(rng, clean) -> manifold3d.Manifold:
    """A small ball or cube in the middle of the material of a body's first corner region."""
    size = rng.uniform(1.2, 2.5)
    place = {"box": (15, 10, 5), "drilled": (10, 0, 6), "angle": (3, 10, 20), "ball": (1, 2, 0)}
    at = place.get(clean, (10, 5, 5))
    ball = manifold3d.Manifold.sphere(size, 16) if rng.random() < 0.5 else None
    return (ball or cube(size, size, size).translate([-size / 2] * 3)).translate(at)


def poking(rng, solid) -> manifold3d.Manifold:
    """A bar through the first body's bottom, off the grid of its vertices."""
    low, high = np.reshape(solid.decompose()[0].bounding_box(), (2, 3))
    width = 0.2 * (high - low)[:2] * rng.uniform(0.8, 1.2)
    at = low + (high - low) * [0.61, 0.37, rng.uniform(-0.6, -0.4)]
    return cube(*width, (high - low)[2]).rotate((0, 0, 13)).translate(at)


def missing(rng, name, clean, corners):
    kept = np.delete(corners, some(rng, corners), axis=0)
    repair = str(rng.choice(["safe", "auto"]))
    answer = "refusal" if repair == "safe" else "either"
    return Damaged(binary(kept), (volume(clean),), answer, clean.bodies, repair)


def many_missing(rng, name, clean, corners):
    kept = rng.random(len(corners)) > rng.uniform(0.2, 0.5)
    repair = str(rng.choice(["safe", "auto"]))
    return Damaged(binary(corners[kept]), (), "refusal", clean.bodies, repair)


def volume(clean) -> float:
    return clean.solid.volume()


def flipped(rng, name, clean, corners):
    turned = corners.copy()
    chosen = rng.random(len(corners)) < rng.uniform(0.0, 0.35)
    turned[chosen] = turned[chosen, ::-1]
    return Damaged(binary(turned), (volume(clean),), "volume", clean.bodies)


def inverted(rng, name, clean, corners):
    return Damaged(binary(corners[:, ::-1]), (volume(clean),), "volume", clean.bodies)


def doubled(rng, name, clean, corners):
    again = corners[some(rng, corners, 1, len(corners))]
    if rng.random() < 0.5:
        again = np.roll(again, 1, axis=1)
    mixed = rng.permutation(np.concatenate([corners, again]))
    return Damaged(binary(mixed), (volume(clean),), "volume", clean.bodies)


def doubled_backwards(rng, name, clean, corners):
    again = corners[some(rng, corners, 1, 6)][:, ::-1]
    mixed = np.concatenate([corners, again])
    return Damaged(binary(mixed), (volume(clean),), "either", clean.bodies)


def doubled_otherwise(rng, name, clean, corners):
    """The whole shell twice, the second time in other facets."""
    again = corners_of(clean.solid.refine(2))
    data = binary(np.concatenate([corners, again]))
    return Damaged(data, (volume(clean),), "either", clean.bodies)


def moved_facet(rng, name, clean, corners):
    moved = corners.copy()
    moved[some(rng, corners)] += rng.uniform(0.5, 5.0, 3)
    repair = str(rng.choice(["safe", "auto"]))
    answer = "refusal" if repair == "safe" else "either"
    return Damaged(binary(moved), (volume(clean),), answer, clean.bodies, repair)


def moved_vertex(rng, name, clean, corners):
    """One vertex moved with all its facets: a dent or a bump, which is no damage."""
    point = corners.reshape(-1, 3)[rng.integers(3 * len(corners))]
    moved = corners.copy()
    moved[(corners == point).all(axis=2)] += rng.uniform(-0.3, 0.3, 3)
    a, b, c = np.moveaxis(moved, 1, 0)
    held = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
    return Damaged(binary(moved), (held,), "volume", clean.bodies)


def slivers(rng, name, clean, corners):
    """Edges split at points that only one of their facets has, closed by facets without area."""
    facets = list(corners)
    for _ in range(int(rng.integers(1, 25))):
        k = int(rng.integers(len(corners)))
        a, b, c = np.roll(facets[k], int(rng.integers(3)), axis=0)
        shares = np.sort(rng.uniform(0.05, 0.95, int(rng.integers(1, 5))))
        chain = [a, *(a + s * (b - a) for s in shares), b]
        facets[k] = np.array([chain[0], chain[1], c])
        facets += [np.array([p, q, c]) for p, q in pairwise(chain[1:])]
        facets += [np.array([a, q, p]) for p, q in pairwise(chain[1:])]
    return Damaged(binary(np.array(facets)), (volume(clean),), "volume", clean.bodies)


def points_for_facets(rng, name, clean, corners):
    points = corners[some(rng, corners, 1, 20)].copy()
    points[:, 2] = points[:, int(rng.integers(2))]
    mixed = rng.permutation(np.concatenate([corners, points]))
    return Damaged(binary(mixed), (volume(clean),), "volume", clean.bodies)


def not_finite(rng, name, clean, corners):
    spoiled = corners.copy()
    value = rng.choice([np.nan, np.inf, -np.inf, 1e12, -1e30])
    spoiled[rng.integers(len(corners)), rng.integers(3), rng.integers(3)] = value
    repair = str(rng.choice(["safe", "auto"]))
    return Damaged(binary(spoiled), (), "refusal", clean.bodies, repair)


def void(rng, name, clean, corners):
    hole = inner(rng, name)
    data = binary(np.concatenate([corners, corners_of(hole)[:, ::-1]]))
    return Damaged(data, (volume(clean) - hole.volume(),), "volume", clean.bodies)


def void_turned_around(rng, name, clean, corners):
    """All facets inside out, the void's too."""
    hole = inner(rng, name)
    data = binary(np.concatenate([corners[:, ::-1], corners_of(hole)]))
    return Damaged(data, (volume(clean) - hole.volume(),), "volume", clean.bodies)


def filled_void(rng, name, clean, corners):
    """An inner shell that runs the outer way round bounds nothing."""
    data = binary(np.concatenate([corners, corners_of(inner(rng, name))]))
    return Damaged(data, (volume(clean),), "volume", clean.bodies)


def crossing_voids(rng, name, clean, corners):
    hole = inner(rng, name)
    other = hole.translate((0.4, 0.3, 0.35))
    shells = [corners, corners_of(hole)[:, ::-1], corners_of(other)[:, ::-1]]
    right = volume(clean) - (hole + other).volume()
    return Damaged(binary(np.concatenate(shells)), (right,), "volume", clean.bodies)


def boss(rng, name, clean, corners):
    bar = poking(rng, clean.solid)
    data = binary(np.concatenate([corners, corners_of(bar)]))
    return Damaged(data, ((clean.solid + bar).volume(),), "either", clean.bodies)


def cut(rng, name, clean, corners):
    bar = poking(rng, clean.solid)
    data = binary(np.concatenate([corners, corners_of(bar)[:, ::-1]]))
    return Damaged(data, ((clean.solid - bar).volume(),), "either", "all")


def twice_shifted(rng, name, clean, corners):
    shift = rng.uniform(1.0, 4.0, 3)
    data = binary(np.concatenate([corners, corners + shift]))
    both = clean.solid + clean.solid.translate(shift)
    return Damaged(data, (both.volume(),), "volume", clean.bodies)


def open_inner_shell(rng, name, clean, corners):
    hole = inner(rng, name)
    shell = np.delete(corners_of(hole)[:, ::-1], some(rng, corners_of(hole), 1, 2), axis=0)
    data = binary(np.concatenate([corners, shell]))
    repair = str(rng.choice(["safe", "auto"]))
    answer = "refusal" if repair == "safe" else "either"
    return Damaged(data, (volume(clean) - hole.volume(),), answer, clean.bodies, repair)


def swept_into_itself(rng, name, clean, corners):
    """The ring closed by a bar that overlaps its own beginning: the annulus, by its formula."""
    facets = ring(rng.uniform(1.05, 1.8), int(rng.integers(70, 100)))
    if rng.random() < 0.3:
        facets = facets[:, ::-1]
    return Damaged(binary(facets), (ANNULUS,), "volume")


def bow_tie(rng, name, clean, corners):
    """A prism over a crossed quadrangle: half of it is inside out."""
    high = rng.uniform(5.0, 12.0)
    outline = np.array([[0, 0], [30, rng.uniform(10, 25)], [30, 0], [0, rng.uniform(8, 25)]])
    stations = np.array([np.column_stack([outline, np.full(4, z)]) for z in (0.0, high)])
    return Damaged(binary(swept(stations)), (), "refusal")


def count_high(rng, name, clean, corners):
    high = len(corners) + int(rng.choice([1, 3, 1000, 2**31]))
    return Damaged(binary(corners, high), (), "refusal", clean.bodies)


def count_low(rng, name, clean, corners):
    """The last shell, or some facets, are behind the declared ones."""
    hole = corners_of(inner(rng, name))[:, ::-1]
    lost = len(hole) if rng.random() < 0.7 else int(rng.integers(1, len(corners)))
    data = binary(np.concatenate([corners, hole]), len(corners) + len(hole) - lost)
    return Damaged(data, (), "refusal", clean.bodies)


def truncated(rng, name, clean, corners):
    data = binary(corners)
    return Damaged(data[: int(rng.integers(0, len(data)))], (), "refusal", clean.bodies)


def trailing(rng, name, clean, corners):
    size = int(rng.integers(1, 1000))
    if rng.random() < 0.5:
        return Damaged(binary(corners) + bytes(size), (volume(clean),), "volume", clean.bodies)
    return Damaged(binary(corners) + rng.bytes(size), (volume(clean),), "either", clean.bodies)


def overwritten(rng, name, clean, corners):
    data = bytearray(binary(corners))
    at = int(rng.integers(len(data)))
    size = int(rng.integers(1, 9))
    data[at : at + size] = rng.bytes(len(data[at : at + size]))
    return Damaged(bytes(data), (volume(clean),), "either", clean.bodies, "auto")


def garbage(rng, name, clean, corners):
    start = rng.choice([b"", b"solid ", b"\0" * 80, b"solid part\nfacet normal 0 0 0\n"])
    return Damaged(bytes(start) + rng.bytes(int(rng.integers(0, 3000))), (), "refusal")


def odd_text(rng, name, clean, corners):
    """ASCII that is unusual, not damaged."""
    whole = text(corners) if rng.random() < 0.5 else text(corners[:5], corners[5:])
    change = int(rng.integers(4))
    if change == 0:
        whole = whole.replace("\n", "\r\n")
    elif change == 1:
        whole = whole.upper()
    elif change == 2:
        whole = whole.replace("vertex", "\t  vertex").replace("endfacet\n", "endfacet\n\n")
    return Damaged(whole.encode(), (volume(clean),), "volume", clean.bodies)


def cut_text(rng, name, clean, corners):
    """ASCII cut anywhere before its end, or between two shells."""
    shells = [corners, corners_of(inner(rng, name))[:, ::-1]]
    whole = text(np.concatenate(shells)) if rng.random() < 0.5 else text(*shells)
    places = [m.end() for m in re.finditer("endfacet\n", whole)]
    at = places[len(corners) - 1]
    if rng.random() < 0.6:
        at = int(rng.integers(10, places[-1]))
    if "endsolid" in whole[:at]:  # the whole first of two solids: nothing tells that more followed
        at = places[len(corners) - 1]
    return Damaged(whole[:at].encode(), (), "refusal", clean.bodies)


def wrong_text(rng, name, clean, corners):
    whole = text(corners)
    words = ["endloop", "vertex", "facet", "outer", "e+0"]
    word = words[int(rng.integers(len(words)))]
    other = str(rng.choice(["", "nonsense", "nan", "1,5", "\x00"]))
    spots = [m.start() for m in re.finditer(re.escape(word), whole)]
    at = spots[int(rng.integers(len(spots)))]
    whole = whole[:at] + other + whole[at + len(word) :]
    return Damaged(whole.encode(), (volume(clean),), "either", clean.bodies)


def astray(rng, name, clean, corners):
    far = rng.uniform(1e3, 9e6) * rng.choice([-1.0, 1.0], 3)
    stray = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]) * max(1.0, 1e-6 * abs(far).max()) + far
    repair = str(rng.choice(["safe", "auto"]))
    answer = "refusal" if repair == "safe" else "either"
    data = binary(np.concatenate([corners, stray]))
    return Damaged(data, (volume(clean),), answer, clean.bodies, repair)


def fragments(rng, name, clean, corners):
    """A few tiny cubes are dropped; many, or larger ones, are solids of their own."""
    size, count = rng.uniform(0.1, 0.9), int(rng.integers(1, 6))
    if rng.random() < 0.4:
        size, count = (1e-3 * volume(clean)) ** (1 / 3) * 0.95, int(rng.integers(30, 90))
    step = 2.0 * size + 0.5
    one = corners_of(cube(size, size, size))
    loose = [one + np.array([60, k % 9 * step, k // 9 * step]) for k in range(count)]
    data = binary(np.concatenate([corners, *loose]))
    right = volume(clean) + count * size**3
    bodies = str(rng.choice([clean.bodies, "all"]))
    many = count >= 30
    answer = "refusal" if many and bodies == "one" else "volume"
    return Damaged(data, (right,) if many else (right, volume(clean)), answer, bodies)


def fragments_across(rng, name, clean, corners):
    """Two overlapping fragments beside the part."""
    one = corners_of(cube(0.3, 0.3, 0.3))
    loose = np.concatenate([one, one + np.array([0.15, 0.1, 0.12])]) + 60.0
    return Damaged(
        binary(np.concatenate([corners, loose])), (volume(clean),), "volume", clean.bodies
    )


def flattened(rng, name, clean, corners):
    flat = corners.copy()
    flat[:, :, int(rng.integers(3))] = rng.uniform(-5, 5)
    return Damaged(binary(flat), (), "refusal", clean.bodies)


def spike_lost(rng, name, clean, corners):
    """All sides of a spike over one facet of a coarse box are missing."""
    coarse = np.delete(corners_of(cube(20, 20, 20)), int(rng.integers(12)), axis=0)
    return Damaged(binary(coarse), (), "refusal", "one", "auto")


def far_away(rng, name, clean, corners):
    """Far from the origin, as far as single precision holds the shape within a per cent."""
    moved = corners + rng.choice([-1.0, 1.0], 3) * 10 ** rng.uniform(2, 3.5)
    return Damaged(binary(moved), (volume(clean),), "either", clean.bodies)


def rough(rng, name, clean, corners):
    """Corners that agree only within noise, below or above the weld tolerance."""
    noise = 10 ** rng.uniform(-7, -3)
    moved = corners + rng.uniform(-noise, noise, corners.shape)
    return Damaged(text(moved).encode(), (volume(clean),), "either", clean.bodies)


DAMAGES = (
    missing, many_missing, flipped, inverted, doubled, doubled_backwards, doubled_otherwise,
    moved_facet, moved_vertex, slivers, points_for_facets, not_finite, void, void_turned_around,
    filled_void, crossing_voids, boss, cut, twice_shifted, open_inner_shell, swept_into_itself,
    bow_tie, count_high, count_low, truncated, trailing, overwritten, garbage, odd_text, cut_text,
    wrong_text, astray, fragments, fragments_across, flattened, spike_lost, far_away, rough,
)  # fmt: skip


def make(k: int) -> Damaged:
    """Part number k: a damage, a solid and a random stream of its own."""
    damage = DAMAGES[k % len(DAMAGES)]
    names = list(CLEAN)
    name = names[k // len(DAMAGES) % len(names)]
    clean = CLEAN[name]
    return damage(np.random.default_rng([2027, k]), name, clean, corners_of(clean.solid))


def verdict(part: Damaged, found: float | None, refused: str) -> str:
    """What is wrong with an answer; empty if nothing is."""
    if found is None:
        return "" if part.answer != "volume" else f"refused: {refused}"
    if part.answer == "refusal":
        return f"answered {found:.6g} mm^3, should be refused"
    if any(abs(found - right) <= TOLERANCE * right for right in part.volumes):
        return ""
    return f"answered {found:.6g} mm^3, right is {part.volumes}"


@pytest.mark.parametrize("damage", range(len(DAMAGES)), ids=[d.__name__ for d in DAMAGES])
def test_damaged_parts_are_answered_rightly_or_refused(tmp_path, damage):
    wrong = []
    for k in range(damage, COUNT, len(DAMAGES)):
        part = make(k)
        path = tmp_path / "part.stl"
        path.write_bytes(part.data)
        try:
            raw = in_mm(read_stl(path), "mm", path.name)
            surface, _ = build_surface(raw.corners, repair=part.repair, bodies=part.bodies)
            found, refused = enclosed_volume(surface), ""
        except PartError as error:
            found, refused = None, str(error)
        complaint = verdict(part, found, refused)
        if complaint:
            wrong.append(f"{k} {list(CLEAN)[k // len(DAMAGES) % 5]}: {complaint}")
    assert not wrong, "\n".join(wrong)


CASE = """\
[case]
name = "damaged"
[part]
file = "part.stl"
units = "mm"
mesh_size = "5 mm"
repair = "{repair}"
bodies = "{bodies}"
[region.low]
plane = "z = min"
[region.high]
plane = "z = max"
[material]
youngs_modulus = "200 GPa"
poissons_ratio = 0.3
density = "7.85 g/cm^3"
[[load_case]]
name = "push"
fix = [{{region = "low"}}]
load = [{{region = "high", force = ["0 N", "0 N", "-50 N"]}}]
[limits]
stress = "50 MPa"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.10, 0.65]
[output]
formats = ["stl"]
"""


def checked(cli, folder, k) -> str:
    """What is wrong with the answer of ``gradedesign check``; empty if nothing is.

    Beside the part, regions and loads may be refused, by name: some damages move the faces.
    """
    part = make(k)
    (folder / "part.stl").write_bytes(part.data)
    (folder / "case.toml").write_text(CASE.format(repair=part.repair, bodies=part.bodies))
    ended = cli("check", folder / "case.toml", "--json", "--no-picture")
    if "Traceback" in ended.out + ended.err or ended.code not in (0, 2, 3, 6):
        return f"{k}: exit {ended.code}: {ended.err[-2000:]}"
    found = json.loads(ended.out)["part"]["volume_mm3"] if ended.code == 0 else None
    if found is None:
        return "" if ended.err.strip() else f"{k}: exit {ended.code} without a word"
    complaint = verdict(part, found, ended.err)
    return f"{k}: {complaint}" if complaint else ""


def test_check_answers_damaged_parts_rightly_or_refuses_them(cli, tmp_path):
    """One part in 74, each with another kind of damage."""
    assert not [c for k in range(32, COUNT, 74) if (c := checked(cli, tmp_path, k))]


@pytest.mark.slow
@pytest.mark.parametrize("damage", range(len(DAMAGES)), ids=[d.__name__ for d in DAMAGES])
def test_check_answers_all_damaged_parts_rightly_or_refuses_them(cli, tmp_path, damage):
    chosen = range(damage, COUNT, len(DAMAGES))
    assert not [c for k in chosen if (c := checked(cli, tmp_path, k))]

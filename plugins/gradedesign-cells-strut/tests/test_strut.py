"""The strut cells; expected numbers are lengths, areas and volumes of elementary geometry."""

from dataclasses import replace

import numpy as np
import pytest

from gradedesign import CaseError, PluginError
from gradedesign.fields import graph_segments
from gradedesign.testing import check_cell_family
from gradedesign_cells_strut import (
    bcc,
    bccz,
    cuboctahedron,
    diamond,
    f2bcc,
    fcc,
    fccz,
    gradedesign_cell_families,
    kelvin,
    octet,
    rhombic_dodecahedron,
    sc,
    strut_family,
)
from gradedesign_cells_strut.paths import bent_segments
from gradedesign_cells_strut.sections import section_normals, strut_frames

FAMILIES = {family.name: family for family in gradedesign_cell_families()}
FACE, SPACE = 2**0.5, 3**0.5

#: Module, struts in a cell, length of strut in a cell, largest and smallest number of struts at a
#: node: counted from the polyhedra in each module's docstring.
GRAPHS = {
    "sc": (sc, 3, 3.0, 6, 6),
    "bcc": (bcc, 8, 4 * SPACE, 8, 8),
    "bccz": (bccz, 9, 4 * SPACE + 1, 10, 8),
    "fcc": (fcc, 12, 6 * FACE, 12, 4),
    "fccz": (fccz, 13, 6 * FACE + 1, 14, 4),
    "f2bcc": (f2bcc, 20, 6 * FACE + 4 * SPACE, 20, 4),
    "octet": (octet, 24, 12 * FACE, 12, 12),
    "kelvin": (kelvin, 24, 6 * FACE, 4, 4),
    "diamond-strut": (diamond, 16, 4 * SPACE, 4, 4),
    "cuboctahedron": (cuboctahedron, 12, 6 * FACE, 8, 8),
    "rhombic-dodecahedron": (rhombic_dodecahedron, 32, 8 * SPACE, 8, 4),
}
every_graph = pytest.mark.parametrize("name", GRAPHS)


def samples(count):
    """Points that fill the cell evenly: an additive recurrence with the plastic number's kin."""
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return np.mod(0.3141 + step[:, None] * np.arange(count), 1.0)


def lengths(segments):
    return np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)


def test_every_cell_is_there():
    sections = {f"{name}{end}" for name in GRAPHS for end in ("", "-square", "-triangle")}
    paths = {f"{name}-{path}" for name in ("sc", "bcc") for path in ("wave", "helix")}
    assert set(FAMILIES) == sections | paths | {"sc-bcc"}


def kinds():
    """Every family; of angular and bent ones some at once, the rest with the slow tests."""
    quick = {"sc-square", "octet-square", "bcc-triangle", "sc-wave", "bcc-helix", "sc-bcc"}
    for name, family in FAMILIES.items():
        slow = name not in quick and name not in GRAPHS
        yield pytest.param(family, id=name, marks=[pytest.mark.slow] if slow else [])


@pytest.mark.parametrize("family", list(kinds()))
def test_conforms(family):
    check_cell_family(family)


def test_filleted_struts_conform():
    family = FAMILIES["bcc"]
    parameters = {**family.parameters, "fillet": 1.0}
    # A distance only without fillets, as with balls.
    check_cell_family(replace(family, parameters=parameters, distance=False))


def test_fillets_and_balls_add_to_the_struts():
    family, points = FAMILIES["bcc"], samples(5000)
    plain = family.shape(points)
    filleted = family.shape(points, fillet=0.8)
    assert (filleted <= plain).all()
    both = family.shape(points, fillet=0.8, node_ratio=2.0)
    balls = family.shape(points, node_ratio=2.0)
    np.testing.assert_array_equal(both, np.minimum(filleted, np.where(balls < plain, balls, both)))
    # A file of beams has no fillets: those go out as triangles.
    assert family.struts(fillet=0.8) is None
    assert family.struts(fillet=0.0) is not None


@every_graph
def test_struts_are_those_of_the_polyhedra(name):
    module, count, total, most, least = GRAPHS[name]
    segments = graph_segments(module.NODES, module.EDGES)
    assert len(segments) == count
    assert lengths(segments).sum() == pytest.approx(total, rel=1e-12)
    ends = np.round(np.mod(segments.reshape(-1, 3), 1.0), 6) % 1.0
    degree = np.unique(ends, axis=0, return_counts=True)[1]
    assert (degree.max(), degree.min()) == (most, least)


@every_graph
@pytest.mark.parametrize(
    ("end", "area"), [("", np.pi), ("-square", 4.0), ("-triangle", 3 * 3**0.5)]
)
def test_thin_struts_fill_area_times_length(name, end, area):
    # rho = A L t^2 less overlaps at nodes, of order t^3. From two radii the t^3 term cancels:
    # (8 rho(t) - rho(2 t)) / 4 t^2 = A L. Sections of inscribed radius 1: circle, square, triangle.
    # For the octet that is Deshpande, Fleck & Ashby's 6 sqrt(2) pi (a / l)^2.
    family = FAMILIES[name + end]
    t, total = 0.03, GRAPHS[name][2]
    value = family.shape(samples(500_000))
    found = (8 * np.mean(value <= t) - np.mean(value <= 2 * t)) / (4 * t**2)
    assert found == pytest.approx(area * total, rel=0.015)


def test_sc_volume_is_that_of_three_crossing_cylinders():
    # 3 pi r^2 - 8 sqrt(2) r^3 (Steinmetz tricylinder and bicylinders).
    value = FAMILIES["sc"].shape(samples(500_000))
    for r in (0.1, 0.2, 0.35):
        exact = 3 * np.pi * r**2 - 8 * 2**0.5 * r**3
        assert np.mean(value <= r) == pytest.approx(exact, abs=0.001)


def test_cubic_bars_of_square_section():
    # Three square bars of width w: 3 w^2 - 2 w^3.
    value = FAMILIES["sc-square"].shape(samples(500_000))
    for t in (0.05, 0.15, 0.3):
        w = 2 * t
        assert np.mean(value <= t) == pytest.approx(3 * w**2 - 2 * w**3, abs=0.001)


@pytest.mark.parametrize(
    ("name", "symmetry"),
    [
        ("octet", "cubic"),
        ("bccz", "tetragonal"),
        ("fccz", "tetragonal"),
        # Sides parallel to the faces of the cube keep its symmetry; three about a space diagonal
        # can not all lie alike.
        ("fcc-square", "cubic"),
        ("kelvin-square", "cubic"),
        ("sc-square", "cubic"),
        ("bcc-square", "orthotropic"),
        ("sc-triangle", "none"),
        ("sc-helix", "none"),
        ("sc-bcc", "cubic"),
    ],
)
def test_declared_symmetry(name, symmetry):
    assert FAMILIES[name].symmetry == symmetry


@pytest.mark.parametrize("name", ["sc", "bcc", "octet", "bcc-square"])
def test_balls_at_nodes(name):
    # A ball of radius k t at each node: inside it the shape is distance / k.
    family, ratio = FAMILIES[name], 2.0
    rng = np.random.default_rng(77)
    away = rng.normal(size=(3, 400))
    away *= 0.1 * rng.uniform(size=400) / np.linalg.norm(away, axis=0)
    plain = family.shape(away)
    found = family.shape(away, node_ratio=ratio)
    np.testing.assert_allclose(
        found, np.minimum(plain, np.linalg.norm(away, axis=0) / ratio), atol=1e-12
    )
    far = samples(2000)
    assert (family.shape(far, node_ratio=ratio) <= family.shape(far)).all()


def test_sections_have_their_sides():
    segments = graph_segments(octet.NODES, octet.EDGES)
    along, first, second = strut_frames(segments)
    for a, b in ((along, first), (along, second), (first, second)):
        np.testing.assert_allclose((a * b).sum(axis=1), 0, atol=1e-12)
    # A strut along a face diagonal: a side parallel to the face.
    assert (np.abs(first).max(axis=1) == 1).all()
    for section, sides in (("square", 4), ("triangle", 3)):
        normals = section_normals(segments, section)
        assert normals.shape == (24, sides, 3)
        np.testing.assert_allclose(normals.sum(axis=1), 0, atol=1e-12)


def test_a_wave_is_where_its_formula_says():
    # Along x the wave goes up y: y = A sin(2 pi n x).
    family = FAMILIES["sc-wave"]
    s = np.linspace(0.05, 0.95, 61)
    on_wave = np.stack([s, 0.08 * np.sin(2 * np.pi * 2 * s), 0 * s])
    value = family.shape(on_wave, amplitude=0.08, waves=2.0)
    # Chords of 24 pieces leave the curve by at most A (1 - cos(pi / 24)) = 0.0086 A.
    assert value.max() < 0.0087 * 0.08


def test_a_helix_winds_to_the_right_at_its_radius():
    family = FAMILIES["sc-helix"]
    s = np.linspace(0.25, 0.75, 61)
    angle = 2 * np.pi * 3 * s
    # Across a strut along z, e1 is x and e2 is y.
    for turn, near in ((1, True), (-1, False)):
        line = np.stack([0.06 * np.cos(angle), turn * 0.06 * np.sin(angle), s])
        value = family.shape(line, amplitude=0.06, turns=3.0)
        assert (value.max() < 0.0087 * 0.06) == near


@pytest.mark.parametrize("path", ["wave", "helix"])
def test_bent_struts_meet_at_their_nodes(path):
    segments = graph_segments(bcc.NODES, bcc.EDGES)
    bent = bent_segments(segments, path, 0.07, 2.0)
    pieces = bent.reshape(len(segments), -1, 2, 3)
    np.testing.assert_allclose(pieces[:, 1:, 0], pieces[:, :-1, 1], atol=1e-15)
    ends = np.sort(np.round(np.stack([pieces[:, 0, 0], pieces[:, -1, 1]], axis=1), 9), axis=1)
    np.testing.assert_allclose(ends, np.sort(np.round(segments, 9), axis=1))
    assert lengths(bent).sum() > 1.05 * lengths(segments).sum()


def test_no_amplitude_is_the_straight_strut():
    points = samples(3000)
    for name in ("sc", "bcc"):
        for path in ("wave", "helix"):
            found = FAMILIES[f"{name}-{path}"].shape(points, amplitude=0.0)
            np.testing.assert_array_equal(found, FAMILIES[name].shape(points))


def test_the_mixture_shares_its_material():
    # Thin struts: 2/5 of the volume in the 3 cells of cubic struts of radius r, 3/5 in 4 sqrt(3)
    # cells of oblique ones of radius t, so r^2 / t^2 = (0.4 / 3) / (0.6 / (4 sqrt 3)).
    family, points = FAMILIES["sc-bcc"], samples(20_000)
    ratio = ((0.4 / 3) / (0.6 / (4 * 3**0.5))) ** 0.5
    oblique, straight = FAMILIES["bcc"].shape(points), FAMILIES["sc"].shape(points)
    np.testing.assert_allclose(family.shape(points), np.minimum(oblique, straight / ratio))
    other = family.shape(points, sc_share=0.2)
    thick = ((0.8 / (4 * 3**0.5)) / (0.2 / 3)) ** 0.5
    np.testing.assert_allclose(other, np.minimum(oblique / thick, straight))


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("bcc", {"node_ratio": 0.5}, "0.5 times the radius"),
        ("bcc", {"fillet": 2.5}, "2.5 times the radius"),
        ("sc-wave", {"amplitude": -0.1}, "-0.1 cells"),
        ("sc-helix", {"turns": 1.5}, "1.5 turns"),
        ("sc-bcc", {"sc_share": 1.0}, "share of 1"),
    ],
)
def test_parameters_out_of_range_are_refused(name, parameters, message):
    with pytest.raises(CaseError, match=message):
        FAMILIES[name].shape(samples(3), **parameters)


CORNER = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
CUBES = [[0, 1], [0, 2], [0, 3]]


def test_a_graph_of_ones_own():
    family = strut_family("mine", CORNER, CUBES, section="square", source="me")
    np.testing.assert_array_equal(
        family.shape(samples(99)), FAMILIES["sc-square"].shape(samples(99))
    )
    assert (family.source, family.symmetry, family.distance) == ("me", "cubic", False)


@pytest.mark.parametrize(
    ("nodes", "edges", "settings", "message"),
    [
        ([*CORNER, [0.5, 0.5, 0.5]], CUBES, {}, r"cell 'mine': node 4 \(0.5, 0.5, 0.5\) is isolat"),
        ([*CORNER, [0.5, 0, 0]], [*CUBES, [0, 4]], {}, r"cell 'mine': only one strut ends at node"),
        (CORNER, [*CUBES, [1, 1]], {}, "cell 'mine': strut 3 .* length zero"),
        (CORNER, CUBES, {"section": "star"}, "section 'star'"),
        (CORNER, CUBES, {"section": "square", "path": "wave"}, "possible are round straight"),
    ],
)
def test_impossible_graphs_are_refused(nodes, edges, settings, message):
    with pytest.raises(PluginError, match=message):
        strut_family("mine", nodes, edges, **settings)

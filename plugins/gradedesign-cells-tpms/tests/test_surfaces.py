"""Formulas, names and sides of the surfaces, and what literature prints wrongly about them."""

import re
from math import cos, pi, sin

import numpy as np
import pytest

from gradedesign import CellFamily, PluginError
from gradedesign.testing import check_cell_family
from gradedesign_cells_tpms import (
    c_y,
    diamond_raymont,
    frd,
    gradedesign_cell_families,
    gyroid_raymont,
    iwp,
    lidinoid,
    neovius,
    neovius_as_printed,
    pinched_primitive,
    primitive,
)

FAMILIES = {family.name: family for family in gradedesign_cell_families()}

#: Ends of the names of the networks of every surface, and the variant that ends them all.
NETWORKS = {
    ("c-y", ""): ("",),
    ("diamond", ""): ("",),
    ("diamond", "-raymont"): ("", "-opposite"),
    ("fischer-koch-s", ""): ("",),
    ("frd", ""): ("", "-f"),
    ("gyroid", ""): ("",),
    ("gyroid", "-raymont"): ("", "-opposite"),
    ("iwp", ""): ("", "-i"),
    ("lidinoid", ""): ("", "-opposite"),
    ("neovius", ""): ("",),
    ("neovius", "-as-printed"): ("",),
    ("pinched-primitive", ""): ("", "-opposite"),
    ("pm-y", ""): ("",),
    ("primitive", ""): ("",),
    ("split-p", ""): ("", "-opposite"),
}


def samples(count):
    """Points that fill the cell evenly: an additive recurrence with the plastic number's kin."""
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return np.mod(0.2718 + step[:, None] * np.arange(count), 1.0)


def test_every_surface_gives_sheet_networks_and_wall():
    expected = set()
    for (surface, variant), ends in NETWORKS.items():
        expected |= {f"{surface}-sheet{variant}", f"{surface}-wall{variant}"}
        expected |= {f"{surface}-network{variant}{end}" for end in ends}
    assert set(FAMILIES) == expected


@pytest.mark.parametrize(("surface", "variant"), NETWORKS)
def test_sheet_and_networks_share_a_surface(surface, variant):
    points = samples(2000)
    sheet = FAMILIES[f"{surface}-sheet{variant}"].shape(points)
    sides = [
        FAMILIES[f"{surface}-network{variant}{end}"].shape(points)
        for end in NETWORKS[surface, variant]
    ]
    np.testing.assert_array_equal(sheet, np.abs(sides[0]))
    if len(sides) == 2:
        np.testing.assert_array_equal(sides[1], -sides[0])


@pytest.mark.parametrize(("surface", "variant"), NETWORKS)
def test_a_second_network_only_where_the_sides_differ(surface, variant):
    # At every level the shares of f <= -t and f >= t, which are equal where both are one cell.
    shape = FAMILIES[f"{surface}-network{variant}"].shape
    values = [np.sort(sign * shape(samples(400_000))) for sign in (1, -1)]
    levels = np.linspace(values[0][0], values[0][-1], 41)
    first, second = (np.searchsorted(v, levels) / v.size for v in values)
    apart = np.abs(first - second).max()
    assert apart > 0.01 if len(NETWORKS[surface, variant]) == 2 else apart < 0.002


def at(*points):
    """Points given as whole eighths of the cell."""
    return np.array(points, dtype=float).T / 8


@pytest.mark.parametrize(
    ("name", "inside", "outside"),
    [
        # I: a body-centred lattice and the middles of its eight struts to nearest neighbours.
        ("iwp-network-i", [(0, 0, 0), (4, 4, 4), (2, 2, 2), (2, 6, 2)], [(4, 0, 0), (4, 4, 0)]),
        ("iwp-network", [(4, 0, 0), (4, 4, 0)], [(0, 0, 0), (4, 4, 4), (2, 2, 2)]),
        # F: a face-centred lattice and the middles of its twelve struts.
        ("frd-network-f", [(0, 0, 0), (4, 4, 0), (2, 2, 0)], [(4, 0, 0), (4, 4, 4), (2, 2, 2)]),
        # RD: nodes of eight struts and of four, on the edges of rhombic dodecahedra.
        ("frd-network", [(4, 0, 0), (4, 4, 4), (2, 2, 2), (6, 2, 2)], [(0, 0, 0), (4, 4, 0)]),
        # Struts along the axes, through the middles of edges and faces of the cell.
        ("pinched-primitive-network", [(4, 4, 0), (4, 4, 2)], [(0, 0, 0), (0, 0, 4)]),
        ("pinched-primitive-network-opposite", [(0, 0, 0), (0, 0, 4)], [(4, 4, 0), (4, 4, 4)]),
    ],
)
def test_sides_hold_their_graphs(name, inside, outside):
    shape = FAMILIES[name].shape
    level = np.quantile(shape(samples(100_000)), 0.35)
    assert (shape(at(*inside)) <= level).all()
    assert (shape(at(*outside)) > level).all()


def test_denser_means_more_of_every_side():
    # Raymont's listings take the solid now above, now below the level; ours grows with the level.
    points = samples(20_000)
    for family in FAMILIES.values():
        if "-wall" not in family.name:
            value = family.shape(points)
            low, high = np.quantile(value, (0.2, 0.6))
            assert low < high
            assert np.mean(value <= high) - np.mean(value <= low) == pytest.approx(0.4, abs=0.01)


def printed_primitive(x, y, z):
    return cos(x) + cos(y) + cos(z) - 1


def printed_gyroid(x, y, z):
    return 10 * (cos(x) * sin(y) + cos(y) * sin(z) + cos(z) * sin(x)) - 0.5 * (
        cos(2 * x) * cos(2 * y) + cos(2 * y) * cos(2 * z) + cos(2 * z) * cos(2 * x)
    )


def printed_first_w(x, y, z):
    return (
        10 * (cos(x) * cos(y) + cos(y) * cos(z) + cos(z) * cos(x))
        - 5 * (cos(2 * x) + cos(2 * y) + cos(2 * z))
        - 14
    )


def printed_second_w(x, y, z):
    a, b, c = x - pi / 4, y - pi / 4, z - pi / 4
    return (
        10
        * (
            sin(a) * sin(b) * sin(c)
            + sin(a) * cos(b) * cos(c)
            + cos(a) * sin(b) * cos(c)
            + cos(a) * cos(b) * sin(c)
        )
        - 0.7 * (cos(4 * x) + cos(4 * y) + cos(4 * z))
        - 11
    )


def printed_pinched(x, y, z):
    return -(
        2.25 * (cos(x) + cos(y) + cos(z))
        + 1.25 * (cos(x) * cos(y) + cos(y) * cos(z) + cos(z) * cos(x))
    )


def printed_neovius(x, y, z):
    return -(
        -sin(x) * sin(y) * sin(z)
        + sin(2 * x) * sin(y)
        + sin(2 * y) * sin(z)
        + sin(x) * sin(2 * z)
        - cos(x) * cos(y) * cos(z)
        + sin(2 * x) * cos(z)
        + cos(x) * sin(2 * y)
        + cos(y) * sin(2 * z)
    )


@pytest.mark.parametrize(
    ("printed", "ours"),
    [
        # Appendix A of Raymont's thesis as printed, and what stands for it here.
        (printed_primitive, lambda u: primitive.primitive(u) - 1),
        (printed_gyroid, gyroid_raymont.gyroid_raymont),
        (printed_first_w, lambda u: 5 * iwp.iwp(u) - 14),
        (printed_second_w, lambda u: diamond_raymont.diamond_raymont(u) - 11),
        (printed_pinched, pinched_primitive.pinched_primitive),
        (printed_neovius, neovius_as_printed.neovius_as_printed),
        (printed_neovius, lambda u: -c_y.c_y(u)),
    ],
    ids=lambda f: getattr(f, "__name__", "ours"),
)
def test_formulas_of_the_appendix(printed, ours):
    points = np.random.default_rng(509).uniform(-1, 1, size=(3, 400))
    expected = [printed(*p) for p in 2 * pi * points.T]
    np.testing.assert_allclose(ours(points), expected, rtol=0, atol=2e-12)


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        (
            "neovius",
            lambda x, y, z: 3 * (cos(x) + cos(y) + cos(z)) + 4 * cos(x) * cos(y) * cos(z),
        ),
        (
            "frd",
            lambda x, y, z: (
                4 * cos(x) * cos(y) * cos(z)
                - cos(2 * x) * cos(2 * y)
                - cos(2 * y) * cos(2 * z)
                - cos(2 * z) * cos(2 * x)
            ),
        ),
        (
            "fischer-koch-s",
            lambda x, y, z: (
                cos(2 * x) * sin(y) * cos(z)
                + cos(x) * cos(2 * y) * sin(z)
                + sin(x) * cos(y) * cos(2 * z)
            ),
        ),
        (
            # Fisher et al., Data in Brief 49 (2023) 109311, after von Schnering and Nesper 1991.
            "pm-y",
            lambda x, y, z: (
                2 * cos(x) * cos(y) * cos(z)
                + sin(2 * x) * sin(y)
                + sin(x) * sin(2 * z)
                + sin(2 * y) * sin(z)
            ),
        ),
        (
            # The same list: C(Y), not C(+-Y), which is -2 cXcYcZ + s2XsY + sXs2Z + s2YsZ.
            "c-y",
            lambda x, y, z: (
                -sin(x) * sin(y) * sin(z)
                + sin(2 * x) * sin(y)
                + sin(2 * y) * sin(z)
                + sin(x) * sin(2 * z)
                - cos(x) * cos(y) * cos(z)
                + sin(2 * x) * cos(z)
                + cos(x) * sin(2 * y)
                + cos(y) * sin(2 * z)
            ),
        ),
        (
            # nTop's help, halved.
            "lidinoid",
            lambda x, y, z: (
                0.5
                * (
                    sin(2 * x) * cos(y) * sin(z)
                    + sin(2 * y) * cos(z) * sin(x)
                    + sin(2 * z) * cos(x) * sin(y)
                    - cos(2 * x) * cos(2 * y)
                    - cos(2 * y) * cos(2 * z)
                    - cos(2 * z) * cos(2 * x)
                    + 0.3
                )
            ),
        ),
        (
            # nTop's help.
            "split-p",
            lambda x, y, z: (
                1.1
                * (
                    sin(2 * x) * sin(z) * cos(y)
                    + sin(2 * y) * sin(x) * cos(z)
                    + sin(2 * z) * sin(y) * cos(x)
                )
                - 0.2
                * (cos(2 * x) * cos(2 * y) + cos(2 * y) * cos(2 * z) + cos(2 * z) * cos(2 * x))
                - 0.4 * (cos(2 * x) + cos(2 * y) + cos(2 * z))
            ),
        ),
    ],
)
def test_formulas_of_cell_libraries(name, formula):
    points = np.random.default_rng(510).uniform(-1, 1, size=(3, 200))
    expected = [formula(*p) for p in 2 * pi * points.T]
    found = FAMILIES[f"{name}-network"].shape(points)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-12)


def test_the_constant_of_the_lidinoid_is_a_parameter_of_sheet_and_wall():
    # Halved terms with 0.3 are another surface than nTop's, whose 0.3 is halved too. On the surface
    # of one constant the function of the other is 0.15.
    sheet, wall = FAMILIES["lidinoid-sheet"], FAMILIES["lidinoid-wall"]
    assert dict(sheet.parameters) == dict(wall.parameters) == {"constant": 0.15}
    points = samples(4000)
    values = lidinoid.lidinoid(points)
    np.testing.assert_array_equal(sheet.shape(points), np.abs(values))
    shifted = sheet.shape(points, constant=0.3)
    np.testing.assert_allclose(shifted, np.abs(values + 0.15), rtol=0, atol=1e-12)
    # A wall lies about its own surface: there the other constant's is far.
    apart = wall.shape(points, constant=0.3)
    near = apart < 0.002
    assert near.sum() > 20
    assert shifted[near].max() < 0.1
    assert sheet.shape(points)[near].min() > 0.05
    assert not FAMILIES["lidinoid-network"].parameters


def test_the_printed_neovius_is_not_neovius():
    # They differ in symmetry: Neovius is even in each coordinate, the printed function is not.
    points = samples(500)
    mirrored = points * np.array([-1, 1, 1])[:, None]
    np.testing.assert_allclose(neovius.neovius(mirrored), neovius.neovius(points), atol=1e-12)
    printed = neovius_as_printed.neovius_as_printed
    assert np.abs(printed(mirrored) - printed(points)).max() > 1
    assert "C(Y)" in FAMILIES["neovius-network-as-printed"].source


def test_the_misprinted_neovius_is_not_cubic():
    # 3 cX + cY + cZ + 4 cXcYcZ, as some programs have it.
    def misprinted(u):
        x, y, z = np.cos(2 * np.pi * u)
        return 3 * x + y + z + 4 * x * y * z

    with pytest.raises(PluginError, match="symmetry 'cubic'"):
        check_cell_family(CellFamily(name="misprinted", shape=misprinted))


def test_sources_state_formula_and_side():
    for family in FAMILIES.values():
        assert re.match(r"(\|f\| <= t|-?f <= t|distance to f = 0 at most t), f = ", family.source)
        assert family.symmetry == "cubic"
        assert family.sides == (1 if "-network" in family.name else 2)
        assert family.distance == ("-wall" in family.name)


def test_the_two_sides_fill_the_cell():
    values = frd.frd(samples(50_000))
    level = 0.31
    f_side = np.mean(FAMILIES["frd-network-f"].shape(samples(50_000)) < -level)
    assert np.mean(values <= level) + f_side == pytest.approx(1.0, abs=1e-12)

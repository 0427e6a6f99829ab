"""A power law of Gibson and Ashby stated in a case: read, checked, and what sizing makes of it."""

import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.errors import CaseError

STATED = "law = {stiffness = {c = 0.9, n = 1.8}, strength = {c = 0.3, n = 1.5}}"
FORCE, LENGTH, AREA, E = 100.0, 20.0, 100.0, 1000.0
#: Poisson's ratio 0: the clamped end does not hold the sides, and the bar is in pure tension.
CASE = (
    held_bar(
        box_part(LENGTH, 10, 10, 5),
        material="""\
youngs_modulus = "1 GPa"
poissons_ratio = 0.0
density = "1 g/cm^3"
yield_strength = "40 MPa"
""",
        force="100 N, 0 N, 0 N",
    )
    + f"""\
[limits]
buckling = "off"
displacement = [{{region = "tip", component = "x", magnitude = "0.1 mm"}}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
grading = "uniform"
density = [0.2, 0.8]
{STATED}
[run]
stop_after = "sizing"
[output]
formats = []
"""
)
DISPLACEMENT = 'displacement = [{region = "tip", component = "x", magnitude = "0.1 mm"}]\n'


@pytest.fixture
def stated(tmp_path):
    """Write the case with words replaced."""

    def write(*swaps):
        text = CASE
        for old, new in swaps:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def size(path):
    return gradedesign.run(gradedesign.load_case(path), folder=path.parent / "run")


def test_a_pulled_bar_gets_the_density_of_the_hand_calculation(stated):
    """``F L / (c rho^n E A)`` is the limit of 0.1 mm at rho = (F L / (c E A u))^(1/n)."""
    swap = (", strength = {c = 0.3, n = 1.5}", "")
    result = size(stated(swap))
    by_hand = (FORCE * LENGTH / (0.9 * E * AREA * 0.1)) ** (1 / 1.8)
    # Sizing ends between 99 and 100 % of the limit.
    assert by_hand <= result.lattice_density <= by_hand * 1.01 ** (1 / 1.8)
    (row,) = result.limits
    assert row.value == pytest.approx(
        FORCE * LENGTH / (0.9 * result.lattice_density**1.8 * E * AREA), rel=1e-6
    )
    law = result.law
    assert (law["kind"], law["source"]) == ("stated", "stated in the case")
    assert law["name"] == "stated (E 0.9 rho^1.8)"
    assert law["coefficients"] == {"c1": 0.9, "n1": 1.8}
    assert law["window"] == law["cell_window"]
    assert law["density_bounds"] == [0.2, 0.8]


def test_a_limit_of_stress_takes_the_stated_strength(stated):
    """``F / A`` is the strength ``c rho^n`` times the allowed stress."""
    result = size(stated((DISPLACEMENT, 'stress = "10 MPa"\n')))
    by_hand = (FORCE / AREA / (0.3 * 10.0)) ** (1 / 1.5)
    assert by_hand <= result.lattice_density <= by_hand * 1.01 ** (1 / 1.5)


@pytest.mark.parametrize("limit", ['stress = "10 MPa"', "safety_factor = 2.5"])
def test_a_law_without_strength_does_not_go_with_a_limit_of_stress(cli, stated, limit):
    path = stated((DISPLACEMENT, f"{limit}\n"), (", strength = {c = 0.3, n = 1.5}", ""))
    ended = cli("check", path)
    assert ended.code == 2
    words = " ".join(ended.err.split())
    number = path.read_text().split("\n").index(STATED.split(", strength")[0] + "}") + 1
    assert f"case.toml:{number}: lattice.law: law 'stated (E 0.9 rho^1.8)' has no strength" in words
    assert f"limits.{limit.split()[0]} limits the stress in the lattice" in words
    assert "add strength = {c = ..., n = ...} to it" in words


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "{c = 0.9, n = 1.8}",
            "{c = 1.3, n = 1.2}",
            # 1.3 0.8^1.2 = 0.995; 0.8^-0.2 = 1.0456
            "stiffness of 1.3 rho^1.2 is 0.995 of the solid's at density 0.8, and no cell has more "
            "than its density; expected c of at most 1.046 with n = 1.2 for densities 0.2 to 0.8",
        ),
        (
            "{c = 0.3, n = 1.5}",
            "{c = 0.5, n = 0.5}",
            # 0.5 0.2^0.5 = 0.2236; 0.2^0.5 = 0.4472
            "strength of 0.5 rho^0.5 is 0.224 of the solid's at density 0.2, and no cell has more "
            "than its density; expected c of at most 0.4472 with n = 0.5",
        ),
    ],
)
def test_no_cell_is_above_its_density(cli, stated, old, new, words):
    ended = cli("check", stated((old, new)))
    assert ended.code == 2
    assert words in " ".join(ended.err.split())


def test_the_bound_counts_where_the_case_has_densities(cli, stated):
    """2 rho^2 lies above rho from 0.5 on; c = 1 with n = 1 is Voigt's bound itself."""
    steep = ("{c = 0.9, n = 1.8}", "{c = 2.0, n = 2.0}")
    assert "of at most 1.25 with" in " ".join(cli("check", stated(steep)).err.split())
    ended = cli("check", stated(steep, ("[0.2, 0.8]", "[0.2, 0.5]")))
    assert ended.code == 0
    assert "law: stated (E 2 rho^2, strength 0.3 rho^1.5), stated in the case" in ended.out
    assert cli("check", stated(("{c = 0.9, n = 1.8}", "{c = 1, n = 1}"))).code == 0


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("{strength = {c = 0.3, n = 1.5}}", "lattice.law.stiffness: missing"),
        ("{stiffness = {c = 1.0}}", "lattice.law.stiffness.n: missing; add n = 2.0"),
        ("{stiffness = {c = 0, n = 2}}", "lattice.law.stiffness.c: found 0; expected a value abo"),
        ("{stiffness = {c = 1, n = 20}}", "lattice.law.stiffness.n: found 20; expected a value ab"),
        ("{stifness = {c = 1, n = 2}}", 'lattice.law.stifness: unknown key; did you mean "stiffne'),
        ("2.0", "lattice.law: found 2.0; expected the name of a law in quotes, or a table such as"),
    ],
)
def test_mistakes_are_told_at_their_key(stated, law, words):
    with pytest.raises(CaseError) as caught:
        gradedesign.load_case(stated((STATED, f"law = {law}")))
    assert words in str(caught.value)


def test_the_law_counts_in_the_hash_of_a_case(stated):
    def found(law):
        return gradedesign.load_case(stated((STATED, law))).case_hash

    hashes = {
        found(f"law = {law}")
        for law in (
            "{stiffness = {c = 0.9, n = 1.8}, strength = {c = 0.3, n = 1.5}}",
            "{stiffness = {c = 0.9, n = 1.8}, strength = {c = 0.3, n = 1.6}}",
            "{stiffness = {c = 0.9, n = 1.9}, strength = {c = 0.3, n = 1.5}}",
            "{stiffness = {c = 0.9, n = 1.8}}",
            '"auto"',
        )
    }
    assert len(hashes) == 5
    table = "[lattice.law]\nstiffness = {c = 0.9, n = 1.8}\nstrength = {c = 0.30, n = 1.5}"
    assert found(table) in hashes


def test_a_cell_that_passes_into_another_needs_a_strength(cli, stated):
    zone = """\
[[zone]]
name = "end"
formula = "10 - x"
cell = "diamond-sheet"
law = {stiffness = {c = 0.9, n = 1.8}}
[run]
"""
    ended = cli("check", stated(('grading = "uniform"\n', ""), ("[run]\n", zone)))
    assert ended.code == 2
    words = " ".join(ended.err.split())
    assert "zone[0].law: law 'stated (E 0.9 rho^1.8)' has no strength, which cells that" in words


def test_one_cell_in_two_zones_has_one_stated_law(cli, stated):
    zone = """\
[[zone]]
name = "end"
formula = "10 - x"
density = [0.4, 0.6]
law = {stiffness = {c = 0.9, n = 1.8}, strength = {c = 0.3, n = 1.5}}
[run]
"""
    graded = ('grading = "uniform"\n', "")
    assert cli("check", stated(graded, ("[run]\n", zone))).code == 0
    other = zone.replace("c = 0.3, n = 1.5", "c = 0.3, n = 1.6")
    words = " ".join(cli("check", stated(graded, ("[run]\n", other))).err.split())
    assert (
        "have the same cell, but the laws 'stated (E 0.9 rho^1.8, strength 0.3 rho^1.5)'" in words
    )

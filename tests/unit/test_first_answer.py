"""`gradedesign check --estimate`: constant densities and one sizing, before any lattice exists."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.design.check import first_answer
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.material.void_law import VOID_LAW
from gradedesign.mechanics.sizing import stored_sizing
from gradedesign.mechanics.sizing.size import size
from gradedesign.mechanics.sizing.size_members import STAGES
from gradedesign.program.host.registry import build_registry

#: A bar in tension, so that solid displacement and stress follow from F, A, L and E.
CASE = """\
[case]
name = "bar"
[part]
box = ["24 mm", "12 mm", "12 mm"]
mesh_size = "6 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
youngs_modulus = "110 GPa"
poissons_ratio = 0.3
density = "5 g/cm^3"
yield_strength = "800 MPa"
[[load_case]]
name = "pull"
fix = [{{region = "root"}}]
load = [{{region = "tip", force = ["{force} N", "0 N", "0 N"]}}]
[limits]
stress = "100 MPa"
buckling = "off"
displacement = [{{region = "tip", magnitude = "0.02 mm"}}]
[lattice]
cell = "gyroid-sheet"
size = "12 mm"
phases = ["lattice"]
law = "gyroid-sheet-computed"
density = [0.2, 0.7]
size_effects = {size_effects}
"""


def answer(cli, folder, force, *, size_effects=False, code=0):
    (folder / "case.toml").write_text(
        CASE.format(force=force, size_effects="true" if size_effects else "false")
    )
    ended = cli("check", folder, "--estimate", "--no-picture", "--json")
    assert ended.code == code, ended.err
    return json.loads(ended.out)["first_answer"]


def test_constant_densities_invert_the_law(cli, tmp_path):
    found = answer(cli, tmp_path, 3000)
    law = build_registry().scaling_laws["gyroid-sheet-computed"]
    by_limit = {row["limit"].split()[0]: row for row in found["constant_density"]}
    bar = by_limit["displacement"]
    # F L / (A E) = 3000 * 24 / (144 * 110e3) mm over 0.02 mm; the clamped end makes it stiffer.
    assert bar["utilisation_when_solid"] == pytest.approx(
        3000 * 24 / (144 * 110e3) / 0.02, rel=0.05
    )
    rho = np.asarray(bar["density"])
    assert 1 / np.linalg.inv(law.stiffness(rho))[0, 0] == pytest.approx(
        bar["utilisation_when_solid"]
    )
    stress = by_limit["stress"]
    assert float(law.strength(np.asarray(stress["density"]))) == pytest.approx(
        stress["utilisation_when_solid"]
    )
    worst = max(bar["density"], stress["density"])
    assert found["constant_density_of_all"] == worst
    # All of the part is lattice: 24 * 12 * 12 mm^3 of 5 g/cm^3.
    assert found["constant_mass_g"] == pytest.approx(worst * 24 * 144 * 5e-3)
    # Grading meets the same limits at less; it cannot go below the least density.
    sized = found["sized"]
    assert 0.2 * 17.28 <= sized["mass_g"] <= found["constant_mass_g"] * 1.02
    assert sized["mean_density"] == pytest.approx(sized["mass_g"] / 17.28)


def test_the_body_that_is_asked_for_is_sized_once(cli, tmp_path, monkeypatch):
    """Its price takes what the check has sized: shares at each sharpness of its stages once."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    sharpness = []

    def counted(problem, **told):
        if problem.members is not None and problem.model.law.laws[0] is not VOID_LAW:
            sharpness.append(problem.members.sharpness)
        return size(problem, **told)

    monkeypatch.setattr(stored_sizing, "size", counted)
    text = CASE.format(force=300, size_effects="false").replace('phases = ["lattice"]\n', "")
    (tmp_path / "case.toml").write_text(text)
    ended = cli("check", tmp_path, "--estimate", "--no-picture", "--json")
    bodies = json.loads(ended.out)["first_answer"]["bodies"]
    assert [b["name"] for b in bodies if b["asked"]] == ["lattice and solid"]
    assert sharpness == [stage[1] for stage in STAGES]


def test_other_bodies_at_the_same_limits_have_their_price(cli, tmp_path):
    """A shear beam, where grading and solid members pay; bodies of more freedom weigh less."""
    text = CASE.format(force=300, size_effects="false")
    text = text.replace('["300 N", "0 N", "0 N"]', '["0 N", "0 N", "-300 N"]')
    (tmp_path / "case.toml").write_text(text.replace('"6 mm"', '"3 mm"'))
    ended = cli("check", tmp_path, "--estimate", "--no-picture", "--json")
    checked = json.loads(ended.out)
    found = checked["first_answer"]
    bodies = {body["name"]: body for body in found["bodies"]}
    names = ("part as modelled", "uniform lattice", "graded lattice", "lattice and solid",
             "solid and void")  # fmt: skip
    masses = [bodies[name]["mass_g"] for name in names]
    assert masses == sorted(masses, reverse=True)
    assert masses[0] == pytest.approx(24 * 144 * 5e-3)
    assert [name for name, body in bodies.items() if body["asked"]] == ["graded lattice"]
    assert bodies["graded lattice"]["mass_g"] == pytest.approx(found["sized"]["mass_g"])
    for name in names[1:]:
        assert 0.9 < bodies[name]["largest_utilisation"] <= 1.004
    assert 'phases = ["lattice", "solid"]' in found["why_lattice"]
    # Time beside mass: that of the body which the case asks for is the check's own; members make
    # iterations longer.
    times = {name: bodies[name]["run_seconds"] for name in names}
    assert times["graded lattice"] == checked["prediction"]["seconds"]
    assert times["lattice and solid"] > times["graded lattice"] > 0.0
    assert times["solid and void"] > 0.0
    assert times["part as modelled"] is None


def test_what_no_density_meets_has_a_reason(cli, tmp_path):
    rows = answer(cli, tmp_path, 14000, code=4)["constant_density"]
    assert [row["density"] for row in rows if row["limit"].startswith("stress")] == [None]
    assert all(row["reason"] for row in rows if row["density"] is None)


def test_a_limit_that_the_solid_part_breaks_ends_as_a_run_does(cli, tmp_path):
    # F L / (A E) = 15000 * 24 / (144 * 110e3) = 0.0227 mm of 0.02 mm allowed.
    found = answer(cli, tmp_path, 15000, code=4)
    assert not found["feasible"]
    assert found["sized"] is None
    assert found["infeasible_because"].startswith("the fully solid part already breaks a limit")
    ended = cli("check", tmp_path, "--estimate", "--no-picture")
    assert ended.code == 4
    assert f"INFEASIBLE: {found['infeasible_because']}" in " ".join(ended.out.split())
    ran = cli("run", tmp_path, "-o", tmp_path / "out", "--json")
    assert ran.code == 4
    assert json.loads(ran.out)["reason"] == found["infeasible_because"]


def test_the_sizing_is_of_the_setup_that_knows_its_walls(cli, tmp_path, monkeypatch):
    # Walls themselves are computed in test_size_effects.py; here they would take a minute.
    asked = []
    monkeypatch.setattr(
        "gradedesign.design.check.first_answer.with_size_effects", lambda s: asked.append(s) or s
    )
    assert answer(cli, tmp_path, 3000, size_effects=True)["sized"]["mass_g"] > 0
    assert len(asked) == 1


STIFF, STRONG = ("displacement", "compliance"), ("stress",)
LAW = power_law(
    "test-law", ("test",), youngs=(0.5, 1.5), strength=(0.4, 1.2), window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)  # fmt: skip


def row(kind, value, limit=2.0, **others):
    """A limit with its value on the solid part; the key's region is that of the row, as stress."""
    return LimitRow(
        key=LimitKey(kind=kind, region="solid part"), name=kind, load_case="pull", value=value,
        limit=limit, unit="N mm", judged_by="solid part", **others,
    )  # fmt: skip


@pytest.fixture
def constant(monkeypatch):
    """`_constant` for a limit of the core on a part of 10 elements of a hundredth of a gram."""
    monkeypatch.setattr(first_answer, "total_mass", lambda _, rho: 1e-8 * rho.sum())
    limits = [
        SimpleNamespace(key=LimitKey(kind=kind), follows_stiffness=kind in STIFF)
        for kind in (*STIFF, *STRONG)
    ]
    setup = SimpleNamespace(
        limits=limits,
        cells=SimpleNamespace(law=LAW, bounds=(0.2, 0.7)),
        homogenised=SimpleNamespace(law=SimpleNamespace(laws=(LAW,)), volumes=np.ones(10)),
    )
    return lambda *args, **others: first_answer._constant(setup, row(*args, **others))


@pytest.mark.parametrize("kind", [*STIFF, *STRONG])
def test_a_constant_density_inverts_the_curve_of_its_kind(constant, kind):
    # A fifth of the limit when solid: 0.5 rho^1.5 = 0.2, or 0.4 rho^1.2 = 0.2.
    expected = 0.4 ** (1 / 1.5) if kind in STIFF else 0.5 ** (1 / 1.2)
    found = constant(kind, 0.4)
    assert found.density == pytest.approx(expected)
    assert found.mass_g == pytest.approx(0.1 * expected)
    assert constant(kind, 1e-6).density == 0.2  # the least that the case allows


@pytest.mark.parametrize(
    ("kind", "value", "others", "reason"),
    [
        ("compliance", 2.1, {}, "broken when solid"),
        # 0.5 * 0.7^1.5 = 0.293 and 0.5 * 0.9^1.5 = 0.427 of the solid's stiffness.
        ("compliance", 0.7, {}, "needs density 0.788, at most 0.7 is allowed"),
        ("compliance", 1.0, {}, "needs 0.5 of the solid's stiffness, but law 'test-law' reaches"),
        ("stress", 1.0, {}, "needs 0.5 of the solid's strength, but law 'test-law' reaches"),
        ("displacement", 4.0, {"unfavourable": "low"}, "no rule gives the density"),
    ],
)
def test_what_has_no_constant_density_says_why(constant, kind, value, others, reason):
    found = constant(kind, value, **others)
    assert (found.density, found.mass_g) == (None, None)
    assert reason in found.reason


def test_a_solid_part_that_yields_is_told(cli, tmp_path):
    """130 kN over 144 mm^2 are 903 MPa of the 800 MPa that the material has."""
    (tmp_path / "case.toml").write_text(CASE.format(force=130_000, size_effects="false"))
    ended = cli("check", tmp_path, "--estimate", "--no-picture", "--json")
    assert ended.code == 4
    (told,) = [w for w in json.loads(ended.out)["warnings"] if "the fully solid part yields" in w]
    assert "more than the yield strength of 800 MPa" in told

"""Buckling in the property table, as a law, in sizing, and where a law does not know it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gradedesign.errors import DensityError, PluginError, SolverError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.cell_buckling import BucklingLimit, unknown_warning
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import predicted_row
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.material.buckling_law import GROWTH_BEYOND, BucklingLaw
from gradedesign.mechanics.material.buckling_table import BucklingTable
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.property_table import (
    PropertyTable,
    read_property_table,
    write_property_table,
)
from gradedesign.mechanics.material.scaling_law import LawOrigin, isotropic_stiffness
from gradedesign.mechanics.material.tabulated_law import tabulated_law
from gradedesign.mechanics.sizing.filter import uniform_filter
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.size import SizingProblem, size
from gradedesign.mechanics.sizing.state import solved_state
from gradedesign.program.host.registry import build_registry
from gradedesign_laboratory import buckling_tables as module
from gradedesign_laboratory.critical_stress import CriticalStress

DENSITY = np.array([0.05, 0.1, 0.2])


def buckling_table(c=0.1, n=2.0, tension=10.0):
    """Critical stresses ``c rho^n``, ten times that in tension."""
    critical = np.ones((3, 6, 2)) * (c * DENSITY**n)[:, None, None]
    critical[:, :3, 1] *= tension
    return BucklingTable(
        density=DENSITY,
        critical=critical,
        cells=np.full((3, 6, 2), 2),
        error=np.array([0.05, 0.04, 0.03]),
        resolution=np.full(3, 32),
        wall_voxels=np.full(3, 4.0),
        poissons_ratio=0.3,
        method="test",
        version="test",
        date="2026-11-21",
    )


def property_table(buckling=None):
    rho = np.array([0.1, 0.4])
    return PropertyTable(
        name="test-computed",
        family="test",
        parameters={},
        symmetry="cubic",
        poissons_ratio=0.3,
        density=rho,
        stiffness=np.moveaxis(isotropic_stiffness(rho**2, 0.3), -1, 0),
        stiffness_error=np.zeros(2),
        strength=0.4 * rho,
        strength_error=np.zeros(2),
        resolution=np.full(2, 64),
        percentile=99.5,
        method="test",
        version="test",
        date="2026-11-21",
        buckling=buckling,
    )


def test_a_table_comes_back_with_and_without_buckling() -> None:
    plain = write_property_table(property_table())
    assert "buckling" not in plain
    assert read_property_table(plain).buckling is None
    text = write_property_table(property_table(buckling_table()))
    found = read_property_table(text).buckling
    assert found is not None
    np.testing.assert_allclose(found.critical, buckling_table().critical, rtol=1e-3)
    np.testing.assert_array_equal(found.cells, 2)
    # The section is all that is added.
    data, bare = json.loads(text), json.loads(plain)
    del data["buckling"]
    assert data == bare
    assert write_property_table(read_property_table(text)) == text


def test_a_damaged_section_is_named() -> None:
    data = json.loads(write_property_table(property_table(buckling_table())))
    data["buckling"]["rows"][0]["critical"][3] = -1.0
    with pytest.raises(PluginError, match="damaged"):
        read_property_table(json.dumps(data))


def test_a_law_of_a_table_knows_its_buckling() -> None:
    law = tabulated_law(property_table(buckling_table()))
    assert law.buckling is not None
    assert law.buckling.window == (0.05, 0.2)
    without = tabulated_law(property_table())
    assert without.buckling is None
    assert "judged in waves of many cells only" in unknown_warning(without)


def shipped_tables():
    """Critical stresses of every shipped law that has them, by cell."""
    laws = build_registry().scaling_laws.values()
    return {law.families[0]: law.buckling.table for law in laws if law.buckling is not None}


def test_uses_add_up() -> None:
    # c rho^n = 0.001 at 0.1: compression, tension over ten, shear of either sign.
    law = BucklingLaw(table=buckling_table())
    stress = 1e-4 * np.array([-1.0, 2.0, 0.0, 3.0, 0.0, -4.0])
    profile = law.profile(stress[:, None])
    assert profile[1, 0] == pytest.approx(0.1 * (1 + 0.2 + 3 + 4))
    np.testing.assert_allclose(law.profile(3 * stress[:, None]), 3 * profile)
    # A power law between its densities and below; in proportion to density above.
    rho = np.array([0.03, 0.07, 0.15, 0.2, 0.5])
    use = law.at(np.repeat(profile, 5, axis=1), rho)
    expected = profile[1, 0] * (np.minimum(rho, 0.2) / 0.1) ** -2 * np.minimum(0.2 / rho, 1.0)
    np.testing.assert_allclose(use, expected, rtol=1e-9)
    c, n, residual = law.power_fit(0, 0)
    assert (c, n) == (pytest.approx(0.1), pytest.approx(2.0))
    assert residual < 1e-9


def test_critical_stresses_grow_faster_than_is_taken_beyond_the_densest_cell() -> None:
    """All shipped tables, where a mode was seen at both densities."""
    seen = 0
    for table in shipped_tables().values():
        both = (table.cells[1:] > 0) & (table.cells[:-1] > 0)
        grown = np.diff(np.log(table.critical), axis=0)
        grown /= np.diff(np.log(table.density))[:, None, None]
        assert (grown[both] > GROWTH_BEYOND).all()
        seen += int(both.sum())
    assert seen > 100


def test_a_table_that_falls_with_density_is_refused() -> None:
    table = buckling_table()
    with pytest.raises(ValueError, match="fall with density"):
        BucklingLaw(table=replace(table, critical=table.critical[::-1]))


def bar(traction, law):
    """A bar of E 1000 MPa, pulled (or pushed) along x over its tip."""
    mesh = box_part_mesh((8.0, 4.0, 4.0), 4.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 8 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([traction, 0.0, 0.0])),
        acceleration=np.zeros(3),
    )
    material = Material(
        name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6, yield_strength=10.0
    )
    return homogenised_model(space, np.zeros(space.element_count), material, law, [case])


@pytest.mark.parametrize(("traction", "factor"), [(-0.5, 1.0), (-0.5, 2.0), (0.5, 1.0)])
def test_sizing_keeps_the_cells_from_buckling(traction, factor) -> None:
    # nu 0: uniaxial stress. Buckling asks for factor 0.5 / 1000 = c rho^n, strength for
    # 0.5 = 12 * 0.4 rho; the higher density governs. In tension that is strength.
    law = power_law(
        "test-law",
        ("test",),
        youngs=(0.6, 1.4),
        strength=(0.4, 1.0),
        window=(0.05, 0.9),
        origin=LawOrigin(kind="fe", source="this test", test="none", poissons_ratio=0.0),
    )
    buckling = BucklingLaw(table=buckling_table(c=0.02))
    model = bar(traction, replace(law, buckling=buckling))
    count = model.space.element_count
    problem = SizingProblem(
        model=model,
        limits=(
            StressLimit(
                key=LimitKey(kind="stress", region="lattice"), name="stress in lattice",
                allowed=12.0, percentile=99.5, evaluated=np.ones(count, dtype=bool),
            ),
            BucklingLimit(
                key=LimitKey(kind="buckling"), name="buckling of cells",
                allowed=1.0 / factor, law=model.law,
            ),
        ),
        bounds=(0.06, 0.85),
        filter=uniform_filter(count),
    )  # fmt: skip
    result = size(problem, tolerance=2e-4)
    strong = 0.5 / (12.0 * 0.4)
    critical = 10.0 if traction > 0 else 1.0
    thin = np.sqrt(factor * 0.5e-3 / (0.02 * critical))
    expected = max(strong, thin)
    if thin > 0.2:
        # Beyond its window critical stresses grow with density: 0.02 * 0.2^2 / 0.2 rho.
        expected = thin = factor * 0.5e-3 / (0.02 * 0.2 * critical)
    assert result.history[-1].utilisations[1] < 1.005
    assert (result.history[-1].utilisations[1] > 0.99) == (thin > strong)
    np.testing.assert_allclose(result.rho, expected, rtol=0.005)
    if traction < 0 and factor == 1:
        without = size(replace(problem, limits=problem.limits[:1]), tolerance=2e-4)
        np.testing.assert_allclose(without.rho, strong, rtol=0.005)


@pytest.mark.parametrize(
    ("rho", "words"),
    [(0.15, ""), (0.2, ""),
     (0.5, "computed at densities 0.05 to 0.2, the cells there have 0.5; those of 0.2 are taken"),
     (0.04, "the cells there have 0.04; the power law of the two least densities goes on")],
)  # fmt: skip
def test_a_density_that_no_critical_stress_was_computed_for_is_said_in_the_row(rho, words) -> None:
    law = power_law(
        "test-law",
        ("test",),
        youngs=(0.6, 1.4),
        strength=(0.4, 1.0),
        window=(0.03, 0.9),
        origin=LawOrigin(kind="fe", source="this test", test="none", poissons_ratio=0.0),
    )
    model = bar(-0.1, replace(law, buckling=BucklingLaw(table=buckling_table(c=1e-4))))
    limit = BucklingLimit(
        key=LimitKey(kind="buckling"), name="buckling of cells", allowed=0.5, law=model.law
    )
    rho = np.full(model.space.element_count, rho)
    row = predicted_row(limit, limit.predict(solved_state(model, rho, (limit,))))
    assert "waves of one or two cells govern" in row.judged_by
    assert row.extrapolated == bool(words)
    assert words in row.judged_by
    assert row.word == ("BROKEN, extrapolated" if words else "BROKEN")
    # Where long waves govern, which the stiffness gives, nothing is extrapolated.
    plain = replace(limit, law=bar(-0.1, replace(law, buckling=None)).law)
    state = solved_state(bar(-0.1, plain.law.laws[0]), rho, (plain,))
    assert not predicted_row(plain, plain.predict(state)).extrapolated


@pytest.mark.parametrize("factor", [1.0, 1.5])
def test_long_waves_alone_bound_the_density_of_a_law_without_a_table(factor) -> None:
    # nu 0: G = E* / 2 = 0.3 rho^1.4 E bears 1.1 times the compression (SWAY of 0.4).
    law = power_law(
        "test-law",
        ("test",),
        youngs=(0.6, 1.4),
        strength=(0.4, 1.0),
        window=(0.05, 0.9),
        origin=LawOrigin(kind="fe", source="this test", test="none", poissons_ratio=0.0),
    )
    model = bar(-20.0, law)
    count = model.space.element_count
    limit = BucklingLimit(
        key=LimitKey(kind="buckling"),
        name="buckling of cells",
        allowed=1.0 / factor,
        law=model.law,
    )
    expected = (1.1 * factor * 20 / 1000 / 0.3) ** (1 / 1.4)
    rho = np.full(count, 0.3)
    state = solved_state(model, rho, (limit,))
    predicted = limit.predict(state)
    assert predicted.value / limit.allowed == pytest.approx((expected / 0.3) ** 1.4, rel=2e-3)
    assert predicted.governs == "waves of many cells"
    # Cells that faces cut bear a share.
    cut = replace(model, cut_share=np.full(count, 0.8))
    assert limit.predict(solved_state(cut, rho, (limit,))).value == pytest.approx(
        predicted.value / 0.8, rel=1e-6
    )
    half = 0.5 * np.ones((2, count))
    mix = LawField(
        laws=(law, law),
        weights=half,
        stiffness_factor=np.full(count, 0.5),
        strength_factor=np.ones(count),
    )
    profile = state.buckling_profile("load")
    np.testing.assert_allclose(mix.buckling(profile, rho), 2 * model.law.buckling(profile, rho))


def test_a_factor_beside_off_is_refused() -> None:
    with pytest.raises(ValueError, match="found beside buckling"):
        LimitsSpec.model_validate({"stress": "50 MPa", "buckling": "off", "buckling_factor": 2.0})


def test_densities_whose_critical_stresses_do_not_settle_are_left_out(monkeypatch, caplog):
    """By default; where densities are asked for by name, or two are not left, it is an error."""
    settled = {0.1, 0.3}

    def compute(cell, rho, *, poissons_ratio):
        if rho not in settled:
            raise SolverError("too much to extrapolate")
        one = np.full((6, 2), rho**2)
        return CriticalStress(
            density=rho, resolution=32, wall_voxels=4.0, critical=one,
            cells=np.full((6, 2), 2), error=0.1,
        )  # fmt: skip

    monkeypatch.setattr(module, "critical_stress", compute)
    cell = calibrate(build_registry().cell_families["octet"])
    found = module.compute_buckling(cell)
    assert found.density.tolist() == [0.1, 0.3]
    assert "density 0.2 is left out" in caplog.text
    settled.remove(0.3)
    with pytest.raises(DensityError, match="fewer than two"):
        module.compute_buckling(cell)


def test_the_docs_show_the_critical_stresses_that_are_shipped():
    """Every row of every table with a section, to the digits printed."""
    docs = Path(__file__).parents[2] / "docs" / "validation.md"
    after = docs.read_text(encoding="utf-8").split("| cell | density | compression |")[1]
    rows = re.findall(r"^\|(.*)\|$", after.split("\n\n")[0], flags=re.M)[1:]
    shown, name = [], ""
    for row in rows:
        first, *numbers = (cell.strip() for cell in row.split("|"))
        name = first or name
        shown.append((name, *numbers))
    tables = shipped_tables()
    assert sum(table.density.size for table in tables.values()) == len(shown) > 0
    for name, density, *numbers in shown:
        table = tables[name]
        (k,) = np.flatnonzero(np.isclose(table.density, float(density)))
        c, cells = table.critical[k], table.cells[k]
        found = [(">= " * bool(cells[i] == 0), c[i]) for i in ((0, 0), (0, 1), (5, 0))]
        for text, (sign, value) in zip(numbers, [*found, ("", table.error[k])], strict=True):
            assert text == f"{sign}{value:.{len(text.partition('.')[2])}f}", (name, density)


def test_what_a_cell_bears_at_least_is_no_less_with_more_material():
    def row(rho, size, cells):
        return CriticalStress(
            density=rho, resolution=32, wall_voxels=4.0, critical=np.full((6, 2), size),
            cells=np.full((6, 2), cells), error=0.1,
        )  # fmt: skip

    table = module.buckling_table([row(0.1, 0.004, 2), row(0.2, 0.002, 0), row(0.3, 0.01, 2)], 0.3)
    assert table.critical[:, 0, 0].tolist() == [0.004, 0.004, 0.01]
    BucklingLaw(table=table)
    # What was seen to buckle is not raised: such a table is refused.
    table = module.buckling_table([row(0.1, 0.004, 2), row(0.2, 0.002, 2)], 0.3)
    with pytest.raises(ValueError, match="fall with density"):
        BucklingLaw(table=table)

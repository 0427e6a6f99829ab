"""The law of a case's cell: registered for default parameters, computed for others."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign import CellFamily, power_law
from gradedesign.design.resolve import resolve_law as module
from gradedesign.design.resolve.resolve_law import resolve_law as resolve
from gradedesign.design.resolve.resolve_law import stress_basis
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.local_stress import percentile_warnings
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.material.strength_surface import StrengthSurface
from gradedesign.program.host.registry import build_registry


def shape(u, bend=0.5):
    return np.cos(2 * np.pi * u).sum(axis=0) + 0 * bend


FAMILY = CellFamily(name="cube", shape=shape, parameters={"bend": 0.5})


def law(kind="fe", name="written"):
    return power_law(
        name,
        ("cube",),
        youngs=(1.0, 2.0),
        strength=(1.0, 1.5),
        window=(0.1, 0.6),
        origin=LawOrigin(kind=kind, source="this test", test="none"),
    )


def build_registry_with(laws):
    return replace(
        build_registry(),
        scaling_laws={k.name: k for k in laws},
        failures=(),
    )


def case(name="auto", edges=(8.0, 8.0, 8.0), own_cell=None):
    return SimpleNamespace(
        lattice=SimpleNamespace(
            law=name, densities=(0.2, 0.5), edges=edges, own_cell=own_cell, by_stress=False
        ),
        limits=None,
    )


def resolve_law(case, registry, family, parameters, *rest, poissons_ratio=0.34):
    return resolve(
        case.lattice,
        case.limits,
        registry,
        calibrate(family, parameters),
        "case.toml:7: {}".format,
        *rest,
        poissons_ratio=poissons_ratio,
    )


@pytest.fixture
def computed(monkeypatch):
    """What would be computed, by name and parameters, instead of a minute of homogenisation."""
    asked = []

    def compute(cell, poissons_ratio, resolution, edges, density, on_row):
        assert resolution == 48
        assert density == (0.2, 0.5)
        for number, rho in enumerate((0.2, 0.35, 0.5, 0.6), start=1):
            on_row(SimpleNamespace(density=rho), number, 4)
        asked.append((cell.name, dict(cell.parameters), poissons_ratio))
        return law("computed", "cube-computed")

    monkeypatch.setattr(module, "computed_law", compute)
    return asked


def test_a_registered_law_serves_the_default_parameters(computed):
    found, warnings = resolve_law(case(), build_registry_with([law()]), FAMILY, {"bend": 0.5})
    assert (found.name, warnings, computed) == ("written", (), [])


def test_other_parameters_get_a_law_of_their_own(computed):
    # the registered law would be a plausible wrong number here
    found, warnings = resolve_law(case(), build_registry_with([law()]), FAMILY, {"bend": 0.7})
    assert found.name == "cube-computed"
    assert computed == [("cube", {"bend": 0.7}, 0.34)]
    assert "bend = 0.7" in warnings[0]


def test_a_cell_without_a_law_gets_one(computed):
    heard = []
    found, warnings = resolve_law(
        case(), build_registry_with([]), FAMILY, {"bend": 0.5}, heard.append
    )
    assert [event.stage for event in heard] == 5 * ["law"]
    assert "48^3 voxels, which takes 1 to 2 minutes" in heard[0].message
    assert "law of cube: density 0.35 is computed (2 of 4)" in heard[2].message
    assert [event.fraction for event in heard[1:]] == [0.25, 0.5, 0.75, 1.0]
    assert found.name == "cube-computed"
    assert "of this cell" in warnings[0]
    assert "homogenise cube" in warnings[0]
    own = case(own_cell="from the case")
    _, warnings = resolve_law(own, build_registry_with([]), FAMILY, {"bend": 0.5})
    assert "homogenise" not in warnings[0]


def test_experiments_are_not_taken_by_themselves(computed):
    resolve_law(case(), build_registry_with([law("experiment")]), FAMILY, {"bend": 0.5})
    assert computed == [("cube", {"bend": 0.5}, 0.34)]


def test_a_named_law_is_taken_and_its_limits_said(computed):
    found, warnings = resolve_law(
        case("written"), build_registry_with([law()]), FAMILY, {"bend": 0.7}
    )
    assert (found.name, computed) == ("written", [])
    assert "bend = 0.7" in warnings[0]


def test_a_law_for_another_material_is_taken_and_this_is_said(computed):
    found, warnings = resolve_law(
        case(), build_registry_with([law()]), FAMILY, {"bend": 0.5}, poissons_ratio=0.39
    )
    assert (found.name, computed) == ("written", [])
    assert "made for Poisson's ratio 0.3, the material has 0.39" in warnings[0]


@pytest.mark.parametrize("bend", [0.5, 0.7])
def test_gibson_ashby_is_fitted_to_the_computed_law(computed, bend):
    registered = power_law(
        "cube-registered",
        ("cube",),
        youngs=(0.7, 1.9),
        strength=(0.4, 1.4),
        window=(0.1, 0.6),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )
    found, warnings = resolve_law(
        case("gibson-ashby"), build_registry_with([registered]), FAMILY, {"bend": bend}
    )
    assert (found.name, found.kind) == ("gibson-ashby", "fitted")
    # the installed law serves the default parameters; for others `computed` stands for homogenising
    youngs, strength = ((0.7, 1.9), (0.4, 1.4)) if bend == 0.5 else ((1.0, 2.0), (1.0, 1.5))
    assert found.coefficients == (
        ("c1", pytest.approx(youngs[0], rel=1e-9)),
        ("n1", pytest.approx(youngs[1], rel=1e-9)),
        ("c3", pytest.approx(strength[0], rel=1e-9)),
        ("n3", pytest.approx(strength[1], rel=1e-9)),
    )
    assert len(computed) == len(warnings) == (bend == 0.7)


def test_gibson_ashby_is_not_taken_from_a_law_of_the_literature(computed):
    resolve_law(case("gibson-ashby"), build_registry_with([law("fe")]), FAMILY, {"bend": 0.5})
    assert computed == [("cube", {"bend": 0.5}, 0.34)]


def test_a_law_without_strength_is_refused_where_stress_is_limited(computed):
    soft = power_law(
        "soft",
        ("cube",),
        youngs=(1.0, 2.0),
        window=(0.1, 0.6),
        origin=LawOrigin(kind="fe", source="this test", test="none"),
    )
    limited = case("soft")
    limited.limits = LimitsSpec(safety_factor=2.0)
    with pytest.raises(CaseError, match=r"'soft' has no strength.*safety_factor.*with strength"):
        resolve_law(limited, build_registry_with([soft]), FAMILY, {"bend": 0.5})
    limited.limits = LimitsSpec()
    found, _ = resolve_law(limited, build_registry_with([soft]), FAMILY, {"bend": 0.5})
    assert stress_basis(found) == "none: the law has no strength"


def test_an_unknown_law_is_an_error_not_a_computation(computed):
    with pytest.raises(CaseError, match="no law named 'writen'"):
        resolve_law(case("writen"), build_registry_with([law()]), FAMILY, {"bend": 0.5})
    assert computed == []


def test_what_local_stress_rests_on_is_said():
    surfaces = tuple(
        StrengthSurface(
            exponent=4,
            weights=np.ones(1),
            forms=np.eye(6)[None] * f,
            symmetry="cubic",
            max_error=0.071,
            rms_error=0.0213,
            unsafe_error=0.05,
            percentile=99.5,
        )
        for f in (2.0, 1.0)
    )
    known = replace(
        law("computed"),
        local_stress=LocalStressLaw(density=np.array([0.1, 0.6]), surfaces=surfaces),
    )
    assert "strength at the density" in stress_basis(law())
    assert "at 2 densities" in stress_basis(known)
    assert "2.1% rms and 7% at most" in stress_basis(known)
    assert percentile_warnings(law(), 99.0) == ()
    assert percentile_warnings(known, 99.5) == ()
    (warning,) = percentile_warnings(known, 99.0)
    assert "99th percentile" in warning
    assert "'written' stand for the 99.5th" in warning
    # With the distribution of stress in a cell any percentile is predicted.
    spread = tuple(replace(s, distribution=np.array([[50, 99.5], [0.5, 1.0]])) for s in surfaces)
    mixed = replace(
        known, local_stress=LocalStressLaw(density=np.array([0.1, 0.6]), surfaces=spread)
    )
    assert percentile_warnings(mixed, 99.0) == ()

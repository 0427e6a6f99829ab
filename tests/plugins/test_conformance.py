"""Every installed family and law keeps the promises of its record; the kit itself can fail."""

import logging
import re
from dataclasses import replace

import numpy as np
import pytest

from gradedesign import (
    CellFamily,
    DensityError,
    LawOrigin,
    PluginError,
    ScalingLaw,
    cubic_law,
    power_law,
)
from gradedesign.program.host.registry import build_registry
from gradedesign.testing import _check_one_side, _check_struts, check_cell_family, check_scaling_law

REGISTRY = build_registry()


#: Checked in every run; the slow run checks all, and distributions check theirs themselves.
QUICK = {
    f"{surface}-{kind}"
    for surface in ("gyroid", "diamond", "primitive")
    for kind in ("network", "sheet", "wall")
}
EVERY = [
    pytest.param(family, id=name, marks=[] if name in QUICK else [pytest.mark.slow])
    for name, family in REGISTRY.cell_families.items()
]


@pytest.mark.parametrize("family", EVERY)
def test_family_conforms(family):
    check_cell_family(family)


@pytest.mark.parametrize("law", REGISTRY.scaling_laws.values(), ids=lambda k: k.name)
def test_law_conforms(law):
    check_scaling_law(law)
    assert law.source
    assert law.test
    assert set(law.families) <= set(REGISTRY.cell_families)


def cosines(u):
    return np.cos(2 * np.pi * u)


def nodal(u):
    return cosines(u).sum(axis=0)


def changing(u):
    value = nodal(u)
    u *= 0.5
    return value


def lopsided(u):
    x, y, z = cosines(u)
    return x + y + 0.8 * z


def by_length(u):
    return nodal(u) + u.shape[-1]


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"name": "Upper"}, PluginError, "lower case"),
        ({"shape": lambda u: nodal(u).ravel()[:1]}, PluginError, "shape"),
        ({"shape": lambda u: np.log(np.abs(nodal(u)) * 0)}, PluginError, "finite|divide"),
        ({"shape": lambda u: np.cos(u).sum(axis=0)}, PluginError, "period must be 1"),
        ({"shape": changing}, PluginError, "changed its input"),
        ({"shape": by_length}, PluginError, "depend on the shape"),
        ({"shape": lopsided}, PluginError, "declares symmetry 'cubic'"),
        ({"shape": nodal, "sides": 2}, PluginError, "sides=2"),
        ({"shape": nodal, "distance": True}, PluginError, "distance=True"),
        ({"shape": lambda u: np.maximum(nodal(u), 0.1)}, PluginError, "constant"),
        (
            {
                "shape": lambda u: np.abs(np.sin(2 * np.pi * u[0])),
                "symmetry": "orthotropic",
                "sides": 2,
            },
            DensityError,
            "three directions",
        ),
    ],
)
def test_the_kit_finds_broken_families(settings, error, message):
    family = CellFamily(**{"name": "broken", "shape": nodal, **settings})
    with np.errstate(divide="ignore"), pytest.raises(error, match=message):
        check_cell_family(family)


@pytest.mark.parametrize("name", ["gyroid-sheet", "primitive-wall", "honeycomb-plates"])
def test_a_sheet_that_forgets_its_second_side_is_refused(name):
    with pytest.raises(PluginError, match="declares sides=1, but its shape is 0 on a surface"):
        check_cell_family(replace(REGISTRY.cell_families[name], sides=1, signed=None))


@pytest.mark.parametrize("name", ["bcc", "gyroid-network", "bcc-straight-to-helix"])
def test_struts_and_networks_have_one_side(name):
    _check_one_side(REGISTRY.cell_families[name])
    struts = REGISTRY.cell_families["sc"]
    _check_one_side(replace(struts, shape=lambda u, **kw: struts.shape(u, **kw) ** 2))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"sides": 3}, "declares sides=3, expected 2 for a sheet"),
        ({"symmetry": "square"}, "declares symmetry 'square', expected one of cubic"),
        ({"shape": 1.0}, "has the shape 1.0, expected a function"),
        ({"parameters": {"k": "1"}}, "parameter k is '1', expected a finite number"),
        ({"parameters": {"k": float("nan")}}, "parameter k is nan"),
    ],
)
def test_a_cell_that_cannot_be_is_refused_where_it_is_made(settings, words):
    with pytest.raises(PluginError, match=words):
        CellFamily(**{"name": "mine", "shape": nodal, **settings})


def test_lower_symmetry_may_be_declared():
    check_cell_family(CellFamily(name="lopsided", shape=lopsided, symmetry="tetragonal"))


def test_the_kit_finds_a_wrong_derivative():
    good = REGISTRY.scaling_laws["ramirez-2022-gyroid-4x4x4"]
    bad = ScalingLaw(
        name="bad",
        families=good.families,
        stiffness=good.stiffness,
        stiffness_derivative=lambda rho: 1.01 * good.stiffness_derivative(rho),
        strength=good.strength,
        window=good.window,
        kind=good.kind,
        source=good.source,
        test=good.test,
    )
    with pytest.raises(PluginError, match="derivative"):
        check_scaling_law(bad)


def test_the_kit_says_what_it_is_doing(caplog):
    caplog.set_level(logging.INFO, logger="gradedesign.testing")
    steps = []
    check_cell_family(CellFamily(name="told", shape=lambda u: nodal(u)), on_step=steps.append)
    words = ["output and period", "symmetry", "densities", "levels", "walls"]
    assert len(steps) == len(words)
    for step, word in zip(steps, words, strict=True):
        assert step.startswith(f"told: {word}")
    # A slow shape is known to be slow after its first values.
    assert re.search(r"us a point, about \d+ s", steps[2])
    assert [r.message.split(",")[0] for r in caplog.records] == [f"told: {w}" for w in words]
    steps.clear()
    with pytest.raises(PluginError, match="sides=2"):
        check_cell_family(CellFamily(name="told", shape=nodal, sides=2), on_step=steps.append)
    assert [step.partition(":")[2] for step in steps] == [" output and period", " two sides"]


NOTES = LawOrigin(kind="fe", source="here", test="here")


def test_the_kit_finds_a_law_above_the_bound_of_voigt():
    # E = 3 rho^0.5 of the solid's at density 0.1 is 0.95, Voigt allows 0.1.
    law = power_law("bad", ("gyroid-sheet",), youngs=(3.0, 0.5), window=(0.1, 0.5), origin=NOTES)
    with pytest.raises(PluginError, match=r"law 'bad': at density 0\.1 .*Voigt, energy"):
        check_scaling_law(law)


def test_the_bound_of_voigt_is_looked_for_over_the_whole_window():
    # 0.4 rho^0.5 crosses rho at 0.16, inside the window; E alone decides, nu is the solid's.
    law = power_law("bad", ("gyroid-sheet",), youngs=(0.4, 0.5), window=(0.14, 0.8), origin=NOTES)
    with pytest.raises(PluginError, match=r"at density 0\.14 .*Voigt"):
        check_scaling_law(law)


def test_the_bound_of_voigt_is_that_of_the_whole_stiffness():
    # E along the axes and K keep below rho of the solid's, but the shear is 0.5 rho > rho / 2.6.
    stiff = {"youngs": (0.3, 1.0), "bulk": (0.2, 1.0), "shear": (0.5, 1.0)}
    strength = ((0.1, 0.5), (0.05, 0.3))
    law = cubic_law("bad", ("bcc",), strength=strength, window=(0.1, 0.5), **stiff, origin=NOTES)
    with pytest.raises(PluginError, match="Voigt, energy"):
        check_scaling_law(law)


def test_the_kit_holds_laws_to_the_bound_of_hashin_and_shtrikman():
    # Isotropic with the solid's ratio: E = 0.7 rho is below Voigt's rho; at density 0.1 Hashin and
    # Shtrikman allow 0.0525 (nu 0.3), properties.md 4.1.
    law = power_law("bad", ("gyroid-sheet",), youngs=(0.7, 1.0), window=(0.1, 0.5), origin=NOTES)
    with pytest.raises(PluginError, match="Hashin-Shtrikman, Reuss"):
        check_scaling_law(law)
    check_scaling_law(
        power_law("good", ("gyroid-sheet",), youngs=(0.35, 1.0), window=(0.1, 0.5), origin=NOTES)
    )


def test_struts_that_are_not_those_of_the_shape_are_refused():
    bcc, sc = (REGISTRY.cell_families[name] for name in ("bcc", "sc"))
    with pytest.raises(PluginError, match="struts whose distance differs from its shape"):
        check_cell_family(replace(bcc, struts=sc.struts))


def test_round_struts_give_their_axes_with_any_parameters():
    """A wave of other amplitude, with balls: as `check_cell_family` does for the defaults."""
    wave = REGISTRY.cell_families["bcc-wave"]
    settings = {"node_ratio": 1.4, "amplitude": 0.08, "waves": 2.0}
    changed = replace(wave, parameters=settings)
    points = np.random.default_rng(5).uniform(-2, 2, (3, 300))
    _check_struts(changed, points, wave.shape(points, **settings))
    assert REGISTRY.cell_families["bcc-square"].struts is None

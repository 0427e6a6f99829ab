"""Power and cubic laws; coefficients from Ramirez Salazar 2022 and properties.md 4.2."""

import numpy as np
import pytest

from gradedesign import DensityError, LawOrigin, cubic_law, cubic_table_law, power_law
from gradedesign.testing import check_scaling_law

NOTES = LawOrigin(kind="fe", source="test", test="test")


def gyroid(**more):
    return power_law(
        "gyroid",
        ("gyroid-wall",),
        youngs=(0.402, 1.176),
        strength=(0.426, 1.537),
        window=(0.125, 0.624),
        origin=NOTES,
        **more,
    )


def youngs(c):
    return 1 / np.linalg.inv(c)[0, 0]


def test_isotropic_stiffness_has_the_modulus_and_ratio():
    c = gyroid().stiffness(np.asarray(0.3))
    s = np.linalg.inv(c)
    assert 1 / s[0, 0] == pytest.approx(0.402 * 0.3**1.176, rel=1e-12)
    assert -s[0, 1] / s[0, 0] == pytest.approx(0.3, rel=1e-12)
    assert c[3, 3] == pytest.approx(0.402 * 0.3**1.176 / 2.6, rel=1e-12)


def test_shear_coefficients_are_relative_to_youngs_modulus():
    # Trap 3 of ramirez.md: homogenised C44/E0 at d/L 0.1 (rho 0.303) is 0.051; the unit-cell law
    # gives 0.195 * 0.303^1.237 = 0.0445, while dividing by G0 would give 0.0171.
    law = power_law(
        "g",
        ("g",),
        youngs=(0.413, 1.351),
        strength=(0.432, 1.679),
        shear=(0.195, 1.237),
        window=(0.124, 0.619),
        origin=NOTES,
    )
    c = law.stiffness(np.asarray(0.303))
    assert c[3, 3] == pytest.approx(0.195 * 0.303**1.237, rel=1e-12)
    assert c[3, 3] == pytest.approx(0.051, rel=0.15)
    assert youngs(c) == pytest.approx(0.413 * 0.303**1.351, rel=1e-12)


def test_strength_and_window():
    law = gyroid()
    assert law.strength(np.asarray(0.319)) == pytest.approx(0.426 * 0.319**1.537)
    for rho in (0.1, 0.7, np.nan):
        with pytest.raises(DensityError, match=r"0\.125 to 0\.624"):
            law.stiffness(np.array([0.3, rho]))
        with pytest.raises(DensityError):
            law.strength(np.asarray(rho))


def test_stiffness_only_laws_refuse_strength():
    law = power_law(
        "a", ("p",), youngs=(0.562, 1.519), shear=(0.16, 0.974), window=(0.02, 0.2), origin=NOTES
    )
    assert youngs(law.stiffness(np.asarray(0.1))) == pytest.approx(0.562 * 0.1**1.519)
    with pytest.raises(DensityError, match="no strength"):
        law.strength(np.asarray(0.1))


def test_wrong_coefficients_are_refused():
    with pytest.raises(ValueError, match=r"gyroid.*'c2': -1\.0.*expected positive"):
        gyroid(shear=(-1.0, 1.0))


def test_coefficients_have_the_names_of_the_literature():
    assert gyroid(shear=(0.118, 1.213)).coefficients == (
        ("c1", 0.402), ("n1", 1.176), ("c2", 0.118), ("n2", 1.213), ("c3", 0.426), ("n3", 1.537),
    )  # fmt: skip


def network(**change):
    settings = {
        "youngs": (0.902, 2.126),
        "bulk": (0.464, 1.542),
        "shear": (0.348, 1.746),
        "strength": ((0.15, 0.3, 0.5), (1 / 54, 1 / 19, 1 / 8.3)),
        "window": (0.15, 0.5),
    } | change
    return cubic_law("net", ("gyroid-network",), **settings, origin=NOTES)


def test_cubic_law_gives_back_the_three_moduli():
    rho = 0.3
    c = network().stiffness(np.asarray(rho))
    assert youngs(c) == pytest.approx(0.902 * rho**2.126, rel=1e-12)
    assert (c[0, 0] + 2 * c[0, 1]) / 3 == pytest.approx(0.464 * rho**1.542, rel=1e-12)
    assert c[4, 4] == pytest.approx(0.348 * rho**1.746, rel=1e-12)
    # Zener ratio from the converged table, properties.md 4.2: 1.71 at 0.3, 1.90 at 0.2.
    assert 2 * c[3, 3] / (c[0, 0] - c[0, 1]) == pytest.approx(1.71, rel=0.05)


def test_strength_passes_through_the_table():
    law = network()
    np.testing.assert_allclose(law.strength(np.array([0.15, 0.3, 0.5])), [1 / 54, 1 / 19, 1 / 8.3])
    assert (np.diff(law.strength(np.linspace(0.15, 0.5, 50))) > 0).all()


def test_derivatives_match_differences():
    table = cubic_table_law(
        "t",
        ("x",),
        density=(0.1, 0.2, 0.4),
        C11=(0.04, 0.1, 0.25),
        C12=(0.02, 0.045, 0.1),
        C44=(0.012, 0.03, 0.08),
        strength=(0.03, 0.065, 0.14),
        origin=NOTES,
    )
    for law in (gyroid(), gyroid(shear=(0.118, 1.213)), network(), table):
        check_scaling_law(law)


def test_impossible_cubic_laws_are_refused():
    with pytest.raises(ValueError, match="cover"):
        network(window=(0.1, 0.5))
    with pytest.raises(ValueError, match="positive definite"):
        network(bulk=(0.01, 1.5))
    with pytest.raises(ValueError, match="increase"):
        network(strength=((0.15, 0.3, 0.5), (0.02, 0.05, 0.04)))

"""Power laws fitted to computed laws: what `gradedesign cells NAME` says of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from gradedesign.design.resolve.choose_law import choose_law
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.power_fit import fit_power, gibson_ashby, softest_modulus
from gradedesign.mechanics.material.scaling_law import has_strength
from gradedesign.program.host.registry import build_registry


def test_cells_states_power_laws_that_hold_in_their_windows(cli):
    ended = cli("cells", "octet", "--json")
    assert ended.code == 0
    (data,) = [law for law in json.loads(ended.out)["laws"] if law["name"] == "octet-computed"]
    law = build_registry().scaling_laws["octet-computed"]
    curves = {
        "E": lambda rho: 1 / np.linalg.inv(law.stiffness(rho))[0, 0],
        "strength": lambda rho: float(law.strength(rho)),
    }
    for what, curve in curves.items():
        fit = data["power_fits"][what]
        low, high = fit["window"]
        off = [
            fit["c"] * rho ** fit["n"] / curve(np.asarray(rho)) - 1
            for rho in np.geomspace(low, high, 9)
        ]
        assert max(map(abs, off)) == pytest.approx(fit["residual"], rel=0.2)
        assert fit["residual"] <= 0.1
    # The octet is dominated by stretching: E goes with density, not with its square (Deshpande,
    # Fleck, Ashby, J. Mech. Phys. Solids 49 (2001) 1747); slender struts give rho / 9 along x.
    assert 1.0 < data["power_fits"]["E"]["n"] < 1.4
    low, high = data["gibson_ashby_window"]
    windows = [data["power_fits"][what]["window"] for what in curves]
    assert low == max(w[0] for w in windows) < high == min(w[1] for w in windows)
    taken = choose_law(build_registry(), "octet", "gibson-ashby", (0.01, 0.99))
    assert taken.window == (low, high)
    # E 9 % and strength 10 % within the table: what `residual` says, over the whole window
    rho = np.geomspace(low, high, 21)
    for what, fitted in (("E", softest_modulus(taken, rho)), ("strength", taken.strength(rho))):
        exact = np.array([curves[what](np.asarray(r)) for r in rho])
        assert np.abs(fitted / exact - 1).max() <= data["power_fits"][what]["residual"] + 1e-9
    text = cli("cells", "octet").out
    assert f'law = "gibson-ashby" takes these, density {low:.3g} to {high:.3g}' in text
    assert f"E along the softest axis = {data['power_fits']['E']['c']:.3f} rho^" in text


def test_the_fit_is_made_for_the_densities_of_the_case():
    """Gyroid sheets from 0.35 to 0.65: a power law of all densities ends at 0.508."""
    law = build_registry().scaling_laws["gyroid-sheet-computed"]
    everywhere, here = gibson_ashby(law), gibson_ashby(law, (0.35, 0.65))
    assert everywhere.window[1] < 0.65
    assert here.window == (0.35, 0.65)
    rho = np.linspace(0.35, everywhere.window[1], 9)
    exact = softest_modulus(law, rho)
    far, near = (np.abs(softest_modulus(k, rho) / exact - 1).max() for k in (everywhere, here))
    # The residuals that the fits state, 9.4 and 2.4 %, are those of their whole windows.
    assert near < 0.025 < far
    # One density has no slope: the fit takes what lies around it, within the law's own window.
    one = gibson_ashby(law, (0.8, 0.8))
    assert one.window == (pytest.approx(0.8 / 1.5), 0.8)
    assert float(one.strength(np.asarray(0.8))) == pytest.approx(float(law.strength(0.8)), rel=0.05)


def test_a_law_that_no_power_law_follows_has_no_gibson_ashby():
    law = build_registry().scaling_laws["octet-computed"]
    wavy = replace(law, stiffness=lambda rho: law.stiffness(rho) * (1.5 + np.sin(300 * rho)))
    with pytest.raises(DensityError, match=r"no power law follows.*octet-computed"):
        gibson_ashby(wavy)
    rough = replace(law, strength=lambda rho: law.strength(rho) * (1.5 + np.sin(300 * rho)))
    assert not has_strength(gibson_ashby(rough))


def test_laws_of_the_literature_keep_their_own_coefficients(cli):
    laws = json.loads(cli("cells", "gyroid-wall", "--json").out)["laws"]
    stated = [law for law in laws if law["kind"] != "computed"]
    assert stated
    assert all(law["power_fits"] == {} for law in stated)


def test_the_window_is_the_widest_that_one_power_law_follows():
    rho = np.geomspace(0.05, 0.8, 41)
    bent = np.where(rho < 0.3, rho**2, 0.09 * (rho / 0.3) ** 5)
    fit = fit_power(rho, bent)
    assert fit.window[0] == 0.05
    assert 0.3 < fit.window[1] < 0.4
    assert fit.n == pytest.approx(2.0, abs=0.15)
    rough = rho**2 * np.where(np.arange(41) % 2, 1.5, 1.0)
    assert fit_power(rho, rough) is None


def test_the_softest_axis_counts():
    law = build_registry().scaling_laws["bccz-computed"]
    modulus = 1 / np.diag(np.linalg.inv(law.stiffness(np.asarray(0.2))))[:3]
    assert modulus.max() > 1.2 * modulus.min()  # its struts along z make the others softer
    assert softest_modulus(law, np.array([0.2]))[0] == pytest.approx(modulus.min())


def test_of_windows_of_one_width_the_sparsest_is_taken_however_logarithms_round():
    """A law bent evenly: every run of so many values fits alike, and rounding must not choose."""
    rho = np.geomspace(0.05, 0.8, 30)
    fit = fit_power(rho, np.exp(0.15 * np.log(rho) ** 2))
    for part in (1e-15, -1e-15, 3e-16):
        nudged = rho * (1 + part * np.random.default_rng(3).standard_normal(rho.size))
        again = fit_power(nudged, np.exp(0.15 * np.log(rho) ** 2))
        np.testing.assert_allclose(again.window, fit.window, rtol=1e-9)
        assert again.c == pytest.approx(fit.c, rel=1e-9)
    assert fit.window[0] == rho[0]

"""Computed laws against published and independent values, and against the bounds."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from gradedesign.design.resolve.choose_law import choose_law
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.mechanics.homogenise.bounds import require_bounds
from gradedesign.mechanics.homogenise.cell_properties import cell_properties
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    youngs_along,
    zener_ratio,
)
from gradedesign.mechanics.homogenise.macro_directions import (
    named_directions,
    spread_directions,
    von_mises_of,
)
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.sampling import cell_fill
from gradedesign.program.host.registry import build_registry


@pytest.fixture(scope="module")
def registry():
    return build_registry()


def computed(registry):
    return {n: k for n, k in registry.scaling_laws.items() if n.endswith("-computed")}


def moduli(c):
    return engineering_constants(c).youngs[0], zener_ratio(c)


# properties.md 4.2: another voxel code (voxlat), said to be within 0.6 %. Its rows scatter
# by 5 % about its own fits: gyroid rows that lie on the fit are compared within 2 %. Its diamond is
# 2 to 3 % below what both of our discretisations converge to (test below), so 4 % there.
@pytest.mark.parametrize(
    ("family", "rho", "youngs", "zener", "tolerance"),
    [
        ("gyroid-network", 0.20, 0.02997, 1.90, 0.02),
        ("gyroid-network", 0.25, 0.04727, 1.80, 0.02),
        ("gyroid-network", 0.50, 0.20744, 1.28, 0.02),
        ("diamond-network", 0.20, 0.03073, 2.29, 0.02),
        ("diamond-network", 0.30, 0.06415, 2.11, 0.04),
        ("diamond-network", 0.50, 0.17890, 1.72, 0.04),
    ],
)
def test_networks_equal_the_published_table(
    registry, family, rho, youngs, zener, tolerance
) -> None:
    found = moduli(computed(registry)[f"{family}-computed"].stiffness(np.array(rho)))
    assert found[0] == pytest.approx(youngs, rel=tolerance)
    assert found[1] == pytest.approx(zener, rel=0.03)


def test_gyroid_network_equals_the_fits(registry) -> None:
    # The fits of the same source over 0.2 to 0.5. The bulk modulus is no power of density: its fit
    # is 5 % high at 0.3 and not compared.
    law = computed(registry)["gyroid-network-computed"]
    for rho in (0.2, 0.3, 0.4, 0.5):
        c = law.stiffness(np.array(rho))
        assert moduli(c)[0] == pytest.approx(0.902 * rho**2.126, rel=0.02)
        assert c[3, 3] == pytest.approx(0.348 * rho**1.746, rel=0.03)


@pytest.mark.parametrize(("family", "rho"), [("diamond-network", 0.5), ("gyroid-sheet", 0.3)])
def test_both_discretisations_close_in_on_the_table(registry, family, rho) -> None:
    # Solid-or-void voxels come from below with the voxel, filled ones from above with its square.
    # By hand, diamond network at 0.5: E 0.18152 at 128 against 0.18289 at 96, tables 0.1826.
    cell = registry.cell_families[family]
    below, above = (
        moduli(
            solve_periodic(cell_fill(calibrate(cell), rho, 48, subsamples=s), rtol=1e-4).stiffness
        )[0]
        for s in (1, 3)
    )
    table = moduli(computed(registry)[f"{family}-computed"].stiffness(np.array(rho)))[0]
    assert below < table < above
    assert above - below < 0.05 * table


# properties.md 4.3: binary voxels by their centre, 48^3, nu 0.3; E100 and E111.
@pytest.mark.parametrize(
    ("family", "rho", "along", "diagonal", "zener"),
    [
        ("gyroid-sheet", 0.2, 0.0692, 0.0743, 1.08),
        ("diamond-sheet", 0.5, 0.2681, 0.2666, 0.99),
        ("primitive-sheet", 0.5, 0.2382, 0.3185, 1.41),
        ("primitive-network", 0.3, 0.1211, 0.0527, None),
    ],
)
def test_families_equal_the_cross_check(registry, family, rho, along, diagonal, zener) -> None:
    fill = cell_fill(calibrate(registry.cell_families[family]), rho, 48, subsamples=1)
    c = solve_periodic(fill, rtol=1e-4).stiffness
    assert engineering_constants(c).youngs[0] == pytest.approx(along, rel=0.02)
    assert youngs_along(c, np.ones(3)) == pytest.approx(diagonal, rel=0.02)
    if zener is not None:
        assert zener_ratio(c) == pytest.approx(zener, rel=0.02)


def test_extrapolation_agrees_with_128_binary_voxels(registry) -> None:
    # Solver study, section 3, N = 128: voxels solid or void approach from below, 1 % at 64 and
    # about half of that at 128.
    laws = computed(registry)
    for name, expected in (
        ("gyroid-sheet", (0.1608, 0.0716, 0.0507)),
        ("gyroid-network", (0.1034, 0.0513, 0.0428)),
    ):
        c = laws[f"{name}-computed"].stiffness(np.array(0.3))
        np.testing.assert_allclose((c[0, 0], c[0, 1], c[3, 3]), expected, rtol=0.012)


def test_filled_voxels_converge_with_the_square_of_their_size(registry) -> None:
    # Against what 24 and 48 voxels extrapolate to, which is within 0.03 % of what they do with a
    # density that is off by the samples at the level; exact is 4.
    family = registry.cell_families["gyroid-network"]
    c = [
        solve_periodic(cell_fill(calibrate(family), 0.4, n), rtol=1e-5).stiffness
        for n in (12, 24, 48)
    ]
    limit = c[2] + (c[2] - c[1]) / 3
    ratio = np.linalg.norm(c[0] - limit) / np.linalg.norm(c[1] - limit)
    assert 3.0 < ratio < 5.0
    assert np.linalg.norm(c[1] + (c[1] - c[0]) / 3 - limit) < 0.005 * np.linalg.norm(limit)


def test_shipped_table_is_what_the_code_computes(registry) -> None:
    row = cell_properties(calibrate(registry.cell_families["gyroid-network"]), 0.3, resolution=32)
    law = computed(registry)["gyroid-network-computed"]
    c = law.stiffness(np.array(0.3))
    assert np.linalg.norm(row.stiffness - c) < 0.005 * np.linalg.norm(c)
    assert row.stiffness_error < 0.02
    # The strength of a network changes by 3 % from 48 to 96 voxels (strength study), 32 is coarser.
    assert row.strength.strength == pytest.approx(float(law.strength(np.array(0.3))), rel=0.06)


def test_strength_of_the_gyroid_network(registry) -> None:
    # properties.md 4.2: local over mean stress, uniaxial along the axis, 99th percentile: 36, 19,
    # 8.3 at 0.2, 0.3, 0.5. Ours is the 99.5th in the worst direction: higher, by less than 15 %.
    law = computed(registry)["gyroid-network-computed"]
    for rho, factor in ((0.2, 36.0), (0.3, 19.0), (0.5, 8.3)):
        assert 1.0 < 1 / float(law.strength(np.array(rho))) / factor < 1.15


def test_every_computed_law_keeps_the_bounds(registry) -> None:
    laws = computed(registry)
    assert laws
    for law in laws.values():
        rho = np.linspace(*law.window, 60)
        stiffness = np.moveaxis(law.stiffness(rho), -1, 0)
        for r, c in zip(rho, stiffness, strict=True):
            require_bounds(c, float(r), 0.3, subject=law.name)
        assert (np.linalg.eigvalsh(np.diff(stiffness, axis=0)) > 0).all()
        strength = law.strength(rho)
        assert (np.diff(strength) > 0).all()
        # A cell cannot carry more than its share of solid at yield.
        assert (strength < rho).all()


def test_auto_takes_the_computed_law(registry) -> None:
    for name, law in computed(registry).items():
        chosen = choose_law(registry, law.families[0], "auto", law.window)
        assert chosen.name == name
        assert chosen.kind == "computed"


def test_every_strength_surface_agrees_with_its_factors(registry) -> None:
    """Local stress by the surface, against the percentiles computed beside it, and its bounds."""
    rng = np.random.default_rng(91)
    some = spread_directions(120, rng)
    for law in computed(registry).values():
        assert law.local_stress is not None
        local = law.local_stress.profile(some)
        # More material never means more stress: what sizing's density bound relies on.
        assert (np.diff(local, axis=0) < 0).all(), law.name
        # The mean stress of the solid is the macroscopic one over the density (exact), and its von
        # Mises stress is at most the mean, which lies below the 99.5th percentile.
        unsafe = np.array([s.unsafe_error for s in law.local_stress.surfaces])
        least = (1 - unsafe[:, None]) * von_mises_of(some) / law.local_stress.density[:, None]
        assert (local > least).all(), law.name
        # Tables without a distribution were sampled by an older method: up to 28 % high.
        if not law.local_stress.has_distribution:
            continue
        # The strength is that of the worst of these directions; 10 % is the bar of the surfaces.
        named = np.concatenate(list(named_directions().values()), axis=1)
        worst = law.local_stress.profile(named).max(axis=1)
        found = worst * law.strength(law.local_stress.density)
        assert (np.abs(found - 1) < 0.10).all(), law.name


def test_the_page_of_properties_is_what_the_tables_say() -> None:
    path = Path(__file__).parents[2] / "docs" / "make_cell_properties.py"
    spec = spec_from_file_location("make_cell_properties", path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    page = path.with_name("cell-properties.md").read_text(encoding="utf-8")
    assert module.text() == page, "run: python docs/make_cell_properties.py"
    (octet,) = (table for table in module.shipped_tables() if table.family == "octet")
    c11, c12 = octet.stiffness[list(octet.density).index(0.3), 0, :2]
    along = c11 - 2 * c12**2 / (c11 + c12)
    assert f"|  |  | 0.3 | {along:.4f} |" in page.split("| octet |")[1].split("| pinched")[0]

"""Every row of published and independently computed tables of effective stiffness."""

from __future__ import annotations

import numpy as np
import pytest

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.mechanics.homogenise.bounds import hashin_shtrikman_upper, require_bounds
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    youngs_along,
    zener_ratio,
)
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.sampling import cell_fill
from gradedesign.mechanics.homogenise.strength import local_stress, stress_factors
from gradedesign.program.host.registry import build_registry


@pytest.fixture(scope="module")
def registry():
    return build_registry()


def stiffness(registry, family, rho):
    return registry.scaling_laws[f"{family}-computed"].stiffness(np.array(rho))


def youngs_by(law, rho):
    return engineering_constants(law.stiffness(np.array(rho))).youngs[0]


# properties.md 4.2 (voxlat, voxel FE, Richardson 32/64): E100 and Zener ratio.
DENSITIES = (0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50)
NETWORKS = {
    "gyroid-network": (
        (0.01544, 0.02997, 0.04727, 0.06661, 0.09982, 0.12645, 0.16707, 0.20744),
        (2.23, 1.90, 1.80, 1.71, 1.48, 1.45, 1.34, 1.28),
    ),
    "diamond-network": (
        (0.01646, 0.03073, 0.04533, 0.06415, 0.08637, 0.11454, 0.14395, 0.17890),
        (2.44, 2.29, 2.23, 2.11, 2.04, 1.92, 1.81, 1.72),
    ),
}


@pytest.mark.parametrize("family", NETWORKS)
def test_networks_row_by_row(registry, family) -> None:
    # Rows of the source lie up to 5 % off a smooth curve (gyroid 0.30 and 0.35 in opposite senses),
    # ours do not: so 5 % for a row, and 2.5 % for the mean of all (gyroid by hand 0.7 %, diamond,
    # where both our grids converge above the source, 2.4 %). Zener alike: 6 % and 2.5 %.
    youngs, zener = NETWORKS[family]
    c = [stiffness(registry, family, rho) for rho in DENSITIES]
    apart = np.array([engineering_constants(v).youngs[0] for v in c]) / youngs - 1
    assert np.abs(apart).max() < 0.05
    assert abs(apart.mean()) < 0.025
    apart = np.array([zener_ratio(v) for v in c]) / zener - 1
    assert np.abs(apart).max() < 0.06
    assert abs(apart.mean()) < 0.025


# Raymont reference B8, recomputed there on 28 voxels (40 at 0.15 and 0.60): E100, nu, G, Zener.
RAYMONT = {
    0.15: (0.01671, 0.396, 0.01213, 2.03),
    0.20: (0.0304, 0.370, 0.0212, 1.91),
    0.30: (0.0758, 0.316, 0.0429, 1.49),
    0.40: (0.1350, 0.290, 0.0700, 1.34),
    0.50: (0.2128, 0.273, 0.1028, 1.23),
    0.60: (0.3117, 0.268, 0.1425, 1.16),
    0.70: (0.4367, 0.266, 0.1876, 1.09),
    0.80: (0.5859, 0.273, 0.2420, 1.05),
}


@pytest.mark.parametrize("rho", RAYMONT)
def test_gyroid_network_of_raymont(registry, rho) -> None:
    # Converged values against a grid of 28: E is 1 to 5 % lower, 8 % at 0.30, where the source's E
    # is also 9 to 14 % above the table of another code and its Zener ratio out of line. No grid of
    # 28 that we tried (voxel centres at the nodes, between them, filled) gives that row.
    youngs, nu, shear, zener = RAYMONT[rho]
    c = stiffness(registry, "gyroid-network", rho)
    found = engineering_constants(c)
    assert found.shear[0] == pytest.approx(shear, rel=0.025)
    assert found.youngs[0] == pytest.approx(youngs, rel=0.085 if rho == 0.30 else 0.05)
    assert found.youngs[0] < youngs
    assert found.poisson[2] == pytest.approx(nu, abs=0.016)
    assert zener_ratio(c) == pytest.approx(zener, rel=0.11 if rho == 0.30 else 0.075)
    if rho >= 0.6:
        assert found.youngs[0] == pytest.approx(youngs, rel=0.02)
    # Hashin and Shtrikman's E as printed there.
    bound = {0.15: 0.0811, 0.2: 0.111, 0.3: 0.176, 0.4: 0.250, 0.5: 0.333, 0.6: 0.428, 0.7: 0.538}
    if rho in bound:
        k, g = hashin_shtrikman_upper(rho, 0.3)
        assert 9 * k * g / (3 * k + g) == pytest.approx(bound[rho], rel=0.005)


def test_gyroid_network_of_raymont_at_ninety_per_cent() -> None:
    fill = shapes(28)["gyroid network"]
    c = solve_periodic(lowest(fill, 0.9), rtol=1e-4).stiffness
    found = engineering_constants(c)
    assert found.youngs[0] == pytest.approx(0.7719, rel=0.02)
    assert found.shear[0] == pytest.approx(0.3079, rel=0.02)
    assert found.poisson[2] == pytest.approx(0.285, abs=0.003)
    assert zener_ratio(c) == pytest.approx(1.03, abs=0.012)


@pytest.mark.parametrize(
    ("family", "law", "densities", "apart"),
    [
        # Shell models of the literature lie 10 % above ours for the primitive sheet of equal level,
        # whose necks are thinner than those of a shell of equal thickness, and below ours for the
        # gyroid: 23 % at 0.2, 60 % at 0.08. Our gyroid equals three independent voxel codes.
        ("primitive-sheet", "abueidda-2016-primitive", (0.073, 0.20), 0.12),
        ("primitive-sheet", "lee-2017-primitive", (0.10, 0.24), 0.12),
        ("gyroid-sheet", "abueidda-2016-gyroid", (0.20, 0.20), 0.25),
        ("gyroid-sheet", "al-ketan-2018a-gyroid", (0.25, 0.25), 0.25),
        ("gyroid-sheet", "ramirez-2022-gyroid-4x4x4", (0.125, 0.374), 0.28),
    ],
)
def test_literature_laws_of_sheets(registry, family, law, densities, apart) -> None:
    theirs, ours = registry.scaling_laws[law], registry.scaling_laws[f"{family}-computed"]
    for rho in densities:
        assert youngs_by(ours, rho) == pytest.approx(youngs_by(theirs, rho), rel=apart)


def shapes(n):
    """Values of surfaces at voxel centres; networks fill f < c unless told."""
    c = (np.arange(n) + 0.5) / n * 2 * np.pi
    x, y, z = np.meshgrid(c, c, c, indexing="ij")
    cx, cy, cz, sx, sy, sz = np.cos(x), np.cos(y), np.cos(z), np.sin(x), np.sin(y), np.sin(z)
    wide = np.cos(2 * x), np.cos(2 * y), np.cos(2 * z)
    gyroid = sx * cy + sy * cz + sz * cx
    primitive = cx + cy + cz
    iwp = 2 * (cx * cy + cy * cz + cz * cx) - sum(wide)
    neovius = 3 * primitive + 4 * cx * cy * cz
    frd = 4 * cx * cy * cz - (wide[0] * wide[1] + wide[1] * wide[2] + wide[2] * wide[0])
    fks = wide[0] * sy * cz + cx * wide[1] * sz + sx * cy * wide[2]
    diamond = sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz
    sheets = {
        "gyroid sheet": gyroid, "diamond sheet": diamond, "primitive sheet": primitive,
        "IWP sheet": iwp, "Neovius sheet": neovius, "F-RD sheet": frd, "FK-S sheet": fks,
    }  # fmt: skip
    networks = {
        "gyroid network": gyroid, "primitive net": primitive, "IWP net": iwp,
        "IWP net, other side": -iwp, "Neovius net": neovius, "F-RD net": frd, "FK-S net": fks,
    }  # fmt: skip
    return {**{k: np.abs(v) for k, v in sheets.items()}, **networks}


def lowest(value, rho, *, ties=True):
    """Solid by rank; values that are equal by symmetry go together, above the count or below."""
    value = np.round(value, 12)
    rank = int(rho * value.size)
    level = np.partition(value, rank - 1, axis=None)[rank - 1]
    return (value <= level if ties else value < level).astype(float)


# properties.md 4.3: 48^3, solid or void by the centre. E100 at 0.2, 0.3, 0.5; E111; Zener at 0.2
# and 0.5. None where the cell does not hang together.
CROSS_CHECK = {
    "gyroid sheet": ((0.0692, 0.1137, 0.2448), (0.0743, 0.1280, 0.2739), (1.08, 1.14)),
    "diamond sheet": ((0.0836, 0.1366, 0.2681), (0.0657, 0.1163, 0.2666), (0.76, 0.99)),
    "primitive sheet": ((0.0433, 0.0852, 0.2382), (0.0972, 0.1592, 0.3185), (2.50, 1.41)),
    "IWP sheet": ((0.0701, 0.1322, 0.2957), (0.0615, 0.1052, 0.2328), (0.86, 0.75)),
    "Neovius sheet": ((0.0925, 0.1530, 0.3069), (0.0498, 0.1074, 0.2822), (0.49, 0.91)),
    # At 0.5 a rib of voxels touches by edges only on this grid: not compared.
    "F-RD sheet": ((0.0911, 0.1506, None), (0.0615, 0.1153, None), (0.63, None)),
    "FK-S sheet": ((0.0713, 0.1237, 0.2694), (0.0672, 0.1195, 0.2639), (0.93, 0.98)),
    "primitive net": ((None, 0.1211, 0.3022), (None, 0.0527, 0.1926), (None, 0.58)),
    "IWP net": ((0.0804, 0.1441, 0.2902), (0.0113, 0.0380, 0.1553), (None, 0.47)),
    "IWP net, other side": ((0.0175, 0.0499, 0.1884), (0.0694, 0.1239, 0.2669), (4.82, 1.51)),
    "Neovius net": ((None, None, 0.2300), (None, None, 0.1736), (None, 0.71)),
    "F-RD net": ((None, 0.0583, 0.2062), (None, 0.0918, 0.2651), (None, 1.35)),
    "FK-S net": ((0.0304, 0.0745, 0.2049), (0.0376, 0.0882, 0.2343), (1.27, 1.17)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CROSS_CHECK)
def test_surfaces_of_the_cross_check(name) -> None:
    value = shapes(48)[name]
    along, diagonal, zener = CROSS_CHECK[name]
    for k, rho in enumerate((0.2, 0.3, 0.5)):
        if along[k] is None:
            continue
        fill = lowest(value, rho)
        c = solve_periodic(fill, rtol=1e-3).stiffness
        require_bounds(c, float(fill.mean()), 0.3, subject=name)
        assert engineering_constants(c).youngs[0] == pytest.approx(along[k], rel=0.02)
        assert youngs_along(c, np.ones(3)) == pytest.approx(diagonal[k], rel=0.02)
        ratio = {0: zener[0], 2: zener[1]}.get(k)
        if ratio is not None:
            assert zener_ratio(c) == pytest.approx(ratio, rel=0.02)


# The same of struts. Distances to axes are equal at many voxel centres by symmetry, so that density
# 0.2 does not exist on this grid: 0.196 without and 0.210 with one set of equals. How the source
# chose among equals is not told; its value lies between ours, 2 % allowed at both ends.
STRUTS = {
    "sc": ((0.0915, 0.1493, 0.2964), (0.0155, 0.0418, 0.1520)),
    "bcc": ((0.0101, 0.0296, 0.1334), (0.0700, 0.1178, 0.2510)),
    "fcc": ((0.0427, 0.0825, 0.2194), (0.0564, 0.0972, 0.2089)),
    "octet": ((0.0384, 0.0709, 0.1809), (0.0610, 0.1087, 0.2421)),
    "kelvin": ((0.0470, 0.1070, 0.2712), (0.0334, 0.0761, 0.2236)),
    "diamond-strut": ((0.0232, 0.0536, 0.1679), (0.0529, 0.1077, 0.2682)),
}


def bracket(registry, name, rho, place):
    family = registry.cell_families[name]
    axis = (np.arange(48) + 0.5) / 48
    u = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    value = family.shape(u, **family.parameters)
    along, diagonal = STRUTS[name]
    below, above = (
        solve_periodic(lowest(value, rho, ties=ties), rtol=1e-3).stiffness for ties in (False, True)
    )
    for direction, expected in (([1.0, 0, 0], along[place]), ([1.0, 1, 1], diagonal[place])):
        low, high = (float(youngs_along(c, np.array(direction))) for c in (below, above))
        assert 0.98 * low < expected < 1.02 * high


def test_struts_of_the_cross_check_at_half(registry) -> None:
    bracket(registry, "octet", 0.5, 2)


@pytest.mark.slow
@pytest.mark.parametrize("name", STRUTS)
def test_struts_of_the_cross_check(registry, name) -> None:
    for place, rho in enumerate((0.2, 0.3, 0.5)):
        bracket(registry, name, rho, place)


# properties.md 4.2: 99th percentile of the local over the mean stress, uniaxial along the axis.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "rho", "factor"),
    [
        ("gyroid-network", 0.2, 36.0),
        ("gyroid-network", 0.3, 19.0),
        ("gyroid-network", 0.5, 8.3),
        ("diamond-network", 0.2, 23.0),
        ("diamond-network", 0.3, 12.0),
        ("diamond-network", 0.5, 6.2),
    ],
)
def test_stress_concentration_of_networks(registry, family, rho, factor) -> None:
    solution = solve_periodic(
        cell_fill(calibrate(registry.cell_families[family]), rho, 48), rtol=1e-4
    )
    found = stress_factors(local_stress(solution), np.eye(6)[:, :1], 99.0)[0]
    assert found == pytest.approx(factor, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sheet", "expected"),
    [(True, (0.160823, 0.071617, 0.050657)), (False, (0.103382, 0.051312, 0.042795))],
)
def test_gyroid_at_128_voxels_equals_the_study(sheet, expected) -> None:
    # Solver study, section 3, same grid, other code: six digits, and 1 % is asked for.
    value = shapes(128)["gyroid sheet" if sheet else "gyroid network"]
    c = solve_periodic(lowest(value, 0.3), rtol=1e-4).stiffness
    np.testing.assert_allclose((c[0, 0], c[0, 1], c[3, 3]), expected, rtol=2e-3)


def blended(n, parts):
    """Weighted gyroid and diamond at the centres of 3^3 parts of every voxel."""
    c = (np.arange(3 * n) + 0.5) / (3 * n) * 2 * np.pi
    sx, sy, sz = np.meshgrid(np.sin(c), np.sin(c), np.sin(c), indexing="ij")
    cx, cy, cz = np.meshgrid(np.cos(c), np.cos(c), np.cos(c), indexing="ij")
    gyroid = sx * cy + sy * cz + sz * cx
    diamond = sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz
    return parts[0] * gyroid + parts[1] * diamond


def filled(value, rho):
    """Solid volume fraction of voxels of 3^3 samples."""
    n = len(value) // 3
    return lowest(value, rho).reshape(n, 3, n, 3, n, 3).mean(axis=(1, 3, 5))


# properties.md 4.2, 50/50 blend of the two networks, E100 over the base material's.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("rho", "expected"),
    [(0.20, 0.00679), (0.30, 0.01692), (0.35, 0.02402), (0.40, 0.07557), (0.50, 0.17768)],
)
def test_a_blend_of_two_networks_loses_stiffness(registry, rho, expected) -> None:
    # How the source weighs the two is not told. Equal parts give, by hand, 0.0071, 0.0179, 0.0242,
    # 0.0844, 0.188; parts of equal spread (standard deviations 0.866 and 0.707) 0.0064, 0.0158,
    # 0.0284, 0.0755, 0.178. It lies between, but for 1 % of two grids and the extrapolation.
    found = []
    for parts in ((0.5, 0.5), (1 / 0.866, 1 / 0.707)):
        coarse, fine = (
            solve_periodic(filled(blended(n, parts), rho), rtol=1e-3).stiffness for n in (32, 64)
        )
        found.append(engineering_constants(fine + (fine - coarse) / 3).youngs[0])
    assert 0.99 * min(found) < expected < 1.01 * max(found)
    assert max(found) < 1.35 * min(found)
    if rho < 0.375:
        # What the source warns of: three to four times softer than either network.
        for family in NETWORKS:
            youngs = engineering_constants(stiffness(registry, family, rho)).youngs[0]
            assert max(found) < youngs / 2.8

"""The random cells as families: conformance, seeds, float types, scatter between seeds."""

from dataclasses import replace

import numpy as np
import pytest

from gradedesign import CaseError, PluginError
from gradedesign.testing import check_cell_family
from gradedesign_cells_stochastic import gradedesign_cell_families
from gradedesign_cells_stochastic.random_field import random_field
from gradedesign_cells_stochastic.random_numbers import uniform
from gradedesign_cells_stochastic.random_points import random_points
from gradedesign_cells_stochastic.tessellation import tessellation

FAMILIES = {family.name: family for family in gradedesign_cell_families()}
KINDS = ("isotropic", "lamellar", "columnar", "cubic")
FOAMS = ("delaunay", "voronoi-closed", "voronoi-open")
SPHERES = ("random-pores", "random-spheres")

#: The first three raw numbers of seed 7, stream 1, as numpy 2.4.6 gives them.
PINNED = [14206593023844375757, 2064693230803885548, 3488237491050697490]

every_family = pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda f: f.name)
#: One of each way to make a shape.
some_families = pytest.mark.parametrize(
    "family",
    [
        FAMILIES[n]
        for n in ("voronoi-open", "voronoi-closed", "random-pores", "spinodoid-lamellar-network")
    ],
    ids=lambda f: f.name,
)


def window(family, count):
    """Points that fill the window evenly, a recurrence of the plastic number's kin."""
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return family.period * np.mod(0.2718 + step[:, None] * np.arange(count), 1.0)


def values(family, points, **parameters):
    return family.shape(points, **{**family.parameters, **parameters})


def test_every_cell_is_there():
    spinodoids = {f"spinodoid-{kind}-{end}" for kind in KINDS for end in ("network", "sheet")}
    assert set(FAMILIES) == {*FOAMS, *SPHERES, *spinodoids}


def kinds():
    """Every family; a foam at once, the rest with the slow tests: windows are large."""
    for name, family in FAMILIES.items():
        marks = [] if name == "voronoi-open" else [pytest.mark.slow]
        yield pytest.param(family, id=name, marks=marks)


@pytest.mark.parametrize("family", list(kinds()))
def test_conforms(family):
    check_cell_family(family)


@every_family
def test_a_shorter_period_than_the_window_is_refused(family):
    # One of a half or a third of the window would make the foam repeat there.
    with pytest.raises(PluginError, match="the period must be 2"):
        check_cell_family(replace(family, period=2))


def test_a_seed_always_gives_the_same_cell():
    # Built again, past what is kept.
    foam = tessellation(11.0, 5, 0.7)
    again = tessellation.__wrapped__(11.0, 5, 0.7)
    assert np.array_equal(foam.seeds, random_points.__wrapped__(11.0, 5, 0.7))
    assert np.array_equal(foam.voronoi_edges, again.voronoi_edges)
    assert np.array_equal(foam.delaunay_edges, again.delaunay_edges)
    cones = (90.0, 30.0, 0.0)
    points = window(FAMILIES["spinodoid-isotropic-network"], 4000)
    field = random_field.__wrapped__(11.0, 6, cones)
    assert np.array_equal(random_field(11.0, 6, cones)(points), field(points))


@some_families
def test_seeds_have_cells_of_their_own(family):
    points = window(family, 4000)
    one, other = (values(family, points, seed=s) for s in (11.0, 12.0))
    # Independent shapes are uncorrelated to 1 / sqrt(independent volumes), here about 0.1.
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.3


@some_families
def test_single_precision_stays_single(family):
    points = window(family, 4000)
    single = values(family, points.astype(np.float32))
    assert single.dtype == np.float32
    # Coordinates up to 6 are rounded to 2.4e-7; no shape is steeper than 15 per cell.
    np.testing.assert_allclose(single, values(family, points), atol=1e-5)


@some_families
@pytest.mark.parametrize("seed", [1.5, -1.0, np.nan, np.inf, 2.0**60])
def test_impossible_seeds_are_refused(family, seed):
    with pytest.raises(CaseError, match="expected a whole number"):
        values(family, np.zeros((3, 2)), seed=seed)


@pytest.mark.parametrize("name", [*FOAMS, *SPHERES])
@pytest.mark.parametrize("distance", [-0.1, 0.9, np.nan])
def test_impossible_least_distances_are_refused(name, distance):
    with pytest.raises(CaseError, match=r"expected 0 to 0\.8"):
        values(FAMILIES[name], np.zeros((3, 2)), least_distance=distance)


def test_numbers_of_a_seed_are_those_of_numpys_generator_for_ever():
    # numpy keeps the raw stream of PCG64 and of SeedSequence; its first three 53-bit numbers.
    raw = np.random.PCG64(np.random.SeedSequence([7, 1])).random_raw(3)
    expected = [int(r) // 2**11 / 2**53 for r in raw]
    assert uniform(7.0, 1, 3).tolist() == expected
    assert [int(r) for r in raw] == PINNED


@pytest.mark.parametrize("least", [0.0, 0.4, 0.7, 0.8])
def test_points_keep_their_distance(least):
    points = random_points(31.0, 5, least)
    assert points.shape == (125, 3)
    assert (points >= 0).all()
    assert (points < 5).all()
    apart = points[:, None] - points[None]
    apart -= 5 * np.round(apart / 5)
    nearest = np.sort(np.linalg.norm(apart, axis=2), axis=1)[:, 1]
    assert nearest.min() >= least
    # At random, the nearest of points of density 1 is Gamma(4/3) (3 / 4 pi)^(1/3) = 0.554 away.
    if least == 0:
        assert nearest.mean() == pytest.approx(0.554, abs=4 * 0.2 / 125**0.5)


def test_points_of_one_seed_have_no_preferred_place():
    # Octants of the window hold binomial(1250, 1/8) points: 156 with a deviation of 11.7.
    points = np.concatenate([random_points(float(s), 5, 0.0) for s in range(50, 60)])
    octant = (points >= 2.5) @ np.array([1, 2, 4])
    assert np.abs(np.bincount(octant, minlength=8) - 156.25).max() < 4 * 11.7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "level", "scatter"),
    [
        ("voronoi-open", 0.08, 0.02),
        ("voronoi-closed", 0.04, 0.01),
        ("delaunay", 0.06, 0.02),
        ("random-spheres", 0.5, 0.06),
        ("spinodoid-isotropic-network", 0.0, 0.02),
    ],
)
def test_density_at_one_level_scatters_little_between_seeds(name, level, scatter):
    # The relative deviations that the README states; 0 would mean that seeds do nothing.
    family = FAMILIES[name]
    # Counting adds 0.6 % of a density of 0.1 at most; of 60000 points it added 1.3 %.
    points = window(family, 240_000)
    density = [np.mean(values(family, points, seed=float(s)) <= level) for s in range(60, 66)]
    found = np.std(density, ddof=1) / np.mean(density)
    assert 0.03 * scatter < found < scatter

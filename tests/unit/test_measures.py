"""Stress measures by phase and neighbourhood."""

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.maps.cell_map import uniform_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.mechanics.explicit.measures import stress_measures, worst_neighbourhood
from gradedesign.mechanics.explicit.neighbourhoods import neighbourhood_cells, neighbourhoods


def _cloud(count=4000):
    rng = np.random.default_rng(5117)
    return rng.uniform(0, 40, (3, count)), rng.uniform(0.5, 1.5, count), rng


def test_phases_are_measured_apart():
    points, volumes, _ = _cloud()
    phase = np.where(points[0] < 20, 0, 2)
    stress = np.repeat(np.where(phase == 0, 10.0, 30.0)[:, None], 4, axis=1)
    measures = stress_measures(
        points,
        volumes,
        stress,
        phase,
        np.ones(len(volumes), bool),
        limit=20.0,
        percentile=99.5,
        cells=10.0,
    )
    assert [m.phase for m in measures] == ["lattice", "passive solid"]
    assert [m.value for m in measures] == [10.0, 30.0]
    assert [m.share_above for m in measures] == [0.0, 1.0]
    assert sum(m.volume for m in measures) == pytest.approx(volumes.sum())


def test_excluded_elements_do_not_count():
    points, volumes, _ = _cloud()
    stress = np.where(points[0] < 5, 1e6, 1.0)[:, None] * np.ones(4)
    measures = stress_measures(
        points,
        volumes,
        stress,
        np.zeros(len(volumes), int),
        points[0] >= 5,
        limit=2.0,
        percentile=99.5,
        cells=10.0,
    )
    assert measures[0].maximum == 1.0


def test_half_a_per_cent_cannot_hide_a_failing_cell():
    """One hot cell of 64: the percentile misses most of it, the neighbourhood does not."""
    points, volumes, _ = _cloud(20000)
    hot = np.all(np.abs(points - np.array([[25.0], [35.0], [15.0]])) < 2.0, axis=0)
    assert hot.sum() / hot.size < 0.005
    stress = np.where(hot, 100.0, 1.0)[:, None] * np.ones(4)
    value, centre = worst_neighbourhood(points, volumes, stress, 99.5, 10.0)
    assert value == 100.0
    assert np.abs(np.subtract(centre, (25.0, 35.0, 15.0))).max() <= 5.0
    measure = stress_measures(
        points,
        volumes,
        stress,
        np.zeros(len(volumes), int),
        np.ones(len(volumes), bool),
        limit=50.0,
        percentile=99.5,
        cells=10.0,
    )[0]
    assert measure.value == 1.0
    assert measure.worst_cell == 100.0


def test_slivers_at_the_border_are_no_neighbourhood():
    points, volumes, _ = _cloud(8000)
    points[:, 0] = 49.0  # alone in its own cube
    stress = np.ones((8000, 4))
    stress[0] = 500.0
    value, _ = worst_neighbourhood(points, volumes, stress, 99.5, 10.0)
    assert value == 1.0


def test_neighbourhoods_of_a_map_are_its_cells():
    # Cells about the z axis: layers of 5 mm from 10 mm on, 12 in a turn of 30 degrees each.
    cells = cylindrical_map(around=12, radial_size=5, axial_size=5, inner_radius=10)
    rng = np.random.default_rng(557)
    radius, angle = rng.uniform(10, 20, 40_000), rng.uniform(0, 2 * np.pi, 40_000)
    points = np.array([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 5, 40_000)])
    found = list(neighbourhoods(points, np.ones(40_000), cells))
    # Two layers of twelve sectors come first, then the same shifted by half a cell.
    assert sum(n.members.size for n in found[:24]) == 40_000
    for near in found[:24]:
        r = np.hypot(*near.centre[:2])
        assert near.edge == pytest.approx(max(2 * np.pi * r / 12, 5.0))
        members = np.floor(cells(points[:, near.members]))
        assert np.ptp(members, axis=1).max() == 0


def test_the_worst_cell_of_a_map_is_found_where_it_is():
    cells = cylindrical_map(around=12, radial_size=5, axial_size=5, inner_radius=10)
    rng = np.random.default_rng(558)
    radius, angle = rng.uniform(10, 20, 20_000), rng.uniform(0, 2 * np.pi, 20_000)
    points = np.array([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 5, 20_000)])
    hot = (radius > 15) & (angle > np.radians(60)) & (angle < np.radians(90))
    stress = np.where(hot, 70.0, 10.0)[:, None] * np.ones(4)
    value, centre = worst_neighbourhood(points, np.ones(20_000), stress, 50.0, cells)
    # By hand: that cell's centre of mass is at 75 degrees and, by area, a radius of 17.62 mm.
    assert value == 70.0
    assert np.degrees(np.arctan2(centre[1], centre[0])) == pytest.approx(75, abs=1)
    assert np.hypot(*centre[:2]) == pytest.approx(17.5 * np.sinc(15 / 180), abs=0.2)


def test_equal_cubes_keep_cubes_and_unequal_edges_do_not():
    def design(cell_map):
        return LatticeDesign(
            domain=DesignDomain(distance=lambda x: x[0], lower=np.zeros(3), upper=np.ones(3)),
            cells=plain_cells(lambda u: u[0], 0.0, 1.0), cell_map=cell_map,
            cell_size=8.0, density=0.3,
        )  # fmt: skip

    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    assert neighbourhood_cells(design(uniform_map(8.0, rotation=turn))) == 8.0
    assert neighbourhood_cells(design(lambda x: x / 8.0)) == 8.0
    for cell_map in (
        uniform_map((8.0, 8.0, 9.0)),
        cylindrical_map(around=12, radial_size=5, axial_size=5, inner_radius=10),
    ):
        assert neighbourhood_cells(design(cell_map)) is cell_map

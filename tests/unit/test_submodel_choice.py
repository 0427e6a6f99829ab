"""Submodels: where the lattice is stressed most, cut out of the exported surface."""

import numpy as np
import pytest

from gradedesign import MeshError
from gradedesign.design.acceptance.submodel_choice import (
    Submodel,
    clip_surface,
    cut_facets,
    enlarged_submodel,
    inside_evaluation_box,
    most_stressed_submodels,
    submodel_box,
)
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume, open_edge_count


def test_the_hottest_cells_come_first_and_do_not_overlap():
    rng = np.random.default_rng(311)
    points = rng.uniform(0, 40, (3, 20000))
    volumes = np.ones(20000)
    first = np.all(np.abs(points - 15.0) < 3, axis=0)
    second = np.all(np.abs(points - 35.0) < 3, axis=0)
    stress = np.ones((20000, 4)) + 50.0 * first[:, None]
    other = np.ones((20000, 4)) + 80.0 * second[:, None]
    submodels = most_stressed_submodels(
        points,
        volumes,
        {"a": stress, "b": other},
        np.ones(20000, bool),
        percentile=99.5,
        cells=10.0,
        count=2,
    )
    assert [w.value for w in submodels] == [81.0, 51.0]
    assert [w.load_case for w in submodels] == ["b", "a"]
    assert np.abs(np.subtract(submodels[0].centre, 35.0)).max() <= 5.0
    gap = np.abs(np.subtract(submodels[0].centre, submodels[1].centre)).max()
    assert gap >= 9.9


def test_no_eligible_element_gives_no_window():
    assert (
        most_stressed_submodels(
            np.zeros((3, 4)),
            np.ones(4),
            {"a": np.ones((4, 4))},
            np.zeros(4, bool),
            percentile=99.5,
            cells=1.0,
            count=1,
        )
        == ()
    )


def test_clipping_keeps_the_common_volume():
    """A 6 x 4 x 4 mm box cut to its first 2 mm: 2 x 4 x 4 mm^3."""
    part = box_surface((6.0, 4.0, 4.0))
    clipped = clip_surface(part, np.array([-1.0, -1.0, -1.0]), np.array([2.0, 5.0, 5.0]))
    assert open_edge_count(clipped) == 0
    assert enclosed_volume(clipped) == pytest.approx(32.0, rel=1e-9)


def test_a_window_without_material_is_an_error():
    with pytest.raises(MeshError, match="no material"):
        clip_surface(box_surface((1.0, 1.0, 1.0)), np.full(3, 5.0), np.full(3, 6.0))


def test_the_analysed_box_reaches_beyond_the_evaluation_box():
    submodel = Submodel(centre=(1.0, 2.0, 3.0), half=5.0, value=1.0, load_case="a")
    low, high = submodel_box(submodel)
    assert np.allclose((low + high) / 2, submodel.centre)
    assert np.allclose(high - low, 20.0)  # 10 mm and half a cell on either side
    points = np.array([[6.0, 6.1], [2.0, 2.0], [3.0, 3.0]])
    assert inside_evaluation_box(points, submodel).tolist() == [True, False]


def test_a_window_is_enlarged_where_it_has_room():
    submodel = Submodel(centre=(0.0, 0.0, 0.0), half=5.0, value=1.0, load_case="a")
    held = np.array([[[13.0, -1.0, -1.0], [13.0, 1.0, -1.0], [13.0, 0.0, 1.0]]])
    larger = enlarged_submodel(submodel, [held])
    # From 10 to 15 mm on five sides; on the sixth a held face lies at 13 mm.
    low, high = submodel_box(larger)
    assert (low.tolist(), high.tolist()) == ([-15.0] * 3, [10.0, 15.0, 15.0])
    assert (submodel.enlarged, larger.enlarged) == (False, True)
    assert inside_evaluation_box(np.array([[5.1], [0.0], [0.0]]), larger).tolist() == [False]
    around = np.array([[-13.0, 13.0, 13.0], [13.0, 13.0, -13.0], [-13.0, -13.0, -13.0]])
    assert enlarged_submodel(submodel, [around[None]]) is None


def test_cut_facets_lie_on_the_planes():
    box = box_surface((2.0, 2.0, 2.0))
    points, facets = box.vertices.T, box.faces
    cut, plane = cut_facets(points, facets, np.array([-1.0, -1.0, 0.0]), np.full(3, 2.0), 1e-9)
    assert set(plane.tolist()) == {1, 3, 4, 5}
    assert len(cut) == 8

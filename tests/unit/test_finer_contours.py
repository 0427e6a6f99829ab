"""A finer contour is tried in the worst cells of a coarse one before all of it is made."""

from dataclasses import replace

import numpy as np
import pytest
from plain_cells import plain_cells
from scipy.spatial.transform import Rotation

from gradedesign.geometry.contour.resolution import CoarseContourError, Resolution
from gradedesign.geometry.contour.surface import boxed_grid, contour
from gradedesign.geometry.contour.true_volume import VolumeFit
from gradedesign.geometry.lattice.cube_sides import cube_sides, room_in_part
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.lattice_contour import finer_step, lattice_contour, volume_fit
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance

EDGE = 12.0  #: mm. 27 cells of 4 mm.
PART = box_surface((EDGE, EDGE, EDGE))
#: Turns the struts out of the axes of the grid, which meets those along them all alike.
TURN = Rotation.from_euler("xyz", [20.0, 35.0, 10.0], degrees=True).as_matrix()
ASKED = Resolution(within=0.002, memory=1e9)


def _struts(u):
    """Distance in cells to struts along the axes through the middles, which meet in edges."""
    x = np.mod(u, 1.0) - 0.5
    return np.sqrt(np.min([x[1] ** 2 + x[2] ** 2, x[0] ** 2 + x[2] ** 2, x[0] ** 2 + x[1] ** 2], 0))


@pytest.fixture(scope="module")
def design():
    domain = DesignDomain(
        distance=surface_distance(PART), lower=(0.0, 0.0, 0.0), upper=(EDGE, EDGE, EDGE)
    )
    return LatticeDesign(
        domain=domain,
        cells=plain_cells(_struts, 0.0, 0.5),
        cell_map=lambda x: np.tensordot(TURN, x, axes=1) / 4.0,
        cell_size=4.0,
        density=0.3,
    )


def _missed(design, step):
    with pytest.raises(CoarseContourError) as caught:
        lattice_contour(design, PART, step, ASKED)
    return caught.value


def test_the_step_that_does_in_the_worst_cells_does_everywhere(design):
    """Several steps are tried: the first of them misses for the whole contour too."""
    first = _missed(design, 0.35)
    _missed(design, 0.85 * first.step)
    step = finer_step(design, PART, first, ASKED)
    raw, _ = lattice_contour(design, PART, step, ASKED)
    assert 0.5 * ASKED.within < raw.volume_errors.max() <= ASKED.within


def test_the_worst_cells_are_named_by_their_boxes(design):
    """Eight of 27, each with an error that the whole contour has there."""
    first = _missed(design, 0.35)
    raw, _ = lattice_contour(design, PART, 0.35, None)
    numbers = [tuple(np.rint(lower / 4.0).astype(int)) for lower, _ in first.worst]
    assert all(np.allclose(upper - lower, 4.0) for lower, upper in first.worst)
    largest = np.sort(raw.volume_errors, axis=None)[::-1][:8]
    np.testing.assert_array_equal([raw.volume_errors[number] for number in numbers], largest)


def test_a_body_of_few_cells_is_contoured_whole(design):
    """None of its cells is tried alone."""
    first = CoarseContourError("", step=0.35, error=0.02)
    assert finer_step(design, PART, first, ASKED) == pytest.approx(0.85 * 0.35)


def test_room_is_the_share_of_a_cell_in_the_part():
    """A part of 10 x 12 x 12 mm in cells of 4 mm of the box of 12 mm: halves at its end."""
    fit = VolumeFit(lower=np.zeros(3), upper=np.full(3, EDGE), cell=4.0)
    grid = boxed_grid(np.full(3, -0.5), np.full(3, EDGE + 0.5), 0.1)
    part = box_surface((10.0, EDGE, EDGE))
    room = room_in_part(cube_sides(part, grid.origin, grid.shape, grid.h), grid, fit)
    expected = np.array([1.0, 1.0, 0.5])[:, None, None] * np.ones((3, 3, 3))
    # Half a cube of 0.1 mm at each of up to three faces of a cell.
    np.testing.assert_allclose(room, expected, atol=3 * 0.05 / 4.0)


@pytest.mark.parametrize(("share", "low", "high"), [(0.75, 1.0, 1.0), (0.25, 0.25, 0.5)])
def test_what_is_left_of_a_cell_counts_over_half_of_one(design, share, low, high):
    """The same contour, with another room in the part: of its error one term is a square."""
    fit = volume_fit(design, 0.35, None)
    field = lattice_field(design)
    grid = boxed_grid(fit.lower, fit.upper, 0.35)
    plain = contour(field, grid, fit=fit).volume_errors
    found = contour(field, grid, fit=replace(fit, room=np.full(fit.shape, share))).volume_errors
    assert (low * plain <= found).all()
    assert (found <= high * plain).all()

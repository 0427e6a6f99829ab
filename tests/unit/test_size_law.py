"""Cell size from density: the published numbers of length and ratio grading, and refusals."""

import numpy as np
import pytest

from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.maps.size_law import (
    size_by_ratio,
    size_field_by_ratio,
    size_field_for_wall,
    size_for_wall,
    wall_ratio,
)

# alpha, beta, gamma of Ramirez Salazar 2022, eq. 2.10 and 2.11.
PRIMITIVE = (2.946, 0.711, 1.135)
GYROID = (4.057, 0.688, 1.114)

STRUTS = CellFamily(
    name="test-cross",
    shape=lambda u: np.sort(np.abs(np.mod(u, 1.0) - 0.5), axis=0)[1],
    source="square struts along the axes, half width t: density 12 t^2 - 16 t^3",
    distance=True,
)


def published_ratio(rho, alpha, beta, gamma):
    """Wall over size of eq. 2.9, rho = beta - beta (1 - alpha r)^gamma."""
    return (1 - (1 - rho / beta) ** (1 / gamma)) / alpha


def cube_corners(points):
    """Density of the cube test: 0.15 to 0.50 in x at the bottom and in y at the top."""
    x, y, z = points / 100.0 + 0.5
    return 0.15 + 0.35 * ((1 - z) * x + z * y)


@pytest.mark.parametrize(
    ("law", "thickness", "length", "ratio"),
    [
        # Table 3.3, recomputed in full precision; the thesis prints 1.59-5.58, 13.45-46.91,
        # 3.20-5.58 and 1.22-4.24, 17.69-61.44, 2.44-4.24.
        (PRIMITIVE, (1.599, 5.576), (13.450, 46.907), (3.198, 5.576)),
        (GYROID, (1.221, 4.239), (17.692, 61.441), (2.441, 4.239)),
    ],
)
def test_cube_of_the_thesis(law, thickness, length, ratio):
    corners = np.array(np.meshgrid(*[[-50.0, 50.0]] * 3)).reshape(3, -1)
    r = published_ratio(cube_corners(corners), *law)
    ends = (float(r.min()), float(r.max()))
    walls = 25.0 * r
    assert (walls.min(), walls.max()) == pytest.approx(thickness, abs=6e-4)
    sizes = size_for_wall(r, 3.0)
    assert (sizes.min(), sizes.max()) == pytest.approx(length, abs=6e-3)
    both = r * size_by_ratio(r, (25.0, 50.0), ends)
    assert (both.min(), both.max()) == pytest.approx(ratio, abs=6e-4)


def test_ratio_of_a_true_distance_is_twice_its_level():
    half = np.array([0.05, 0.1, 0.2])
    rho = 12 * half**2 - 16 * half**3
    np.testing.assert_allclose(wall_ratio(calibrate(STRUTS), rho), 2 * half, rtol=5e-3)


def test_dense_places_get_small_cells():
    r = np.linspace(0.05, 0.25, 9)
    sizes = size_by_ratio(r, (20.0, 60.0), (0.05, 0.25))
    assert (sizes[0], sizes[-1]) == pytest.approx((60.0, 20.0))
    assert (np.diff(sizes) < 0).all()
    assert sizes[4] == pytest.approx(30.0)  # 1/L halfway between 1/60 and 1/20


def test_size_fields_follow_the_density():
    def density(points):
        return 0.1 + 0.004 * points[0]

    points = np.array([[0.0, 25.0, 50.0], [1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    r = wall_ratio(calibrate(STRUTS), density(points))
    walls = size_field_for_wall(density, calibrate(STRUTS), 2.0)(points)
    np.testing.assert_allclose(walls * r, 2.0, rtol=1e-12)
    sizes = size_field_by_ratio(density, calibrate(STRUTS), (10.0, 30.0), (0.1, 0.3))(points)
    assert (sizes[0], sizes[-1]) == pytest.approx((30.0, 10.0))


@pytest.mark.parametrize(
    ("compute", "kind", "words"),
    [
        (lambda: size_for_wall(0.1, 0.0), CaseError, "wall is 0 mm"),
        (lambda: size_for_wall(np.array([0.1, 0.0]), 2.0), DensityError, "raise the lower density"),
        (lambda: size_for_wall(np.array([0.02, 0.1]), 2.0, (10.0, 90.0)), DensityError,
         "20 to 100 mm at the densities"),
        (lambda: size_by_ratio(0.1, (50.0, 40.0), (0.05, 0.2)), CaseError, "smallest <= largest"),
        (lambda: size_by_ratio(0.1, (40.0, 50.0), (0.2, 0.2)), CaseError, "range of densities"),
        (lambda: size_by_ratio(0.3, (40.0, 50.0), (0.05, 0.2)), DensityError, "0.05 to 0.2"),
    ],
)  # fmt: skip
def test_impossible_laws_are_refused(compute, kind, words):
    with pytest.raises(kind, match=words):
        compute()

"""Density that trimmed cells hold: the record, its use in the model, and the count of samples."""

from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign import CellFamily
from gradedesign.errors import ResourceError
from gradedesign.ladder import face_fill as module
from gradedesign.ladder.face_fill import face_fill
from gradedesign.lattice.lattice import KeptRegion
from gradedesign.mesh.tet_mesh import centroids
from gradedesign.part.part_mesh import box_part_mesh
from gradedesign.sizing.local_fill import LocalFill


def test_held_density_its_slope_and_its_inverse():
    fill = LocalFill(
        asked=np.array([0.1, 0.2, 0.4]), held=np.array([[0.2, 0.1], [0.3, 0.2], [0.4, 0.4]])
    )
    rho = np.array([0.15, 0.15])
    np.testing.assert_allclose(fill.at(rho), [0.25, 0.15])
    np.testing.assert_allclose(fill.slope(rho), [1.0, 1.0])
    np.testing.assert_allclose(fill.slope(np.full(2, 0.3)), [0.5, 1.0])
    # In proportion beyond the ends.
    np.testing.assert_allclose(fill.at(np.array([0.05, 0.8])), [0.1, 0.8])
    rng = np.random.default_rng(61)
    for _ in range(20):
        rho = rng.uniform(0.05, 0.6, 2)
        np.testing.assert_allclose(fill.asked_for(fill.at(rho)), rho, rtol=1e-12)


@pytest.mark.parametrize(
    ("asked", "held"),
    [([0.2, 0.1], [[1], [2]]), ([0.1, 0.2], [[2], [1]]), ([0.1, 0.2], [[0], [1]])],
)
def test_impossible_fills_are_refused(asked, held):
    with pytest.raises(ValueError, match="increasing"):
        LocalFill(asked=np.array(asked), held=np.array(held, dtype=float))


def plates(u):
    """A plate across z in the middle of every cell, as thick as the density."""
    return np.abs(u[2] - np.floor(u[2]) - 0.5)


#: Level of a density; plates alone are no cell that could be calibrated.
LEVELS = SimpleNamespace(level_of=lambda rho: rho / 2)
FAMILY = CellFamily(name="plates", shape=plates, symmetry="tetragonal")


def counted(origin=0.0, kept=(), skin=None, bounds=(0.33, 0.336)):
    """Fill of a box of 20 x 10 x 10 mm, cells of 10 mm, and the place of every tet.

    A third is a whole number of the 12 samples along a cell.
    """
    mesh = box_part_mesh((20.0, 10.0, 10.0), 4.0)
    half = np.array([10.0, 5.0, 5.0])[:, None]
    case = SimpleNamespace(
        lattice=SimpleNamespace(
            edges=(10.0, 10.0, 10.0), rotation=(0.0, 0.0, 0.0), origin=(0.0, 0.0, origin), skin=skin
        )
    )

    def box(points):
        return (np.abs(points - half) - half).max(axis=0)

    fill = face_fill(case, mesh, FAMILY, {}, LEVELS, bounds, box, kept)
    return fill, centroids(mesh)


def test_whole_plates_hold_what_the_neighbourhood_shows():
    """One plate at half height: all of it in a block of one cell about any height z.

    Of the block 10 - |z - 5| mm lie in the part. Between samples, 12 along a cell, both are linear.
    """
    fill, (_, _, z) = counted()
    expected = 10 / 3 / (10 - np.abs(z - 5))
    whole = np.abs(z - 5) < 10 / 3 - 10 / 12
    assert whole.sum() > 20
    found = fill.at(np.full(z.size, 1 / 3))
    np.testing.assert_allclose(found[whole], expected[whole], rtol=1e-5)


def test_plates_on_the_faces_are_halves():
    """Plates on both faces, half of each inside: a block at half height holds what is asked for."""
    fill, (_, _, z) = counted(origin=5.0)
    found = fill.at(np.full(z.size, 1 / 3))
    # A block of one cell about any height: from z - 5 to z + 5, with the plate at the near face.
    near, half = 5 - np.abs(z - 5), 10 / 6
    far = np.maximum(near - 5 + half, 0)
    # The corner of `far` falls between samples.
    straight = np.abs(near - 5 + half) > 10 / 12
    np.testing.assert_allclose(found[straight], ((half + far) / (5 + near))[straight], rtol=1e-5)


def test_solid_regions_are_no_lattice():
    region = KeptRegion(distance=lambda points: points[0], margin=10.0)
    fill, (x, _, _) = counted(kept=(region,))
    whole, _ = counted()
    # Plates run along x: beyond the solid as much of them is held as without it.
    beyond = x > 5 + 10 / 12
    np.testing.assert_allclose(fill.held[:, beyond], whole.held[:, beyond], rtol=1e-5)
    # A block with no lattice at all holds what is asked for; no tetrahedron there uses it.
    inside = x < 5 - 10 / 12
    np.testing.assert_allclose(
        fill.held[:, inside].T, np.tile(fill.asked, (inside.sum(), 1)), rtol=1e-5
    )


def test_too_many_cells_are_refused(monkeypatch):
    monkeypatch.setattr(module, "MOST_SAMPLES", 1000)
    with pytest.raises(ResourceError, match="faces"):
        counted()

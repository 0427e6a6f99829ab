"""Density held beside passive regions: the record, and the count of samples."""

from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign import CellFamily
from gradedesign.errors import ResourceError
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.maps.cell_map import uniform_map
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.sizing import density_beside_solids as module
from gradedesign.mechanics.sizing.density_beside_solids import density_beside_solids
from gradedesign.mechanics.sizing.effective_density import EffectiveDensity


def test_held_density_its_slope_and_its_inverse():
    fill = EffectiveDensity(
        nominal=np.array([0.1, 0.2, 0.4]), effective=np.array([[0.2, 0.1], [0.3, 0.2], [0.4, 0.4]])
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
        np.testing.assert_allclose(fill.nominal_for(fill.at(rho)), rho, rtol=1e-12)


@pytest.mark.parametrize(
    ("asked", "held"),
    [([0.2, 0.1], [[1], [2]]), ([0.1, 0.2], [[2], [1]]), ([0.1, 0.2], [[0], [1]])],
)
def test_impossible_fills_are_refused(asked, held):
    with pytest.raises(ValueError, match="increasing"):
        EffectiveDensity(nominal=np.array(asked), effective=np.array(held, dtype=float))


def plates(u):
    """A plate across z in the middle of every cell, as thick as the density."""
    return np.abs(u[2] - np.floor(u[2]) - 0.5)


#: Plates alone are no cell that could be calibrated.
CELL = SimpleNamespace(
    family=CellFamily(name="plates", shape=plates, symmetry="tetragonal"),
    parameters={},
    level_of=lambda rho: rho / 2,
)


def counted(passive, bounds=(0.33, 0.336)):
    """Fill of a box of 20 x 10 x 10 mm, cells of 10 mm, and the place of every tet.

    A third is a whole number of the 12 samples along a cell.
    """
    mesh = box_part_mesh((20.0, 10.0, 10.0), 4.0)
    domain = DesignDomain(
        distance=lambda points: -np.ones(points.shape[1:]), lower=(0.0, 0.0, 0.0),
        upper=(20.0, 10.0, 10.0), components=passive,
    )  # fmt: skip
    return density_beside_solids(uniform_map(10.0), mesh, CELL, bounds, domain), centroids(mesh)


def test_a_region_in_the_void_leaves_the_plates_in_less_room():
    """Below 2.5 mm all is solid: of a block of one cell it takes the void below the plate.

    A plate of 3.3 mm lies about 5 mm in every cell of 10 mm, also below and above the part. The
    block about height z reaches from z - 5 to z + 5 mm.
    """
    fill, (_, _, z) = counted((PassiveRegion(to_place=lambda points: points[2], margin=2.5),))
    found = fill.at(np.full(z.size, 1 / 3))
    low, high = np.maximum(z - 5, 2.5), z + 5
    plates = sum(
        np.clip(np.minimum(high, middle + 5 / 3) - np.maximum(low, middle - 5 / 3), 0, None)
        for middle in (5, 15)
    )
    # Between samples, 10/12 mm apart, corners of these lines are round.
    corners = np.array([5 / 3, 7.5, 25 / 3])
    smooth = np.abs(z[:, None] - corners).min(axis=1) > 10 / 12
    assert smooth.sum() > 20
    np.testing.assert_allclose(found[smooth], (plates / (high - low))[smooth], rtol=1e-5)


def test_plates_that_end_at_a_region_hold_what_is_asked_for():
    region = PassiveRegion(to_place=lambda points: points[0], margin=10.0)
    fill, (x, _, _) = counted((region,))
    # Plates run along x: beyond the solid as much of them is held as without it. A block with no
    # lattice at all holds what is asked for too; no tetrahedron there uses it.
    clear = np.abs(x - 5) > 10 / 12
    assert 20 < clear.sum() < clear.size
    np.testing.assert_allclose(
        fill.effective[:, clear].T, np.tile(fill.nominal, (clear.sum(), 1)), rtol=1e-5
    )


def test_too_many_cells_are_refused(monkeypatch):
    monkeypatch.setattr(module, "MOST_SAMPLES", 1000)
    with pytest.raises(ResourceError, match="passive regions"):
        counted(())

"""Few cells across a part: chords, counted cells, and the factor on the stiffness."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.errors import CaseError, DensityError
from gradedesign.fe.load_case import PartLoadCase
from gradedesign.fe.loads import traction_force
from gradedesign.fe.space import tet_space
from gradedesign.fe.supports import supports_on
from gradedesign.ladder.finite_cells import (
    cells_across,
    finite_size_of,
    local_factor,
    spread_warnings,
)
from gradedesign.lattice.lattice import KeptRegion
from gradedesign.material.finite_size_table import FiniteRatio, FiniteSizeRow, FiniteSizeTable
from gradedesign.material.material import Material
from gradedesign.material.power_law import power_law
from gradedesign.mesh.surface_mesh import corner_points
from gradedesign.mesh.tet_mesh import boundary_facets, centroids
from gradedesign.part.box import box_surface
from gradedesign.part.chords import chords
from gradedesign.part.part_mesh import box_part_mesh
from gradedesign.sizing.homogenised import solve_homogenised
from gradedesign.sizing.homogenised_model import homogenised_model
from gradedesign.sizing.lattice_stiffness import lattice_stiffness, lattice_stiffness_derivative
from gradedesign.sizing.local_factor import LocalFactor

AXES = Rotation.from_euler("XYZ", (20, -35, 50), degrees=True).as_matrix()


def test_chords_of_a_box_follow_from_its_faces():
    size = np.array([4.0, 3.0, 2.0])
    rng = np.random.default_rng(71)
    # Beside random places, some over the diagonals and edges of the faces' triangles.
    points = np.hstack([rng.uniform(0.05, 0.95, (3, 200)), np.full((3, 1), 0.5)])
    points = points * size[:, None]
    back, ahead = chords(corner_points(box_surface(tuple(size))), points, np.eye(3))
    np.testing.assert_allclose(back, points, atol=1e-12)
    np.testing.assert_allclose(ahead, size[:, None] - points, atol=1e-12)
    # Along other directions: the first of the six planes.
    back, ahead = chords(corner_points(box_surface(tuple(size))), points, AXES)
    for k in range(3):
        d = AXES[:, k][:, None]
        planes = np.where(d > 0, (size[:, None] - points) / d, -points / d)
        np.testing.assert_allclose(ahead[k], planes.min(axis=0), rtol=1e-9)
        planes = np.where(d < 0, (points - size[:, None]) / d, points / d)
        np.testing.assert_allclose(back[k], planes.min(axis=0), rtol=1e-9)


def test_chords_end_nowhere_outside():
    back, ahead = chords(corner_points(box_surface((1, 1, 1))), np.array([[2.0]] * 3), np.eye(3))
    assert np.isinf([back, ahead]).all()


def counted(size, cell=6.0, kept=(), lattice=None, mesh_size=3.0, rotation=(0.0, 0.0, 0.0)):
    mesh = box_part_mesh(size, mesh_size)
    half = np.array(size)[:, None] / 2
    case = SimpleNamespace(
        lattice=SimpleNamespace(edges=(cell,) * 3, rotation=rotation, size_words=f"{cell:g} mm")
    )
    part = SimpleNamespace(surface=box_surface(size))
    lattice = np.ones(mesh.tets.shape[1], dtype=bool) if lattice is None else lattice(mesh)

    def box(points):
        return (np.abs(points - half) - half).max(axis=0)

    return cells_across(case, part, mesh, lattice, kept, box), mesh


@pytest.mark.parametrize(
    ("size", "expected"),
    [
        # A plate of one cell, 5 wide; a bar of 2 by 2, 10 long; a cube of 3.
        ((30.0, 30.0, 6.0), (1.0, 0.2)),
        ((60.0, 12.0, 12.0), (0.5, 0.5)),
        ((18.0, 18.0, 18.0), (1 / 3, 1 / 3)),
        # Two directions decide: a strip of one cell, 2.5 wide, however long.
        ((36.0, 15.0, 6.0), (1.0, 0.4)),
    ],
)
def test_cells_across_plates_bars_and_cubes(size, expected):
    found, _ = counted(size)
    np.testing.assert_allclose(found.T, np.tile(expected, (found.shape[1], 1)), rtol=1e-9)


def test_cells_are_counted_along_their_own_axes():
    """Turned by a quarter about x, a plate across z is one across the cells' y: the same."""
    found, _ = counted((30.0, 30.0, 6.0), rotation=(90.0, 0.0, 0.0))
    np.testing.assert_allclose(found.T, np.tile((1.0, 0.2), (found.shape[1], 1)), rtol=1e-9)


def test_a_held_end_is_no_free_face():
    """The lower face kept solid: half of the loss, as for a plate twice as thick."""
    bottom = KeptRegion(distance=lambda points: np.abs(points[2]), margin=1.0)
    found, _ = counted((30.0, 30.0, 6.0), kept=(bottom,))
    np.testing.assert_allclose(found.max(axis=0), 0.5, rtol=1e-9)


def test_solid_tetrahedra_are_not_counted():
    found, mesh = counted((30.0, 30.0, 6.0), lattice=lambda mesh: centroids(mesh)[0] > 15)
    left = centroids(mesh)[0] <= 15
    assert (found[:, left] == 0).all()
    np.testing.assert_allclose(found[0, ~left], 1.0, rtol=1e-9)


def test_less_than_a_cell_is_refused():
    with pytest.raises(CaseError, match=r"0\.83 cells of 6 mm thick near"):
        counted((30.0, 30.0, 5.0))


def ratios(*values):
    return tuple(
        FiniteRatio(cells=n, value=v, error=0.0, spread=0.0) for n, v in enumerate(values, 1)
    )


ROWS = tuple(
    FiniteSizeRow(
        density=rho,
        resolution=24,
        block=ratios(0.6 + rho / 2),
        wall=ratios(0.8 + rho / 4, 0.95),
        wall_shear=ratios(1.0),
    )
    for rho in (0.2, 0.4)
)
TABLE = FiniteSizeTable(
    family="test", parameters={"a": 1.0}, poissons_ratio=0.3, rows=ROWS, method="", version="",
    date="",
)  # fmt: skip


@pytest.mark.parametrize(
    ("size", "expected"),
    [
        # wall(1) block(5) / wall(5) by hand; block(1); at density 0.2 and 0.4.
        ((30.0, 30.0, 6.0), (0.85 * 0.94 / 0.98, 0.9 * 0.96 / 0.98)),
        ((30.0, 6.0, 6.0), (0.7, 0.8)),
    ],
)
def test_factors_of_walls_and_bars(size, expected):
    mesh = box_part_mesh(size, 3.0)
    half = np.array(size)[:, None] / 2
    case = SimpleNamespace(lattice=SimpleNamespace(edges=(6.0,) * 3, rotation=(0.0,) * 3))
    part = SimpleNamespace(surface=box_surface(size))
    found = local_factor(
        case, part, mesh, np.zeros(mesh.tets.shape[1]), (),
        lambda points: (np.abs(points - half) - half).max(axis=0), TABLE,
    )  # fmt: skip
    for rho, value in zip((0.2, 0.4), expected, strict=True):
        np.testing.assert_allclose(found.at(np.full(mesh.tets.shape[1], rho)), value, rtol=1e-9)


def resolved(bounds=(0.2, 0.4), family="test", parameters=None, edges=(6.0, 6.0, 6.0)):
    case = SimpleNamespace(lattice=SimpleNamespace(edges=edges, size_words="6 mm"))
    registry = SimpleNamespace(finite_size_tables={"test": TABLE})
    return finite_size_of(
        case, registry, SimpleNamespace(name=family), parameters or {"a": 1.0}, bounds
    )


@pytest.mark.parametrize(
    ("asked", "match"),
    [
        ({"family": "other"}, "no finite size table of cell 'other'.*there are tables of test"),
        ({"parameters": {"a": 2.0}}, "describes cells of equal edges with the parameters"),
        ({"edges": (6.0, 6.0, 7.0)}, "equal edges"),
        ({"bounds": (0.1, 0.4)}, r"covers relative densities 0\.2 to 0\.4.*0\.1 to 0\.4"),
        ({"bounds": (0.2, 0.5)}, r"0\.2 to 0\.5"),
    ],
)
def test_what_no_table_covers_is_refused(asked, match):
    assert resolved() is TABLE
    with pytest.raises(CaseError, match=match):
        resolved(**asked)


def test_places_of_the_faces_that_matter_are_told():
    assert spread_warnings(TABLE) == ()
    far = replace(ROWS[1], wall=(FiniteRatio(cells=1, value=0.7, error=0.0, spread=0.21),))
    (told,) = spread_warnings(replace(TABLE, rows=(ROWS[0], far)))
    assert "0.21 on either side" in told


def test_factors_run_linearly_and_end_at_their_densities():
    few = LocalFactor(density=np.array([0.2, 0.4]), factor=np.array([[0.5, 1.0], [0.9, 1.0]]))
    np.testing.assert_allclose(few.at(np.array([0.3, 0.3])), [0.7, 1.0])
    np.testing.assert_allclose(few.slope(np.array([0.3, 0.3])), [2.0, 0.0])
    for rho in (0.19, 0.41, np.nan):
        with pytest.raises(DensityError, match="finite-size factors"):
            few.at(np.array([0.3, rho]))
    with pytest.raises(ValueError, match="increase"):
        LocalFactor(density=np.array([0.2, 0.2]), factor=np.ones((2, 2)))
    with pytest.raises(ValueError, match="positive"):
        LocalFactor(density=np.array([0.2, 0.4]), factor=np.zeros((2, 2)))


LAW = power_law(
    "test-law", ("test",), c1=0.6, n1=1.4, c3=0.4, n3=1.3, window=(0.05, 0.9),
    kind="fe", source="this test", test="none",
)  # fmt: skip
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6, yield_strength=10.0,
)  # fmt: skip


def beam():
    mesh = box_part_mesh((20.0, 6.0, 5.0), 3.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 20 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.01, 0.0, -0.02])),
        acceleration=np.zeros(3),
    )
    return homogenised_model(space, np.zeros(space.element_count), MATERIAL, LAW, [case])


def test_a_beam_of_few_cells_bends_as_one_of_a_softer_law():
    """One factor everywhere divides every displacement by it: elasticity is linear."""
    model = beam()
    rho = np.random.default_rng(72).uniform(0.25, 0.35, model.volumes.size)
    few = LocalFactor(density=np.array([0.2, 0.4]), factor=np.full((2, rho.size), 0.8))
    whole = solve_homogenised(model, rho)[0].displacement
    softer = solve_homogenised(replace(model, few_cells=few), rho)[0].displacement
    np.testing.assert_allclose(softer, whole / 0.8, rtol=1e-4, atol=1e-6 * np.abs(whole).max())


def test_the_stiffness_follows_the_factor_with_density():
    rng = np.random.default_rng(73)
    model = beam()
    count = model.volumes.size
    few = LocalFactor(density=np.array([0.2, 0.4]), factor=rng.uniform(0.6, 1.0, (2, count)))
    corrected = replace(
        model, few_cells=few, stiffness_factor=0.9, stiffness_exponent=0.5, reference_density=0.3
    )
    rho = rng.uniform(0.25, 0.35, count)
    np.testing.assert_allclose(
        lattice_stiffness(corrected, rho),
        lattice_stiffness(replace(corrected, few_cells=None), rho) * few.at(rho),
        rtol=1e-12,
    )
    step = 1e-6
    change = lattice_stiffness(corrected, rho + step) - lattice_stiffness(corrected, rho - step)
    found = lattice_stiffness_derivative(corrected, rho)
    np.testing.assert_allclose(found, change / (2 * step), rtol=1e-6, atol=1e-4)

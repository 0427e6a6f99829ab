"""A plate one cell thick on the homogenised part against a beam with the wall's own stiffness."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.maps.cell_map import turned_axes, uniform_map
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.homogenise.wall_ratios import WallRatios, wall_ratios
from gradedesign.mechanics.limits.displacement import DisplacementLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.sizing import wall_cells
from gradedesign.mechanics.sizing.homogenised import (
    homogenised_system,
    lattice_mass,
    solve_homogenised,
)
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.lattice_stiffness import (
    lattice_stiffness,
    lattice_stiffness_derivative,
)
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.state import solved_state
from gradedesign.mechanics.sizing.wall_cells import wall_factors, wall_material
from gradedesign.mechanics.sizing.wall_kinds import wall_faces, wall_kinds
from gradedesign.program.host.registry import build_registry

CELL = 22.0
#: Faces 1 mm outside the axes of the struts; longer and wider than what counts as a wall.
SIZE = (8 * CELL, 7 * CELL, CELL + 2.0)
RHO = 0.3


@pytest.fixture(scope="module")
def registry():
    return build_registry()


def plate(registry, passive=(), on_wall=str, unknown=False, **lattice):
    """Model of a cantilever of simple cubic cells, with its walls."""
    mesh = box_part_mesh(SIZE, 11.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > SIZE[0] - 1e-9).all(axis=1)]
    area = SIZE[1] * SIZE[2]
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.0, 0.0, 1.0 / area])),
        acceleration=np.zeros(3),
    )
    model = homogenised_model(
        space,
        np.zeros(space.element_count),
        registry.materials["Ti-6Al-4V"],
        registry.scaling_laws["sc-computed"],
        [case],
    )
    surface = box_surface(SIZE)
    stated = {"edges": CELL, "rotation": (0.0,) * 3, "origin": (1.0, 1.0, 1.0), **lattice}
    cell_map = uniform_map(stated["edges"], stated["origin"], turned_axes(stated["rotation"]))
    domain = DesignDomain(
        distance=surface_distance(surface), lower=np.zeros(3), upper=SIZE, components=passive
    )
    every = np.ones(space.element_count, dtype=bool)
    walls, warnings = wall_factors(
        cell_map, mesh, every,
        wall_faces(cell_map, SimpleNamespace(surface=surface), domain, mesh, every),
        wall_material(calibrate(registry.cell_families["sc"]), (0.29, 0.31), 0.3),
        on_wall,
    )  # fmt: skip
    assert bool(warnings) == unknown, warnings
    return replace(model, walls=walls)


@pytest.fixture(scope="module")
def model(registry):
    return plate(registry)


def tip(model):
    u = solve_homogenised(model, np.full(model.volumes.size, RHO))[0].displacement
    end = np.flatnonzero(model.space.nodes[0] > SIZE[0] - 1e-6)
    return float(u[2, end].mean())


def test_the_plate_is_one_wall_across_z(model):
    assert len(model.walls.classes) == 1
    assert (model.walls.kind[:2] == -1).all()
    assert (model.walls.kind[2] == 0).all()
    assert np.abs(model.walls.height[2]).max() > 0.9


def test_walls_are_told_of_when_they_are_computed(registry, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    computed, told = [], []

    def ratios(*args, **kwargs):
        computed.append(kwargs["axis"])
        one = np.ones(3)
        return WallRatios(solid=1.0, membrane=one, bending=one, shear=one[:2])

    monkeypatch.setattr(wall_cells, "wall_ratios", ratios)
    for _ in range(2):
        plate(registry, on_wall=told.append)
    # The second time all comes from the cache. A cubic cell needs one axis only.
    assert told == ["wall 1 of 1, 1.09 cells across z"]
    assert computed == [0] * wall_cells.DENSITIES


def test_faces_of_a_kind_are_those_of_its_plane_walls():
    # Most of the volume between plane faces, the rest between sloped ones, as meshes have it.
    rng = np.random.default_rng(5)
    upper = np.append(np.full(60, 2.25), 2.25 + rng.uniform(-0.04, 0.04, 40))
    faces = np.zeros((2, 3, 100))
    faces[1, 1] = upper
    found = np.zeros((3, 100), dtype=bool)
    found[1] = True
    (one,), kind = wall_kinds(faces, found, np.ones(100), SimpleNamespace(period=1))
    assert (one.axis, one.lower, one.upper) == (1, 0.0, 2.25)
    assert (kind[1] == 0).all()


def test_sloped_faces_make_no_more_kinds_than_are_worth_the_wait():
    # Walls of every thickness from 1.2 to 2.1 cells that begin at two places of the cell.
    rng = np.random.default_rng(7)
    faces, found = np.zeros((2, 3, 2000)), np.zeros((3, 2000), dtype=bool)
    faces[0, 1] = rng.choice([0.0, 0.167], 2000)
    faces[1, 1] = faces[0, 1] + rng.uniform(1.2, 2.1, 2000)
    found[1] = True
    cells = SimpleNamespace(resolution=36, cell=SimpleNamespace(family=SimpleNamespace(period=1)))
    fine, _ = wall_kinds(faces, found, np.ones(2000), cells.cell.family)
    assert 36**3 * sum(w.upper - w.lower for w in fine) > wall_cells.MOST_TOGETHER
    kinds, kind = wall_cells.affordable_kinds(faces, found, np.ones(2000), cells)
    assert 36**3 * sum(w.upper - w.lower for w in kinds) <= wall_cells.MOST_TOGETHER
    mine = np.array([[w.lower, w.upper] for w in kinds])[kind[1]]
    # Within the 0.2 cells that this takes, and those at the ends nearest to another kind.
    assert np.quantile(np.abs(mine - faces[:, 1].T).max(axis=1), 0.95) <= 0.2


def test_a_plate_of_one_cell_bends_by_its_faces(registry, model):
    ratios = wall_ratios(
        calibrate(registry.cell_families['sc']), RHO,
        axis=2, lower=-1 / CELL, upper=1 + 1 / CELL, resolution=24,
    )  # fmt: skip
    E = model.material.youngs_modulus
    C = E * model.law.stiffness(np.array([RHO]))[:, :, 0]
    length, width, height = SIZE
    # Bent along x between free sides: Young's modulus of the cell, of which the wall has a share.
    bending = ratios.bending[0] * height**3 / 12 / np.linalg.inv(C)[0, 0]
    shear = ratios.shear[0] * 5 / 6 * C[4, 4] * height
    expected = length**3 / (3 * bending * width) + length / (shear * width)
    # Measured 0.35 % below, 0.29 % on a mesh half as wide: the clamp keeps its end from drawing in.
    # By hand: over about half the height, 12 of 176 mm, so 20 % of the bending, it is stiffer by
    # 1 / (1 - nu^2), 1.2 % with nu = 0.11; 0.25 % in all.
    assert tip(model) == pytest.approx(expected, rel=0.005)
    # Without its walls the same plate moves twice as far (2.03).
    assert tip(replace(model, walls=None)) > 1.9 * expected


def test_mass_counts_what_the_faces_leave(registry, model):
    ratios = wall_ratios(
        calibrate(registry.cell_families['sc']), RHO,
        axis=2, lower=-1 / CELL, upper=1 + 1 / CELL, resolution=24,
    )  # fmt: skip
    rho = np.full(model.volumes.size, RHO)
    plain = lattice_mass(replace(model, walls=None), rho)
    # Linear between densities 0.29 and 0.31.
    assert lattice_mass(model, rho) / plain == pytest.approx(ratios.solid, rel=1e-3)


def test_the_stiffness_follows_the_walls_with_density(model):
    rng = np.random.default_rng(9)
    grown = replace(model, stiffness_factor=0.9, stiffness_exponent=0.5, reference_density=0.3)
    rho = rng.uniform(0.2901, 0.3099, model.volumes.size)
    inner = np.abs(rho[:, None] - model.walls.density).min(axis=1) > 1e-5
    step = 1e-6
    change = (lattice_stiffness(grown, rho + step) - lattice_stiffness(grown, rho - step)) / 2
    found = lattice_stiffness_derivative(grown, rho)
    scale = np.abs(found).max()
    assert inner.mean() > 0.9
    np.testing.assert_allclose(
        found[..., inner], change[..., inner] / step, rtol=1e-5, atol=1e-6 * scale
    )


def test_gradients_of_a_displacement_are_exact(model):
    rng = np.random.default_rng(10)
    # Between two densities of the walls: at these, slopes jump.
    low, high = model.walls.density[1:3]
    step = 0.4 * (high - low)
    middle = 0.5 * (low + high)
    rho = rng.uniform(
        middle - 0.09 * (high - low), middle + 0.09 * (high - low), model.volumes.size
    )
    nodes = np.flatnonzero(model.space.nodes[0] > SIZE[0] - 1e-6)
    key = LimitKey(kind="displacement", region="tip", load_case="load")
    limit = DisplacementLimit(key=key, name="tip", nodes=nodes, component=2, allowed=1.0)

    def value(at):
        return limit.predict(solved_state(model, at, [limit])).value

    system = homogenised_system(model, rho)
    state = solved_state(model, rho, [limit], system)
    responses = limit.responses(state)
    adjoints = solve_adjoints(model, system, responses)
    gradient = response_gradients(state, responses, adjoints)[0]
    # Both ways move the tip by a thousand times what the solver leaves.
    along = model.space.nodes[0][model.space.elements[:4]].mean(axis=0) / SIZE[0]
    for way in (np.ones(rho.size), 1 - along):
        slope = (value(rho + step * way) - value(rho - step * way)) / (2 * step)
        assert gradient @ way == pytest.approx(slope, rel=2e-3)


def test_cells_turned_against_the_faces_have_no_walls(registry):
    assert not plate(registry, rotation=(0.0, 45.0, 0.0)).walls.classes


def test_a_kept_face_is_no_wall(registry):
    def layer(points):
        return points[2]

    passive = (PassiveRegion(to_place=layer, margin=1.0),)
    assert not plate(registry, passive).walls.classes


@pytest.mark.slow
def test_a_wall_that_falls_apart_counts_as_periodic(registry):
    # Beginning between the struts, 24 mm hold one layer of struts and the ends of others.
    model = plate(registry, unknown=True, edges=80.0, origin=(0.0, 0.0, -30.0))
    assert (model.walls.kind[2] == -1).all()
    # Across x and y, 2.2 and 1.9 cells hang together.
    assert len(model.walls.classes) == 2
    assert (model.walls.kind[:2] >= 0).all()


@pytest.mark.parametrize(
    ("count", "named"),
    [
        (1, "walls of w0 count as periodic"),
        (3, "walls of w0; w1; w2 count as periodic"),
        (4, "walls of w0; w1; w2 and another kind count as periodic"),
        (46, "walls of w0; w1; w2 and 43 other kinds count as periodic"),
    ],
)
def test_a_warning_names_some_walls_and_counts_the_others(count, named):
    (told,) = wall_cells.unknown_walls([f"w{k}" for k in range(count)], ["large"] * count)
    assert told.startswith(named)
    assert told.endswith(f"large (the first of {count})" if count > 1 else "large")


def test_a_wall_of_too_many_voxels_counts_as_periodic(registry, monkeypatch):
    monkeypatch.setattr(wall_cells, "MOST_VOXELS", 1e4)
    assert not plate(registry, unknown=True).walls.classes

"""Skins much thinner than the tetrahedra that hold them, in the homogenised part."""

import numpy as np
import pytest

from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.assembly import strain_energy_per_element
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.homogenised import solve_homogenised
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.lattice_stiffness import (
    as_stiffness,
    effective_stiffness,
    lattice_stiffness,
)
from gradedesign.mechanics.sizing.solid_moments import solid_fraction, solid_moments

LENGTH, WIDTH, HEIGHT, SKIN = 32.0, 6.0, 8.0, 1.0
RHO = 0.15
LAW = power_law(
    "test-law",
    ("test",),
    youngs=(0.6, 1.4),
    strength=(0.4, 1.3),
    window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)


def material(nu):
    return Material(
        name="test", youngs_modulus=1000.0, poissons_ratio=nu, density=1e-6,
        yield_strength=10.0, thermal_expansion=2e-5,
    )  # fmt: skip


def faces_at(space, axis, where):
    facets, _ = boundary_facets(space.mesh)
    at = space.mesh.points[axis][facets]
    return facets[(np.abs(at - where) < 1e-9).all(axis=1)]


def sandwich(size, *, nu=0.3, supports=None, temperature=0.0):
    """A bar with a skin of 1 mm below and above, clamped at one end without ``supports``."""
    space = tet_space(box_part_mesh((LENGTH, WIDTH, HEIGHT), size), 2)
    skin = Skin(thickness=SKIN, faces=lambda x: np.minimum(x[2], HEIGHT - x[2]))
    upper = (LENGTH, WIDTH, HEIGHT)
    domain = DesignDomain(
        distance=lambda x: -x[2], lower=(0, 0, 0), upper=upper, components=(skin,)
    )
    moments = solid_moments(domain, space.mesh)
    root = [(faces_at(space, 0, 0.0), (0.0, 0.0, 0.0))]
    force = np.zeros_like(space.nodes)
    end = np.flatnonzero(space.nodes[0] > LENGTH - 1e-9)
    force[2, end] = 1.0 / end.size
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, supports(space) if supports else root),
        force=force if not temperature else np.zeros_like(force),
        acceleration=(0.0, 0.0, 0.0),
        temperature_change=temperature,
    )
    return homogenised_model(
        space, solid_fraction(moments), material(nu), LAW, [case], solid_moments=moments
    )


@pytest.mark.parametrize("size", [2.0, 8.0])
def test_the_energy_of_bending_is_that_of_a_sandwich(size):
    """Strains ``kappa z`` along the bar, by quadratic displacements without Poisson's ratio.

    ``kappa^2 L (E_s I_s + E_l I_l)`` on tetrahedra of any size. With the skin spread evenly over
    its tetrahedra it would be 0.89 of that on 2 mm and 0.54 on 8 mm.
    """
    model = sandwich(size, nu=0.0)
    x, z = model.space.nodes[0], model.space.nodes[2] - HEIGHT / 2
    bent = 1e-3 * np.stack([x * z, 0 * x, -(x**2) / 2])
    rho = np.full(model.volumes.size, RHO)
    stiffness = as_stiffness(effective_stiffness(model, rho))
    energy = strain_energy_per_element(model.space, stiffness, bent, bent).sum()
    second = WIDTH * HEIGHT**3 / 12
    core = WIDTH * (HEIGHT - 2 * SKIN) ** 3 / 12
    lattice = lattice_stiffness(model, rho)[0, 0, 0]
    exact = 1e-6 * LENGTH * (1000.0 * (second - core) + lattice * core)
    assert energy == pytest.approx(exact, rel=1e-9)


def test_solid_and_lattice_fill_the_part_together():
    """The mean of both is that of their shares of the volume."""
    model = sandwich(8.0)
    rho = np.full(model.volumes.size, RHO)
    stiff = effective_stiffness(model, rho)
    lattice = effective_stiffness(sandwich_without_skin(model), rho)
    solid = model.material.youngs_modulus
    assert stiff.shape[2] == 10
    # C11 of both by their volumes: 1 - nu over (1 + nu)(1 - 2 nu) times E.
    factor = 0.7 / (1.3 * 0.4)
    mean = stiff[0, 0].sum(axis=0) + stiff[0, 0, [1, 2, 3, 5, 6, 8]].sum(axis=0)
    share = model.solid_fraction
    expected = factor * solid * share + (1 - share) * lattice[0, 0]
    np.testing.assert_allclose(mean, expected, rtol=1e-12)


def sandwich_without_skin(model):
    return homogenised_model(model.space, 0 * model.volumes, model.material, LAW, model.cases)


def test_an_even_temperature_change_strains_nothing():
    """Free expansion is linear in all places, whatever lies where: alpha dT x."""

    def planes(space):
        free = [0.0 if i == j else None for i in range(3) for j in range(3)]
        return [(faces_at(space, a, 0.0), tuple(free[3 * a : 3 * a + 3])) for a in range(3)]

    model = sandwich(4.0, supports=planes, temperature=50.0)
    u = solve_homogenised(model, np.full(model.volumes.size, RHO))[0].displacement
    np.testing.assert_allclose(u, 2e-5 * 50.0 * model.space.nodes, atol=1e-6 * 0.032)

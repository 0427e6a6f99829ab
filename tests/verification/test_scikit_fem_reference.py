"""The analyses of a case by scikit-fem alone and by the default solver: the same digits."""

from dataclasses import replace

import numpy as np
import pytest

from gradedesign import CellFamily, LawOrigin, ResourceError, load_case, power_law
from gradedesign.design.resolve import solid_part
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.solid import solve_solid
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern
from gradedesign.mechanics.fe.collapsed_rule import collapsed_rule
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.scikit_fem import MOST_UNKNOWNS, SCIKIT_FEM, assemble_scikit_fem
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness, MomentStiffness, pair_products
from gradedesign.mechanics.sizing.homogenised import solve_homogenised
from gradedesign.program.host.registry import build_registry

#: 675 unknowns; weight and a temperature change beside the force, a support that moves.
CASE = """\
[case]
name = "reference"
[part]
box = ["24 mm", "12 mm", "12 mm"]
mesh_size = "6 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "50 N", "-400 N"]}]
acceleration = ["0 m/s^2", "0 m/s^2", "-98.1 m/s^2"]
[[load_case]]
name = "pull"
fix = [{region = "root"}, {region = "tip", displacement = ["0.02 mm", "free", "free"]}]
temperature_change = "15 K"
[limits]
safety_factor = 2
[lattice]
cell = "walls"
"""
STRAIGHT = 'size = "6 mm"\n'
ROTATED = STRAIGHT + 'rotation = ["20 deg", "-35 deg", "50 deg"]\n'
CYLINDRICAL = (
    STRAIGHT
    + '[lattice.cell_map]\nkind = "cylindrical"\naxis = "+y"\n'
    + 'centre = ["12 mm", "0 mm", "-30 mm"]\ninner_radius = "30 mm"\naround = 38\n'
)


@pytest.fixture(scope="module")
def registry():
    known = build_registry(plugins=[])
    walls = CellFamily(
        name="walls",
        shape=lambda u: np.abs(u - np.round(u)).min(axis=0),
        distance=True,
        open_void=False,
    )
    # Shear apart from stretching: as anisotropic as a cubic cell, so that rotations count.
    law = power_law(
        "walls-law",
        ("walls",),
        youngs=(0.6, 1.4),
        strength=(1.0, 1.5),
        shear=(0.1, 2.0),
        window=(0.1, 0.9),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )
    return replace(known, cell_families={"walls": walls}, scaling_laws={"walls-law": law})


def solved(folder, registry, cells, solver, spoiled=1.0):
    """Displacements and compliances of the solid and the homogenised part of the case."""
    (folder / "case.toml").write_text(f'{CASE}{cells}[run]\nsolver = "{solver}"\n')
    setup = prepare(load_case(folder), registry)
    assert setup.homogenised.space.dof_count == 675
    own = setup.homogenised.solver
    if spoiled != 1.0:
        wrong = replace(own, assemble=lambda *given: spoiled * own.assemble(*given))
        setup = replace(setup, homogenised=replace(setup.homogenised, solver=wrong))
    rho = np.linspace(0.2, 0.6, setup.homogenised.space.element_count)
    return (*solve_solid(setup.homogenised), *solve_homogenised(setup.homogenised, rho))


def require_same(theirs, ours):
    """Displacements, energies (half the compliance) and reactions to 1e-9 of the largest."""
    for one, other in zip(theirs, ours, strict=True):
        assert one.method == "scikit-fem"
        assert other.method in ("superlu", "pardiso", "multigrid")
        for name in ("displacement", "reaction"):
            a, b = getattr(one, name), getattr(other, name)
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-9 * np.abs(b).max())
        assert one.energy == pytest.approx(other.energy, rel=1e-9)


@pytest.mark.parametrize("cells", [STRAIGHT, ROTATED, CYLINDRICAL])
def test_solid_and_homogenised_part_have_the_same_digits(tmp_path, registry, cells):
    theirs = solved(tmp_path, registry, cells, "scikit-fem")
    require_same(theirs, solved(tmp_path, registry, cells, "multigrid"))


def test_one_percent_less_stiffness_is_seen(tmp_path, registry, monkeypatch):
    ours = solved(tmp_path, registry, ROTATED, "direct")
    monkeypatch.setattr(
        solid_part, "assemble_scikit_fem", lambda *given: 0.99 * assemble_scikit_fem(*given)
    )
    softer = solved(tmp_path, registry, ROTATED, "scikit-fem", spoiled=0.99)
    for one, other in zip(softer, ours, strict=True):
        with pytest.raises(AssertionError):
            require_same([one], [other])


@pytest.mark.parametrize("order", [1, 2])
def test_an_isotropic_stiffness_is_assembled_alike(order):
    """Six forms of scalar fields, against our own kernels."""
    space = tet_space(box_part_mesh((3.0, 2.0, 2.0), 1.0), order)
    modulus = np.random.default_rng(31).uniform(1.0, 3.0, space.element_count)
    stiffness = IsotropicStiffness(E=modulus, nu=0.31)
    ours = assemble(assembly_pattern(space), stiffness)
    theirs = assemble_scikit_fem(space, stiffness)
    assert abs(theirs - ours).max() <= 1e-12 * abs(ours).max()


def test_a_stiffness_that_varies_over_a_wall_is_assembled_alike():
    """Moments of a linear field of stiffness, integrated by a rule of degree 5."""
    space = tet_space(box_part_mesh((3.0, 2.0, 2.0), 1.0), 2)
    points, weights = collapsed_rule(3)
    a = np.random.default_rng(29).standard_normal((space.element_count, 4, 6, 6))
    at_vertices = np.einsum("mvij,mvkj->ikvm", a, a)
    at_points = np.einsum("qv,ijvm->ijqm", points, at_vertices)
    products = pair_products(points, weights)
    stiffness = MomentStiffness(C=np.einsum("pq,ijqm->ijpm", products, at_points))
    ours = assemble(assembly_pattern(space), stiffness).toarray()
    theirs = assemble_scikit_fem(space, stiffness).toarray()
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-12 * np.abs(ours).max())


def test_more_unknowns_than_it_takes_are_refused_before_assembly():
    space = tet_space(box_part_mesh((22.0, 11.0, 11.0), 1.0), 2)
    assert space.dof_count > MOST_UNKNOWNS
    steel = IsotropicStiffness(E=np.full(space.element_count, 2.1e5), nu=0.3)
    with pytest.raises(ResourceError, match=r"'scikit-fem' takes at most \d+ unknowns, .* has 71"):
        prepare_elastic(space, steel, solver=SCIKIT_FEM)

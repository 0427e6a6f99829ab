"""Analyses and meshers of the acceptance are chosen by name; tetrahedra fulfil the protocol."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.design.resolve.plan import resolve_case
from gradedesign.design.resolve.tools import explicit_analysis
from gradedesign.errors import CaseError, PluginError
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.explicit.analysis import Discretisation, ExplicitAnalysis, PlannedSolid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.explicit.tet_fields import TetFields
from gradedesign.mechanics.fe.solution import Balance
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stress import von_mises
from gradedesign.mechanics.material.material import Material
from gradedesign.program.host.registry import build_registry

CASE = (
    held_bar(box_part(30, 10, 10, 5), name="block")
    + """\
[limits]
stress = "20 MPa"
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = [0.2, 0.5]
[run]
"""
)


def load(tmp_path, words):
    path = tmp_path / "case.toml"
    path.write_text(CASE + words, encoding="utf-8")
    return gradedesign.load_case(path)


def test_a_case_names_its_analysis(tmp_path):
    registry = build_registry()
    assert explicit_analysis(load(tmp_path, ""), registry).name == "finite-cells"
    named = load(tmp_path, 'analysis = "finite-cells"\n')
    assert explicit_analysis(named, registry).name == "finite-cells"
    with pytest.raises(
        CaseError, match=r"case\.toml:23: run\.analysis: no explicit analysis named"
    ):
        explicit_analysis(load(tmp_path, 'analysis = "finite-cell"\n'), registry)
    with pytest.raises(CaseError, match=r'run\.mesher: .*did you mean "pytetwild"'):
        resolve_case(load(tmp_path, 'mesher = "pytetwil"\n'), registry)


def test_what_an_analysis_of_a_plugin_raises_names_it(tmp_path):
    def solve(solid, resolution, say):
        raise ZeroDivisionError

    def hook():
        yield ExplicitAnalysis(
            name="acme", solve=solve, estimate=FINITE_CELLS.estimate,
            fitted_spacing=FINITE_CELLS.fitted_spacing, elements_per_wall=lambda _: 1.0,
            elements_per_layer=1.0,
        )  # fmt: skip

    plugin = SimpleNamespace(gradedesign_analyses=gradedesign.hookimpl(hook), __name__="acme")
    registry = build_registry(plugins=[plugin])
    analysis = explicit_analysis(load(tmp_path, 'analysis = "acme"\n'), registry)
    with pytest.raises(PluginError, match="analysis 'acme' of module acme"):
        analysis.solve(None, None, print)


def test_the_spacing_that_will_be_taken_fits_memory_and_box():
    planned = PlannedSolid(
        box=(60.0, 40.0, 40.0), volume=2e4, projections=0.0, curvature=0.0, load_cases=1
    )
    assert FINITE_CELLS.fitted_spacing(planned, 1.0, 1e12) == pytest.approx(1.0)
    need = FINITE_CELLS.estimate(planned, 1.0).memory_bytes
    coarser = FINITE_CELLS.fitted_spacing(planned, 1.0, 0.8 * need)
    # 0.4 mm below at most: what the memory holds, rounded down to a division of 40 mm.
    assert 1.0 < coarser <= FINITE_CELLS.coarsest
    assert FINITE_CELLS.estimate(planned, 1.02 * coarser).memory_bytes <= 0.8 * need


@pytest.fixture
def block():
    """Tetrahedra of a block that is pulled by 1e-3 along x and warmed by 1e-4 of free strain."""
    space = tet_space(box_part_mesh((6.0, 4.0, 4.0), 2.0), 2)
    strain = 1e-3 * np.array([1.0, -0.3, -0.3]) + 1e-4
    u = strain[:, None] * space.nodes
    nothing = Balance(force=0.0, moment=0.0, energy=0.0)
    solution = SimpleNamespace(name="pull", displacement=u, balance=nothing)
    material = Material(
        name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-9, yield_strength=1.0,
        thermal_expansion=0.0, source="by hand",
    )  # fmt: skip
    division = Discretisation(
        made_by="bricks", mesh_size=2.0, unknowns=space.dof_count, requested=2.0,
    )  # fmt: skip
    return TetFields(
        space=space, material=material, solutions={"pull": solution},
        thermal_strain={"pull": 1e-4}, facets={}, work={"pull": 0.0}, division=division,
    ), strain  # fmt: skip


def test_tetrahedra_tell_stress_and_displacement_without_their_mesh(block):
    solved, strain = block
    assert solved.volumes.sum() == pytest.approx(96.0)
    assert solved.von_mises("pull") == pytest.approx(1.0)  # E times strain, uniaxial
    lower, upper = np.array([1.0, 1.0, 1.0]), np.array([4.0, 3.0, 3.0])
    sample = solved.stress_within("pull", lower, upper)
    assert np.all((lower <= sample.points.T) & (upper >= sample.points.T))
    assert sample.volumes.sum() == pytest.approx(12.0, rel=0.3)
    assert von_mises(sample.stress) == pytest.approx(1.0)
    points = np.array([[1.0, 7.0], [2.0, 2.0], [3.0, 3.0]])
    u, distance = solved.displacement_at("pull", points)
    assert distance == pytest.approx([0.0, 1.0])
    np.testing.assert_allclose(u, strain[:, None] * np.minimum(points, 6.0), atol=1e-12)


def test_the_mean_displacement_of_a_region_is_the_integral_over_its_facets(block):
    solved, _ = block
    space = solved.space
    facets, _ = boundary_facets(space.mesh)
    face = facets[(space.mesh.points[0][facets] > 6.0 - 1e-9).all(axis=1)]
    # Quadratic elements hold y^2; over y from 0 to 4 its mean is 16 / 3.
    _, y, z = space.nodes
    solution = SimpleNamespace(displacement=np.stack([y**2, z, np.ones_like(y)]))
    bent = replace(solved, facets={"end": face}, solutions={"pull": solution})
    np.testing.assert_allclose(bent.mean_displacement("end", "pull"), [16 / 3, 2.0, 1.0])
    # Of lengths |(0, 0, y - 2)| over y from 0 to 4, linear on either side of the facets' edges: 1.
    turned = SimpleNamespace(displacement=np.stack([0 * y, 0 * y, y - 2.0]))
    swung = replace(bent, solutions={"pull": turned})
    assert swung.mean_displacement("end", "pull") == pytest.approx(0.0, abs=1e-12)
    assert swung.mean_length("end", "pull") == pytest.approx(1.0)


def test_pictures_and_files_get_the_surface_and_the_elements(block):
    solved, strain = block
    fields = solved.surface_fields("pull")
    # The free strain of warming is no stress.
    assert fields.von_mises == pytest.approx(1.0)
    np.testing.assert_allclose(
        fields.displacement, strain[:, None] * fields.surface.vertices.T, atol=1e-12
    )
    volume = solved.volume_fields({"phase [-]": np.zeros(len(solved.volumes))})
    assert volume.elements.shape == (10, len(solved.volumes))
    assert list(volume.point_data) == ["displacement pull [mm]"]
    assert list(volume.element_data) == ["phase [-]"]

"""Ribs: plates along planes through the part, from the case to its mass, and what is refused."""

import json

import numpy as np
import pytest
from composed_domains import design_domain
from small_parts import SHORT_BAR

import gradedesign
from gradedesign.design.check.check_case import check_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.component import KEPT, LATTICE
from gradedesign.geometry.lattice.components.rib import Rib
from gradedesign.geometry.lattice.domain import phase_at
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.sizing.solid_moments import solid_fraction, solid_moments
from gradedesign.program.commands.check_data import kept_solids
from gradedesign.program.host.registry import build_registry
from gradedesign.testing import check_component

#: A bar of 16 x 8 x 8 mm.
CASE = (
    SHORT_BAR[: SHORT_BAR.index("[[keep]]")]
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-200 N"]}]
[limits]
stress = "100 MPa"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
grading = "uniform"
density = [0.4, 0.4]
size_effects = false
[run]
stop_after = "sizing"
[output]
formats = []
"""
)
ACROSS = 'plane = "x = 5 mm"\nthickness = "1.2 mm"'
SLANTED = 'plane = {point = ["8 mm", "4 mm", "4 mm"], normal = [1, 0, 1]}\nthickness = "0.5 mm"'


def read(folder, *ribs, more=""):
    tables = "".join(f"[[lattice.rib]]\n{rib}\n" for rib in ribs)
    (folder / "case.toml").write_text(CASE.replace("[run]", f"{tables}[run]") + more)
    return gradedesign.load_case(folder, registry=build_registry())


def ribbed(folder, *ribs, more=""):
    case = read(folder, *ribs, more=more)
    return design_domain(case, part_of(case, {}))


def test_its_plate_is_solid_and_held(tmp_path):
    domain = ribbed(tmp_path, ACROSS)
    (rib,) = domain.of(Rib)
    points = np.array([[4.35, 4.45, 5.55, 5.65], [4.0] * 4, [4.0] * 4])
    assert phase_at(domain, points).tolist() == [LATTICE, KEPT, KEPT, LATTICE]
    assert [plane[:2] for plane in rib.planes] == [(0, pytest.approx(4.4)), (0, pytest.approx(5.6))]
    assert rib.least == 1.2
    assert (rib.box[0].tolist(), rib.box[1].tolist()) == ([4.4, 0, 0], [5.6, 8, 8])


@pytest.mark.parametrize(
    ("rib", "volume"),
    [
        (ACROSS, 8 * 8 * 1.2),
        # The plane x + z = 12 mm cuts the bar in 8 mm by 8 sqrt(2) mm.
        (SLANTED, 8 * 8 * np.sqrt(2) * 0.5),
    ],
)
def test_check_tells_its_name_thickness_and_volume(tmp_path, rib, volume):
    case = read(tmp_path, f'name = "web"\n{rib}')
    (solid,) = kept_solids(check_case(case, build_registry()))
    assert solid["name"] == "'web'"
    # 20,000 points fill the plate.
    assert solid["volume_mm3"] == pytest.approx(volume, rel=0.01)


def halved_box():
    """A box of 16 x 8 x 8 mm in 12 tetrahedra, each far larger than a rib is thick."""
    corners = np.array(np.meshgrid([0.0, 8, 16], [0, 8], [0, 8], indexing="ij")).reshape(3, -1)
    tets = []
    for first in (0, 1):
        cube = np.arange(12).reshape(3, 2, 2)[first : first + 2].reshape(8)
        for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1)):
            tets.append(cube[[0, a, b, 7]])
    tets = np.array(tets).T
    mesh = TetMesh(points=corners, tets=tets)
    turned = signed_volumes(mesh) < 0
    tets[:, turned] = tets[[0, 2, 1, 3]][:, turned]
    return TetMesh(points=corners, tets=tets)


@pytest.mark.parametrize("rib", [ACROSS, SLANTED])
def test_elements_hold_its_volume_however_thin_it_is(tmp_path, rib):
    """Exact to rounding: the difference of two half spaces, whose planes cut a tetrahedron."""
    domain, mesh = ribbed(tmp_path, rib), halved_box()
    share = solid_fraction(solid_moments(domain, mesh))
    exact = 8 * 8 * 1.2 if rib == ACROSS else 8 * 8 * np.sqrt(2) * 0.5
    assert signed_volumes(mesh) @ share == pytest.approx(exact, rel=1e-12)


def test_ribs_that_cross_count_once(tmp_path):
    """Of two in one element the second takes its share of what the first leaves."""
    mesh = halved_box()
    one, two, both = (
        solid_fraction(solid_moments(ribbed(tmp_path, *ribs), mesh))
        for ribs in ([ACROSS], [SLANTED], [ACROSS, SLANTED])
    )
    np.testing.assert_allclose(both, one + (1 - one) * two, atol=1e-12)


def test_a_run_counts_its_mass_and_states_it_in_the_result(tmp_path):
    case = read(tmp_path, ACROSS)
    result = gradedesign.run(case, build_registry(), folder=tmp_path / "out")
    solid = 8 * 8 * 1.2
    expected = (solid + 0.4 * (16 * 8 * 8 - solid)) * case_density(result)
    assert result.mass_g == pytest.approx(expected, rel=1e-6)
    (stated,) = json.loads((tmp_path / "out" / "result.json").read_text())["measures"]["ribs"]
    assert stated["name"] == "rib 1"
    assert (stated["point_mm"], stated["normal"], stated["thickness_mm"]) == (
        [5, 0, 0],
        [1, 0, 0],
        1.2,
    )


def case_density(result):
    """Mass of the solid material, g/mm^3, from the ratio that the result states."""
    return result.mass_g / result.relative_density / (16 * 8 * 8)


@pytest.mark.parametrize(
    ("rib", "more", "words"),
    [
        (
            ACROSS.replace("1.2", "0.3"),
            '[print]\nmin_wall = "0.5 mm"\n',
            r"case.toml:\d+: lattice.rib\[0\].thickness: found 0.3 mm, less than the 0.5 mm",
        ),
        (
            ACROSS.replace("x = 5", "x = 17"),
            "",
            r'lattice.rib\[0\].plane: the plane "x = 17 mm" does not pass through the part',
        ),
        (ACROSS.replace("x = 5 mm", "x = max"), "", r'"x = max" does not pass through'),
        (
            ACROSS.replace("x = 5", "x = 15.9"),
            '[print]\nmin_wall = "1 mm"\n',
            r"on average 0.7 mm of a rib of 1.2 mm .* expected a plane farther inside",
        ),
        (ACROSS.replace("thickness", "width"), "", r"lattice.rib\[0\].width: unknown key"),
        (ACROSS.replace("1.2 mm", "0 mm"), "", r"lattice.rib\[0\].thickness: .*above 0"),
        ('plane = "x = 8 mm"\nthickness = "17 mm"', "", "holds the whole part"),
    ],
)
def test_what_is_refused(tmp_path, rib, more, words):
    with pytest.raises(CaseError, match=words):
        check_case(read(tmp_path, rib, more=more), build_registry())


def test_one_that_lies_in_the_part_by_half_is_told(tmp_path):
    domain = ribbed(tmp_path, ACROSS.replace("x = 5", "x = 15.9"))
    (note,) = domain.notes
    assert "on average 0.7 mm of its thickness of 1.2 mm lie in the part" in note
    assert domain.solids[0].least == pytest.approx(0.7, rel=0.01)


@pytest.mark.parametrize("rib", [ACROSS, SLANTED])
def test_it_keeps_what_the_field_relies_on(tmp_path, rib):
    domain = ribbed(tmp_path, rib)
    check_component(domain.solids[0], domain.lower, domain.upper)

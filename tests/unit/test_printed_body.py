"""Measures of the printed file: topology, comparison with what was analysed, thickness, phases."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from gradedesign.design.acceptance import body_comparison
from gradedesign.design.acceptance.body import measure_body, void_warnings
from gradedesign.design.acceptance.body_comparison import comparison_warnings
from gradedesign.design.acceptance.printed_body import measure_printed, phase_volumes
from gradedesign.design.printing.wall_thickness import wall_thickness
from gradedesign.design.verdict.thin_members import thin_members
from gradedesign.errors import MeshError
from gradedesign.fields import periodic_distance_to_level_set
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice.components.members import Members
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.sizing.members import MemberField


def as_surface(*meshes):
    mesh = trimesh.util.concatenate(meshes)
    return SurfaceMesh(vertices=mesh.vertices, faces=mesh.faces)


def box(size=1.0, at=(0.0, 0.0, 0.0), *, void=False):
    mesh = trimesh.creation.box((size,) * 3)
    mesh.apply_translation(at)
    if void:
        mesh.invert()
    return mesh


@pytest.mark.parametrize(
    ("meshes", "counts"),
    [
        ([trimesh.creation.icosphere(2)], (1, 0, 0)),
        ([trimesh.creation.torus(2, 0.5)], (1, 0, 1)),
        ([box(3.0), box(1.0, void=True)], (1, 1, 0)),
        ([trimesh.creation.torus(2, 0.5), box(0.4, (9, 0, 0))], (2, 0, 1)),
    ],
)
def test_topology(meshes, counts):
    found = measure_body(as_surface(*meshes))
    assert (found.components, found.cavities, found.handles) == counts
    assert found.volume_mm3 == pytest.approx(sum(m.volume for m in meshes))


def test_bodies_that_touch_in_a_point_are_two_and_in_an_edge_have_no_genus():
    def merged(at):
        mesh = trimesh.util.concatenate([box(), box(at=at)])
        mesh.merge_vertices()
        return measure_body(as_surface(mesh))

    assert (merged((1, 1, 1)).components, merged((1, 1, 1)).handles) == (2, 0)
    assert (merged((1, 1, 0)).components, merged((1, 1, 0)).handles) == (2, None)


def test_a_lattice_has_the_handles_of_its_graph():
    # Struts along the edges of a cube of one cell: 12 edges, 8 nodes, so 12 - 8 + 1 = 5 loops.
    def frame(p):
        a = np.sort(np.abs(np.abs(p) - 2.0), axis=0)
        inside = np.abs(p).max(axis=0) - 2.4
        return np.maximum(a[1] - 0.4, inside)

    found = measure_body(extract_surface(frame, [-3] * 3, [3] * 3, 0.15))
    assert (found.components, found.cavities, found.handles) == (1, 0, 5)


def test_closed_voids_are_told_with_their_volume():
    # A shell about a void of 4 x 4 x 4 mm, and one of 0.3 mm, in a cube of 10 mm: 64 of 936 mm^3.
    outer, void, speck = (trimesh.creation.box((edge,) * 3) for edge in (10, 4, 0.3))
    void.invert()
    speck.apply_translation((4, 4, 4))
    speck.invert()
    hollow = measure_body(as_surface(outer, void, speck))
    assert (hollow.components, hollow.cavities) == (1, 2)
    assert hollow.cavities_mm3 == pytest.approx(64.027)
    (warning,) = void_warnings(hollow.cavities, hollow.cavities_mm3, hollow.volume_mm3)
    assert "2 closed voids of 64.027 mm^3, 7% of its own volume" in warning
    little = measure_body(as_surface(outer, speck))
    assert void_warnings(little.cavities, little.cavities_mm3, little.volume_mm3) == ()


def compare_bodies(analysed, printed, element, elements_mm3=None):
    """As for tetrahedra, whose surface encloses their volume, unless it is stated."""
    volume = measure_body(analysed).volume_mm3 if elements_mm3 is None else elements_mm3
    return body_comparison.compare_bodies(analysed, printed, element, volume)


def test_a_contour_that_lacks_walls_is_no_evidence():
    # Elements hold all of the 108 mm^3 that are printed; the contour lacks the stud of 8.
    plate, stud = trimesh.creation.box((10, 10, 1)), box(2.0, (3.0, 2.0, 3.0))
    found = compare_bodies(as_surface(plate), as_surface(plate, stud), 0.5, elements_mm3=108.0)
    assert found.volume_difference == pytest.approx(0.0, abs=1e-12)
    assert found.contour_loss == pytest.approx(-8 / 108)
    (warning,) = comparison_warnings(found)
    assert "walls are thinner than its grid" in warning
    assert "-7.4%" in warning


def test_equal_bodies_give_no_warning():
    one = as_surface(trimesh.creation.torus(2, 0.5))
    found = compare_bodies(one, one, element=0.1)
    assert found.distance_mm == pytest.approx(0.0, abs=1e-12)
    assert comparison_warnings(found) == ()


def test_a_missing_piece_is_a_warning_that_says_where():
    # a box of 2 mm above the plate: 8 of 100 + 8 mm^3, its top 2 mm off
    plate = trimesh.creation.box((10, 10, 1))
    stud = box(2.0, (3.0, 2.0, 3.0))
    for analysed, printed, farther, sign in (
        ((plate,), (plate, stud), "printed", 0.08),
        ((plate, stud), (plate,), "analysed", -8 / 108),
    ):
        found = compare_bodies(as_surface(*analysed), as_surface(*printed), element=0.5)
        assert found.volume_difference == pytest.approx(sign, rel=1e-9)
        assert (found.distance_mm, found.farther) == (pytest.approx(3.5), farther)
        assert found.at_mm[2] == pytest.approx(4.0)
        volume, topology, distance = comparison_warnings(found)
        assert "volume of the printed solid" in volume
        assert "components" in topology
        assert "3.5 mm" in distance
        assert "elements_per_wall" in distance


def test_a_hole_that_one_lacks_is_a_warning():
    # 314 mm^3 less a hole of 0.1 mm^3: neither volume nor distance tells
    solid = trimesh.creation.cylinder(10.0, 1.0, sections=64)
    pierced = trimesh.creation.annulus(0.2, 10.0, 1.0, sections=64)
    found = compare_bodies(as_surface(solid), as_surface(pierced), element=0.6)
    (warning,) = comparison_warnings(found)
    assert "0 handles against 1" in warning
    # It says for which values that matters: all, or none where the file itself was judged.
    assert "the values of the limits are those of the analysed solid" in warning
    (warning,) = comparison_warnings(found, {0.98, 1.0312})
    assert "no value of the verdict rests on the analysed solid" in warning
    assert "0.98 to 1.03 times the values of the explicit analysis" in warning


def test_thickness_of_plates_shells_and_struts():
    def percentiles(mesh):
        return wall_thickness(mesh, 20_000).percentiles_mm

    assert percentiles(box_surface((20.0, 10.0, 1.5)))["50"] == pytest.approx(1.5)
    assert percentiles(box_surface((20.0, 10.0, 1.5)))["0.1"] == pytest.approx(1.5)
    # rays through a faceted ball of 4 mm are at most a sagitta of 1e-3 mm shorter
    ball = percentiles(as_surface(trimesh.creation.icosphere(5, radius=2.0)))
    assert ball["0.1"] == pytest.approx(4.0, abs=2e-3)
    pipe = percentiles(as_surface(trimesh.creation.annulus(2.0, 2.5, 30.0, sections=256)))
    assert pipe["1"] == pytest.approx(0.5, abs=1e-3)
    bar = percentiles(as_surface(trimesh.creation.cylinder(0.5, 40.0, sections=128)))
    assert bar["50"] == pytest.approx(1.0, abs=1e-3)


def test_thickness_of_a_gyroid_wall():
    def surface(u):
        x, y, z = 2 * np.pi * u
        return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)

    distance = periodic_distance_to_level_set(surface)
    wall = extract_surface(lambda p: 8 * np.abs(distance(p / 8)) - 0.5, [0] * 3, [8] * 3, 0.2)
    found = wall_thickness(wall, 50_000).percentiles_mm
    # 1 mm everywhere, but for the rims where the box cuts the wall
    assert found["50"] == pytest.approx(1.0, abs=0.02)
    assert found["0.1"] < found["1"] < found["5"] < 1.0


def test_members_are_measured_on_their_own_and_told_where_they_are_thin():
    """A web of 2 mm, a member, beside a block of 10 mm that is kept."""
    block, web = trimesh.creation.box((10.0,) * 3), trimesh.creation.box((2.0, 40.0, 40.0))
    web.apply_translation((30.0, 0.0, 0.0))
    surface = as_surface(block, web)
    lower, upper = np.array([-5.0, -20.0, -20.0]), np.array([31.0, 20.0, 20.0])
    domain = DesignDomain(
        distance=surface_distance(surface), lower=lower, upper=upper,
        components=(
            PassiveRegion(to_place=lambda p: p[0], margin=5.0),
            Members(to_surface=lambda p: np.abs(p[0] - 30.0) - 1.0, thickness=5.0, count=1),
        ),
    )  # fmt: skip
    thickness = measure_printed(surface, surface, 1.0, domain, elements_mm3=4200.0).thickness
    assert thickness.percentiles_mm["5"] == pytest.approx(2.0)
    assert thickness.of_phase_mm["5"] == pytest.approx(2.0)
    inward = MemberField(np.zeros(1), radius=6.0, offset=-0.4)
    (words,) = thin_members(thickness, 5.0, inward)
    assert "5 % of their surface has less than 2 mm of solid behind it, of the least_mem" in words
    assert "moved 0.4 mm inward" in words
    assert "inward" not in thin_members(thickness, 5.0, replace(inward, offset=0.4))[0]
    assert thin_members(thickness, 3.9, inward) == []
    assert thin_members(thickness, 5.0, None) == []


def test_an_open_surface_has_no_thickness():
    mesh = box_surface((1.0, 1.0, 1.0))
    with pytest.raises(MeshError, match="find no way out"):
        wall_thickness(SurfaceMesh(vertices=mesh.vertices, faces=mesh.faces[2:]), 1000)


def test_phases_share_the_volume_of_the_file():
    surface = box_surface((24.0, 12.0, 12.0))
    domain = DesignDomain(
        distance=surface_distance(surface), lower=np.zeros(3), upper=np.array([24.0, 12.0, 12.0]),
        components=(
            Skin(thickness=1.0),
            PassiveRegion(to_place=lambda p: np.abs(p[0]), margin=3.0),
        ),
    )  # fmt: skip
    volumes = phase_volumes(surface, domain, 100_000)
    # kept 3 x 12 x 12; within the skin 20 x 10 x 10 are left; by boxes
    assert volumes == {
        "lattice": pytest.approx(2000.0, rel=4e-3),
        "skin": pytest.approx(3456 - 432 - 2000, rel=8e-3),
        "passive solid": pytest.approx(432.0, rel=8e-3),
    }
    assert sum(volumes.values()) == pytest.approx(3456.0, rel=1e-12)
    plain = DesignDomain(distance=domain.distance, lower=domain.lower, upper=domain.upper)
    assert phase_volumes(surface, plain) == {"lattice": pytest.approx(3456.0)}
    printed = measure_printed(surface, surface, 0.5, plain, elements_mm3=3456.0)
    assert printed.comparison.volume_difference == pytest.approx(0.0, abs=1e-12)
    # 4.43e-9 t/mm^3 is 4.43e-3 g/mm^3
    assert printed.mass_g(4.43e-9) == pytest.approx(3456 * 4.43e-3)
    assert printed.mass_g(4.43e-9, "skin") == 0.0

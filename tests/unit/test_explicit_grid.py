"""The explicit grid: what a cell needs, refined where it loses solid, within the memory."""

from dataclasses import replace

import numpy as np
import pytest

from gradedesign.cell.calibration import calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.lattice.domain import DesignDomain
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.lattice.skin import Skin
from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import boundary_facets, signed_volumes
from gradedesign.plugin.registry import build_registry, lookup
from gradedesign.verify import explicit_mesh
from gradedesign.verify.explicit_mesh import (
    CoarseGridError,
    fitting_spacing,
    mesh_lattice,
    predict_unknowns,
)
from gradedesign.verify.grid_resolution import CELL_TOLERANCE, LAYER_ELEMENTS, elements_per_wall
from gradedesign.verify.mesh_within_budget import mesh_within_budget

EDGE = 12.0


def round_struts(u):
    """Distance to struts along x, y and z through the middle of the cell."""
    away = np.abs(u - np.floor(u) - 0.5)
    x, y, z = away
    return np.minimum(np.minimum(np.hypot(x, y), np.hypot(y, z)), np.hypot(z, x))


def plates(u):
    """Distance to plane walls across x."""
    return np.abs(u[0] - np.floor(u[0]) - 0.5)


def balls(u):
    """Distance to the middle of the cell: nothing connects."""
    return np.sqrt(((u - np.floor(u) - 0.5) ** 2).sum(axis=0))


STRUTS = CellFamily(name="round-struts", shape=round_struts, distance=True)


def box(points):
    inside = np.maximum(-points, points - EDGE).max(axis=0)
    outside = np.linalg.norm(np.maximum(np.maximum(-points, points - EDGE), 0.0), axis=0)
    return np.where(inside > 0, outside, inside)


def design_of(shape, level):
    return LatticeDesign(
        domain=DesignDomain(distance=box, lower=np.zeros(3), upper=np.full(3, EDGE)),
        shape=shape, level_of=lambda rho: np.full(np.shape(rho), level),
        cell_map=lambda p: p / 6.0, cell_size=6.0, density=0.3,
    )  # fmt: skip


def test_plane_walls_need_the_least_and_struts_more():
    walls = lookup(build_registry(), "cell_families", "primitive-sheet")
    assert elements_per_wall(calibrate(walls), 0.2) == LAYER_ELEMENTS
    assert elements_per_wall(calibrate(STRUTS), 0.1) >= 1.75 > LAYER_ELEMENTS


def test_thick_struts_are_no_walls():
    # At 0.47 the octet's joints make up for what its struts lose on 1.25 elements.
    octet = calibrate(lookup(build_registry(), "cell_families", "octet"))
    assert elements_per_wall(octet, 0.47) >= 2.0


def test_what_a_strut_needs_holds_its_volume():
    """A straight round strut on the grid that was found, against pi r^2 l."""
    calibration = calibrate(STRUTS)
    radius = float(calibration.level_of(0.1))
    cubes = elements_per_wall(calibration, 0.1)
    h = 2 * radius / cubes
    count = int(np.ceil(1.0 / h)) + 8
    length = (count - 4) * h

    def strut(points):
        x, y, z = points
        return np.maximum(np.hypot(x - 0.503, y - 0.489) - radius, np.abs(z - 0.5) - length / 2)

    lower = np.array([0.5, 0.5, 0.5]) - 0.5 * count * h
    volume = signed_volumes(stuff(strut, lower, (count,) * 3, h)).sum()
    # Joints keep more than straight lengths, so these may miss the tolerance by some of it.
    assert volume == pytest.approx(np.pi * radius**2 * length, rel=2 * CELL_TOLERANCE)


def test_a_grid_that_loses_solid_is_refined_and_says_so():
    design = design_of(round_struts, 0.12)
    with pytest.raises(CoarseGridError):
        mesh_lattice(design, 0.9, memory_limit_bytes=1e12)
    heard = []
    made = mesh_within_budget(
        design, 0.9, coarsest=1.1, memory_limit_bytes=1e12, on_refusal=heard.append
    )
    assert made.spacing < 0.9
    assert made.report.volume == pytest.approx(
        explicit_mesh.field_volume(design, made.spacing), rel=0.04
    )
    assert tuple(heard) == made.refused
    assert "refined to" in heard[0]
    assert "unknowns" in heard[0]


def test_a_grid_finer_than_the_memory_is_refused_by_name():
    design = design_of(round_struts, 0.12)
    volume = explicit_mesh.field_volume(design, 0.9)
    room = explicit_mesh.predict_memory_bytes(predict_unknowns(volume, 0.8), 2)
    with pytest.raises(ResourceError, match=r"\[run\] memory is .* GB: allow more memory"):
        mesh_within_budget(design, 0.9, coarsest=0.9, memory_limit_bytes=room)


def test_a_grid_that_the_memory_does_not_hold_gives_way_to_a_coarser_one():
    design = design_of(plates, 0.2)
    asked = 0.8
    volume = explicit_mesh.field_volume(design, asked)
    room = explicit_mesh.predict_memory_bytes(predict_unknowns(volume, 1.1 * asked), 2)
    made = mesh_within_budget(
        design, asked, coarsest=1.25 * asked, memory_limit_bytes=room, bodies=2
    )
    assert asked < made.requested <= 1.25 * asked
    held = explicit_mesh.field_volume(design, made.spacing)
    assert predict_unknowns(held, made.spacing) <= 1.05 * predict_unknowns(volume, 1.1 * asked)
    with pytest.raises(ResourceError, match="unknowns"):
        mesh_within_budget(design, asked, coarsest=asked, memory_limit_bytes=room, bodies=2)


def test_plane_walls_along_the_grid_are_counted_without_bias():
    """Two walls of 2.4 mm in a box of 12 mm: 691.2 mm^3, wherever grid planes lie."""
    design = design_of(plates, 0.2)
    found = [explicit_mesh.field_volume(design, spacing) for spacing in (0.92, 0.8, 0.71)]
    # One point in each of some 60,000 cells: a standard error of 0.3 % at most.
    assert found == pytest.approx([2 * 2.4 * EDGE**2] * 3, rel=0.012)


def test_what_falls_apart_on_every_grid_is_the_design():
    with pytest.raises(LatticeError, match="it is the design, not its mesh"):
        mesh_within_budget(design_of(balls, 0.3), 0.7, coarsest=0.9, memory_limit_bytes=1e12)


def test_the_fitting_cube_fits_and_a_tenth_less_does_not():
    spacing = fitting_spacing(1000.0, 1e9)
    need = [
        explicit_mesh.predict_memory_bytes(predict_unknowns(1000.0, c), 2)
        for c in (spacing, 0.9 * spacing)
    ]
    assert need[0] <= 1e9 < need[1]
    assert fitting_spacing(1000.0, 1e6) == np.inf


def test_a_thicker_strut_never_needs_more_cubes():
    struts = calibrate(replace(STRUTS, name="round-struts-again"))
    assert elements_per_wall(struts, 0.4) <= elements_per_wall(struts, 0.05)


def test_struts_meet_a_skin_in_sharp_creases():
    """Struts of 0.72 mm radius on the inner faces of a skin: circles on planes, no welds."""
    plain = design_of(round_struts, 0.12)
    design = replace(plain, domain=replace(plain.domain, skins=(Skin(thickness=1.5),)))
    made = mesh_lattice(design, 0.45, memory_limit_bytes=1e12)
    points = made.mesh.points
    feet = points[:, np.abs(points[2] - 1.5) < 0.01]
    away = np.hypot(*(feet[:2] - np.array([3.0, 3.0])[:, None]))
    on_circle = np.abs(away - 0.72) < 0.02
    assert np.count_nonzero(on_circle) >= 10
    inside = design.domain.distance(feet[:, on_circle])
    assert (inside < -1.0).all()
    exact = explicit_mesh.field_volume(design, 0.15)
    assert made.report.volume == pytest.approx(exact, rel=0.01)
    assert made.report.inverted == 0


def test_joints_with_fillets_have_no_crease_to_snap_to():
    """A fillet of 1 mm covers the circle; the mesh follows the fillet."""
    plain = design_of(round_struts, 0.12)
    domain = replace(plain.domain, skins=(Skin(thickness=1.5),), joint_radius=1.0)
    made = mesh_lattice(replace(plain, domain=domain), 0.45, memory_limit_bytes=1e12)
    facets, _ = boundary_facets(made.mesh)
    surface = made.mesh.points[:, np.unique(facets)]
    foot = np.hypot(surface[0] - 3.0, surface[1] - 3.0) < 0.9
    assert not (foot & (np.abs(surface[2] - 1.5) < 0.1)).any()

"""Acceptance and correction driven by a fake analysis: a block of sample points, no mesh."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_parts import zone_of

from gradedesign.design.acceptance import acceptance, meshed_anew
from gradedesign.design.acceptance.acceptance import accept_submodels, accept_whole, choose_scope
from gradedesign.design.acceptance.meshed_anew import mesh_anew
from gradedesign.design.acceptance.submodel import (
    _drive_factor,
    _force_discrepancy,
    _plane_forces,
    analyse_submodel,
)
from gradedesign.design.acceptance.submodel_choice import Submodel, submodel_box
from gradedesign.errors import LatticeError, MeshError, ResourceError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.mesher import PYTETWILD
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign.mechanics.explicit.analysis import (
    Discretisation,
    ExplicitAnalysis,
    Resolution,
    StressSample,
)
from gradedesign.mechanics.explicit.correction import Correction, discrepancy_between
from gradedesign.mechanics.explicit.explicit import analyse_printed_solid, measured
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.material.material import Material

E, NU, ALPHA = 1000.0, 0.3, 1e-4
SIDE, CELL = 12.0, 3.0
PULL = np.array([1.0, -NU, -NU])  # times 1e-3: 1 MPa along x, by hand
MESHER = replace(PYTETWILD, name="acme")
MATERIAL = Material(
    name="test",
    youngs_modulus=E,
    poissons_ratio=NU,
    density=1e-9,
    yield_strength=100.0,
    thermal_expansion=ALPHA,
    source="by hand",
)


DIVISION = Discretisation(
    made_by="by hand", mesh_size=2.0, unknowns=3, requested=2.0,
)  # fmt: skip


@dataclass(frozen=True)
class Block:
    """A block under uniform strain, as an analysis tells it: two values at every sample point.

    ``peak`` is the stress of the cell from 6 to 9 mm in all directions, 1 MPa elsewhere.
    """

    peak: float = 1.0
    spoil: float = 1.0
    warming: float = 0.0
    stiff: float = 1.0  # of what its displacements should be
    residual: float | None = None
    load_cases: tuple = ("pull",)
    division: Discretisation = DIVISION

    @property
    def work(self):
        return {"pull": 1.0}

    @property
    def traction_residual(self):
        return {} if self.residual is None else {"pull": self.residual}

    @property
    def goal_residuals(self):
        return {}

    @property
    def points(self):
        axis = np.arange(0.25, SIDE, 0.5)
        return np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)

    @property
    def volumes(self):
        return np.full(self.points.shape[1], 0.125)

    def von_mises(self, load_case):
        assert load_case == "pull"
        cell = np.all((self.points > 6) & (self.points < 9), axis=0)
        return np.where(cell, self.peak, 1.0)[:, None] * np.ones(2)

    def stress_within(self, load_case, lower, upper):
        assert load_case == "pull"
        inside = np.all((lower <= self.points.T) & (upper >= self.points.T), axis=1)
        stress = np.zeros((3, 3, inside.sum()))
        stress[0, 0] = 1.0
        return StressSample(
            points=self.points[:, inside], volumes=self.volumes[inside], stress=stress
        )

    def displacement_at(self, load_case, points):
        assert load_case == "pull"
        strain = self.stiff * (1e-3 * PULL + ALPHA * self.warming)[:, None]
        # Stiffer beyond the middle: what a submodel feels differs from what its sample says.
        away = np.maximum(points - SIDE, 0) + np.maximum(-points, 0)
        stretched = np.where(points[:1] > 6.0, self.spoil, 1.0)
        return strain * points * stretched, np.linalg.norm(away, axis=0)

    def region_displacement(self, region, load_case):
        assert region == "tip"
        return self.displacement_at(load_case, np.array([[SIDE], [0.0], [0.0]]))[0]


def printed(bodies=1, clamped=(), warming=0.0, passive=()):
    """The block as a lattice design without cells."""
    domain = DesignDomain(
        distance=lambda p: np.abs(p - SIDE / 2).max(axis=0) - SIDE / 2,
        lower=np.zeros(3), upper=np.full(3, SIDE), bodies=bodies, components=passive,
    )  # fmt: skip
    pull = SimpleNamespace(name="pull", temperature_change=warming, fix=[], load=[])
    return PrintedSolid(
        load_cases=(pull,),
        memory=10**9,
        design=SimpleNamespace(domain=domain, cell_map=None, cell_size=CELL),
        material=MATERIAL,
        regions={},
        support_zones=tuple(zone_of(distance, 1.0) for distance in clamped),
        stress_limit=2.0,
        percentile=99.5,
        mesher=MESHER,
    )


def explicit(block, solid):
    return measured(block, solid, 0.0)


@pytest.fixture
def mesher(monkeypatch):
    """Bricks of 1 mm in the box of the surface; what it was asked."""
    asked = []

    def mesh(surface, **options):
        asked.append((enclosed_volume(surface), options))
        lower = surface.vertices.min(axis=0)
        made = box_part_mesh(tuple(np.ptp(surface.vertices, axis=0)), 1.4)
        made = TetMesh(points=made.points + lower[:, None], tets=made.tets)
        return SimpleNamespace(mesh=made, attempts=("injected",), seconds=0.0)

    monkeypatch.setattr(meshed_anew, "tetrahedralize", mesh)
    return asked


# --- measures and correction ----------------------------------------------------------------------


def test_an_analysis_without_a_mesh_is_measured():
    region = PassiveRegion(to_place=lambda p: p[0], margin=3.0)
    solid = printed(clamped=(lambda p: np.asarray(p[1]),), passive=(region,))
    result = explicit(Block(peak=5.0), solid)
    by_phase = {m.phase: m for m in result.measures["pull"]}
    # A cell of 27 mm^3 in 9 x 11 x 12 mm^3 of lattice outside a radius of 1 mm: above the 99.5th.
    assert by_phase["lattice"].value == by_phase["lattice"].worst_cell == 5.0
    assert by_phase["lattice"].share_above == pytest.approx(27 / (9 * 11 * 12))
    assert by_phase["passive solid"].value == 1.0
    assert result.masses_g == pytest.approx(
        {"lattice": 1.296, "skin": 0.0, "passive solid": 0.432, "solid members": 0.0}
    )
    assert result.exclusion.share == pytest.approx({"lattice": 1 / 12, "passive solid": 1 / 12})
    assert (result.volume, result.mesh_size) == (pytest.approx(SIDE**3), 2.0)


def test_the_correction_learns_from_an_analysis_without_a_mesh():
    asked = []

    def solve(solid, resolution, say):
        asked.append(resolution)
        say("taking 2 mm")
        return Block(peak=5.0)

    told = []
    analysis = ExplicitAnalysis(
        name="by-hand", solve=solve, estimate=None, fitted_spacing=None, elements_per_wall=None,
        elements_per_layer=1.0,
    )  # fmt: skip
    wanted = Resolution(spacing=2.0, coarsest=2.5)
    result = analyse_printed_solid(analysis, printed(), wanted, told.append)
    assert (asked, told) == ([wanted], ["taking 2 mm"])
    measured_by = {
        "stress": max(m.value for m in result.measures["pull"]),
        "tip": float(np.linalg.norm(result.region_displacement("tip", "pull"))),
    }
    discrepancy = discrepancy_between({"stress": 4.0, "tip": 0.01}, measured_by, governing="tip")
    # 5 MPa of 4 and 12 um of 10 that were predicted.
    assert dict(discrepancy.values) == pytest.approx({"stress": 0.25, "tip": 0.2})
    assert Correction(factors=discrepancy.values).factor("stress") == pytest.approx(0.25)


# --- the whole surface ----------------------------------------------------------------------------


def test_the_whole_surface_goes_to_the_mesher_of_the_case(mesher, monkeypatch):
    solved = []

    def solve(mesh, solid, division, tolerance):
        solved.append((mesh, division, tolerance))
        return Block(peak=3.0)

    monkeypatch.setattr(acceptance, "solve_tets", solve)
    solid = printed()
    result = accept_whole(box_surface((SIDE, SIDE, SIDE)), solid, size=1.0, time_limit_s=600.0)
    (volume, options), (mesh, division, tolerance) = mesher[0], solved[0]
    assert volume == pytest.approx(SIDE**3)
    # 1.2 times the surface size an edge, an envelope of 6 % of it: by definition of the route.
    assert options["edge_length"] == division.mesh_size == pytest.approx(1.2)
    assert (options["epsilon"], tolerance) == (pytest.approx(0.06), 0.5)
    assert (options["mesher"], division.made_by) == (MESHER, "acme")
    assert (options["time_limit_s"], options["memory_limit_bytes"]) == (600.0, 10**9)
    assert mesh.tets.shape[1] > 0
    assert result.whole.measures["pull"][0].value == 3.0
    assert (result.scope, result.share) == ("whole", pytest.approx(1.0))
    assert result.attempts == ("injected",)


def two_boxes(*_, **__):
    """Tetrahedra of two unit cubes, the second one 2 mm away."""
    one = box_part_mesh((1.0, 1.0, 1.0), 1.0)
    other = one.points + np.array([[2.0], [0.0], [0.0]])
    mesh = TetMesh(
        points=np.hstack([one.points, other]),
        tets=np.hstack([one.tets, one.tets + one.points.shape[1]]),
    )
    return SimpleNamespace(mesh=mesh, attempts=(), seconds=0.0)


def test_a_lattice_of_one_body_that_falls_in_two_is_refused(monkeypatch):
    kept = []
    monkeypatch.setattr(meshed_anew, "tetrahedralize", two_boxes)
    monkeypatch.setattr(acceptance, "solve_tets", lambda mesh, *_: kept.append(mesh) or Block())
    surface, one, two = box_surface((1.0, 1.0, 2.0)), printed(), printed(bodies=2)
    with pytest.raises(LatticeError, match="falls apart"):
        accept_whole(surface, one, size=1.0, time_limit_s=1.0)
    assert kept == []
    accept_whole(surface, two, size=1.0, time_limit_s=1.0)
    assert kept[0].tets.shape == two_boxes().mesh.tets.shape


def test_the_mesher_is_given_fewer_triangles_within_half_its_envelope(mesher):
    ball = extract_surface(lambda p: np.sqrt((p**2).sum(axis=0)) - 3.0, [-4] * 3, [4] * 3, 0.2)
    seen = []
    real = meshed_anew.tetrahedralize
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshed_anew, "tetrahedralize", lambda s, **o: seen.append(s) or real(s, **o))
        mesh_anew(ball, printed(), 1.0, 60.0)
    (fewer,) = seen
    assert len(fewer.faces) < 0.7 * len(ball.faces)
    # 0.03 of the size is the farthest that anything moves, over a radius of 3: 3 % of the volume
    # if all of it did, and all to one side.
    assert enclosed_volume(fewer) == pytest.approx(enclosed_volume(ball), rel=0.03)
    centres = fewer.vertices[fewer.faces].mean(axis=1)
    assert np.linalg.norm(centres, axis=1).min() > 3.0 - 0.03 - 0.2**2 / (8 * 3.0)
    assert mesher[0][1]["epsilon"] == pytest.approx(0.06)


def test_a_surface_that_keeps_all_its_triangles_is_meshed_with_them(mesher, monkeypatch):
    def refuses(*_):
        raise LatticeError("triangles pass through each other")

    monkeypatch.setattr(meshed_anew, "within_chord", refuses)
    mesh_anew(box_surface((2.0, 2.0, 2.0)), printed(), 1.0, 60.0)
    assert mesher[0][0] == pytest.approx(8.0)


# --- submodels ------------------------------------------------------------------------------------

#: Its box reaches two halves from the centre: from 2 to 10 mm.
SUBMODEL = Submodel(centre=(6.0, 6.0, 6.0), half=2.0, value=1.0, load_case="pull")


def windowed(block=None, **asked):
    solid = printed(**asked)
    return analyse_submodel(
        box_surface((SIDE, SIDE, SIDE)),
        SUBMODEL,
        explicit(block or Block(), solid),
        solid,
        size=1.0,
        time_limit_s=60.0,
    )


def test_a_window_of_uniform_strain_matches(mesher):
    result = windowed()
    # E times strain, uniaxial: 1 MPa everywhere, in the submodel and in the body that drives it.
    assert result.value == pytest.approx(1.0, rel=1e-6)
    assert result.driving_value == pytest.approx(1.0, rel=1e-6)
    # Eight tetrahedra lie across a slab of half the box: its weight is sampled to 1 %.
    assert result.force_discrepancy < 0.01
    assert result.energy_discrepancy < 1e-6
    assert result.matches
    volume, options = mesher[0]
    lower, upper = submodel_box(SUBMODEL)
    assert volume == pytest.approx(float(np.prod(upper - lower))) == pytest.approx(8.0**3)
    assert options["edge_length"] == pytest.approx(1.2)
    assert (options["mesher"], options["time_limit_s"]) == (MESHER, 60.0)


@pytest.mark.usefixtures("mesher")
def test_a_window_of_a_warmed_body_has_its_stress():
    # 1e-4 of free strain for each of 50 K: five times what the pull strains, without any stress.
    result = windowed(Block(warming=50.0), warming=50.0)
    assert result.value == pytest.approx(1.0, rel=1e-6)
    assert result.matches


@pytest.mark.usefixtures("mesher")
def test_a_window_that_differs_does_not_match():
    result = windowed(Block(spoil=1.05))
    assert max(result.force_discrepancy, result.energy_discrepancy) > 0.03
    assert not result.matches


@pytest.mark.usefixtures("mesher")
@pytest.mark.parametrize(
    ("stiff", "residual", "factor"),
    [
        (0.975, 0.5, 1 / 0.975),  # forces of 1 MPa are carried by what it should have moved
        (0.95, 0.05, 1.02),  # a residual of 5 % explains 0.4 of it and no more
        (0.95, None, 1.0),  # nothing is known of the error: heat, or supports that move
        (1.05, 0.5, 1.0),  # elements are never too soft under forces
    ],
)
def test_the_drive_is_corrected_by_the_error_that_its_residual_allows(stiff, residual, factor):
    result = windowed(Block(stiff=stiff, residual=residual))
    # The factor on displacements that are too small by `stiff`, by hand; stress goes with it. The
    # forces of its slabs are sampled to 1 %.
    assert result.drive_factor == pytest.approx(factor, rel=1e-2)
    off = stiff * result.drive_factor
    assert result.value == pytest.approx(off, rel=1e-6)
    assert result.driving_value == pytest.approx(1.0, rel=1e-6)
    assert result.force_discrepancy == pytest.approx(abs(off - 1.0), abs=0.01)
    # The submodel's energy over the factor, to be that of the drive's forces on its displacements;
    # the block states that of 1 MPa.
    assert result.energy_discrepancy == pytest.approx(abs(stiff * off - 1.0), rel=1e-6)
    assert result.matches == (factor > 1.02)


def test_the_drive_factor_brings_forces_nearest_to_those_of_the_drive():
    forces = np.array([[3.0, 0.0, 1.0], [-3.0, 0.5, -1.0], [0.0, 2.0, 0.0]])
    assert _drive_factor(forces, 1.03 * forces, 0.2) == pytest.approx(1.03, rel=1e-12)
    # Forces at right angles to all of them change nothing: least squares.
    across = np.array([[1.0, 0.0, -3.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert _drive_factor(forces, 1.03 * forces + 0.1 * across, 0.2) == pytest.approx(1.03)
    # 0.4 of the residual at most, `limits.banded.RESIDUAL_FACTORS`; one without a residual.
    assert _drive_factor(forces, 1.03 * forces, 0.05) == pytest.approx(1.02)
    assert _drive_factor(forces, 1.03 * forces, None) == 1.0
    assert _drive_factor(forces, 0.97 * forces, 0.2) == 1.0
    assert _drive_factor(0.0 * forces, forces, 0.2) == 1.0


def sampled(spacing, size=8.0, scale=1.0):
    """Stress along x, MPa, of tension with some bending, at the centres of cubes of an edge, mm."""
    axis = (np.arange(np.ceil(size / spacing)) + 0.5) * spacing
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
    stress = np.zeros((3, 3, points.shape[1]))
    stress[0, 0] = scale * (1.0 + 0.1 * points[1])
    return StressSample(points=points, volumes=np.full(points.shape[1], spacing**3), stress=stress)


@pytest.mark.parametrize("spacing", [0.37, 0.53, 0.8])
def test_forces_on_cut_planes_do_not_depend_on_where_samples_lie(spacing):
    """Whole samples that fall in or out of a slab moved its force by up to 25 %."""
    box = (np.zeros(3), np.full(3, 8.0))
    coarse, fine = sampled(spacing), sampled(0.1)
    inside = (coarse.points < 8.0).all(axis=0)
    coarse = StressSample(
        points=coarse.points[:, inside],
        volumes=coarse.volumes[inside] * 8.0**3 / (coarse.volumes[inside].sum()),
        stress=coarse.stress[:, :, inside],
    )
    right, wrong, driving = (
        _plane_forces(field, box, 0.5) for field in (fine, sampled(0.1, scale=1.05), coarse)
    )
    assert _force_discrepancy(right, driving) < 0.02
    assert _force_discrepancy(wrong, driving) == pytest.approx(0.05, abs=0.02)


@pytest.mark.usefixtures("mesher")
def test_the_most_stressed_cells_are_judged():
    solid, told = printed(), []
    result = accept_submodels(
        box_surface((SIDE, SIDE, SIDE)),
        solid,
        explicit(Block(peak=3.0), solid),
        count=2,
        size=1.0,
        time_limit_s=600.0,
        on_submodel=told.append,
    )
    assert (result.scope, result.whole) == ("submodels", None)
    assert set(map(id, result.submodels)) <= set(map(id, told))  # enlarged ones are told too
    # The cell of 3 MPa first, about (7.5, 7.5, 7.5) mm; then one that does not overlap it.
    assert told[0].submodel.centre == pytest.approx((7.5, 7.5, 7.5))
    assert told[0].submodel.value == 3.0
    assert len(result.submodels) == 2
    # Two cells of 27 of the 1728 mm^3.
    assert result.share == pytest.approx(2 * 27 / SIDE**3, rel=0.3)


def test_a_window_that_misses_is_enlarged_and_then_said(mesher):
    """Stiffer beyond the middle, twice: no box can match, and the one around it is tried."""
    solid, told = printed(), []
    result = accept_submodels(
        box_surface((SIDE, SIDE, SIDE)), solid, explicit(Block(peak=3.0, spoil=1.05), solid),
        count=2, size=1.0, time_limit_s=600.0, on_submodel=told.append,
    )  # fmt: skip
    missed = [one for one in told if not one.matches and not one.submodel.enlarged]
    assert missed
    for one in missed:
        after = told[told.index(one) + 1]
        assert after.submodel.enlarged
        assert after.submodel.centre == one.submodel.centre
        assert after in result.submodels
        assert one not in result.submodels
    assert len(mesher) == len(told)


def test_a_window_that_cannot_be_enlarged_keeps_what_it_found(mesher, monkeypatch):
    calls = []

    def fails_second(surface, **options):
        calls.append(surface)
        if len(calls) == 2:
            raise ResourceError("no memory for it")
        return real(surface, **options)

    real = meshed_anew.tetrahedralize
    monkeypatch.setattr(meshed_anew, "tetrahedralize", fails_second)
    solid = printed()
    result = accept_submodels(
        box_surface((SIDE, SIDE, SIDE)), solid, explicit(Block(peak=3.0, spoil=1.05), solid),
        count=1, size=1.0, time_limit_s=600.0,
    )  # fmt: skip
    assert not result.submodels[0].matches
    assert not result.submodels[0].submodel.enlarged
    assert "was not enlarged: no memory for it" in result.refused[0]
    assert len(mesher) == 1


def refusing(monkeypatch, refuses):
    """The mesher of the tests, but for an error where ``refuses(centre, edge)``."""
    real = meshed_anew.tetrahedralize

    def mesh(surface, *, edge_length, **options):
        ends = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        if refuses(0.5 * (ends[0] + ends[1]), edge_length):
            raise MeshError("its volume is 1.26 % off, where 1 % is allowed")
        return real(surface, edge_length=edge_length, **options)

    monkeypatch.setattr(meshed_anew, "tetrahedralize", mesh)


def test_a_window_whose_volume_is_missed_is_meshed_finer(mesher, monkeypatch):
    refusing(monkeypatch, lambda _, edge: edge > 1.0)
    result = windowed()
    # 1.5 times smaller than 1.2 mm, driven and compared on the size of the drive as before.
    assert (result.mesh_size, mesher[0][1]["edge_length"]) == (pytest.approx(0.8),) * 2
    assert mesher[0][1]["epsilon"] == pytest.approx(0.04)
    assert result.value == pytest.approx(1.0, rel=1e-6)
    assert result.attempts[0].startswith("tetrahedra of 1.2 mm: its volume is 1.26 % off")
    assert result.attempts[1:] == ("injected",)


@pytest.mark.parametrize("all_of_them", [False, True])
def test_a_window_that_no_size_can_mesh_is_left_out(mesher, monkeypatch, all_of_them):
    refusing(monkeypatch, lambda centre, _: all_of_them or centre.min() > 7.0)
    solid = printed()
    result = accept_submodels(
        box_surface((SIDE, SIDE, SIDE)), solid, explicit(Block(peak=3.0), solid), count=2, size=1.0,
        time_limit_s=600.0,
    )  # fmt: skip
    # The cell of 3 MPa about (7.5, 7.5, 7.5) mm is one of two.
    assert (
        "the submodel at (7.5, 7.5, 7.5) mm was left out: tetrahedra of 1.2 mm: its volume"
        in (result.refused[0])
    )
    assert "; tetrahedra of 0.8 mm: its volume is 1.26 % off" in result.refused[0]
    if all_of_them:
        assert (result.scope, result.judged, result.left_out) == ("none", 0.0, 2)
        assert mesher == []
    else:
        assert (result.scope, result.judged, result.left_out) == ("submodels", 0.5, 1)
        assert len(result.submodels) == 1


def test_without_a_window_there_is_no_verdict():
    solid = printed(clamped=(lambda p: np.zeros(p.shape[1:]),))
    with pytest.raises(MeshError, match="no submodel can be chosen"):
        accept_submodels(
            None, solid, explicit(Block(), solid), count=2, size=1.0, time_limit_s=600.0
        )


def test_scope_follows_the_tetrahedra_of_the_mesher():
    # 2893 tetrahedra take 7.2 s at 400 in a second: a sixtieth of 434 s.
    assert choose_scope("auto", 2893.0, 440.0) == "whole"
    assert choose_scope("auto", 2893.0, 430.0) == "submodels"
    assert choose_scope("whole", 1e9, 1.0) == "whole"

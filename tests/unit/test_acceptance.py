"""Acceptance with injected mesher and analyses: what is asked of them and what follows."""

from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.errors import LatticeError, MeshError
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.part.box import box_surface
from gradedesign.part.part_mesh import box_part_mesh
from gradedesign.verify import acceptance
from gradedesign.verify.acceptance import accept_whole, accept_windows

CUBE = 0.5


def measured(value):
    """Measures of one load case with this stress in the lattice, MPa."""
    return {"pull": (SimpleNamespace(phase="lattice", value=value),)}


def two_boxes():
    """Tetrahedra of two unit cubes, the second one 2 mm away."""
    one = box_part_mesh((1.0, 1.0, 1.0), 1.0)
    other = one.points + np.array([[2.0], [0.0], [0.0]])
    return TetMesh(
        points=np.hstack([one.points, other]),
        tets=np.hstack([one.tets, one.tets + one.points.shape[1]]),
    )


@pytest.fixture
def stages(monkeypatch):
    """Records what the mesher and the analysis are asked; the accepted stress is 55 MPa."""
    asked = SimpleNamespace(mesher=[], mesh=[], windows=[])

    def mesher(_, **options):
        asked.mesher.append(options)
        return SimpleNamespace(mesh=two_boxes(), attempts=("first",))

    def analyse(mesh, _, **options):
        asked.mesh.append((mesh, options))
        return SimpleNamespace(measures=measured(55.0))

    def window(_, found, *__, **options):
        asked.windows.append(options)
        return SimpleNamespace(
            value=found.accepted, driving_value=50.0, volume=1.0, attempts=("a",), window=found
        )

    monkeypatch.setattr(acceptance, "tetrahedralize", mesher)
    monkeypatch.setattr(acceptance, "analyse_printed_solid", analyse)
    monkeypatch.setattr(acceptance, "analyse_window", window)
    monkeypatch.setattr(acceptance, "eligible_lattice", lambda *_: None)
    monkeypatch.setattr(acceptance, "held_and_loaded", lambda _: set())
    monkeypatch.setattr(acceptance, "neighbourhood_cells", lambda _: 1.0)
    return asked


def judged(bodies=1):
    run = SimpleNamespace(memory=10**9, window_count=2)
    return SimpleNamespace(
        case=SimpleNamespace(run=run),
        bodies=bodies,
        percentile=99.5,
        design=None,
        regions={},
        material=None,
    )


def explicit():
    mesh = box_part_mesh((1.0, 1.0, 1.0), 1.0)
    return SimpleNamespace(
        mesh_size=CUBE,
        measures=measured(50.0),
        volume=8.0,
        space=SimpleNamespace(mesh=mesh),
        von_mises={},
        solutions=(SimpleNamespace(name="pull", displacement=None),),
    )


def test_the_whole_lattice_is_meshed_finer_than_its_walls_need(stages):
    found = accept_whole(
        box_surface((1.0, 1.0, 2.0)), judged(bodies=2), explicit(), time_limit_s=600.0
    )
    # 1.2 cubes an edge, an envelope of 6 % of a cube: by definition of the route.
    assert stages.mesher[0]["edge_length"] == pytest.approx(0.6)
    assert stages.mesher[0]["epsilon"] == pytest.approx(0.03)
    assert stages.mesher[0]["time_limit_s"] == 600.0
    # 55 MPa on the accepted mesh, 50 in the explicit analysis.
    assert found.stress_factor == pytest.approx(1.1)
    assert (found.scope, found.volume, found.share) == ("whole", pytest.approx(2.0), 1.0)
    assert found.attempts == ("first",)


def test_every_body_is_kept(stages):
    accept_whole(box_surface((1.0, 1.0, 2.0)), judged(bodies=2), explicit(), time_limit_s=1.0)
    assert stages.mesh[0][0].tets.shape == two_boxes().tets.shape


def test_a_lattice_of_one_body_that_falls_in_two_is_refused(stages):
    with pytest.raises(LatticeError, match="falls apart"):
        accept_whole(box_surface((1.0, 1.0, 2.0)), judged(), explicit(), time_limit_s=1.0)
    assert stages.mesh == []


def test_the_worst_window_scales_the_stress(stages, monkeypatch):
    chosen = [SimpleNamespace(load_case="pull", accepted=v) for v in (48.0, 60.0)]
    monkeypatch.setattr(acceptance, "most_stressed_windows", lambda *_, **__: chosen)
    told = []
    found = accept_windows(None, judged(), explicit(), time_limit_s=600.0, on_window=told.append)
    assert found.stress_factor == pytest.approx(60.0 / 50.0)
    assert (found.scope, found.whole, len(told)) == ("windows", None, 2)
    # 2 of 8 mm^3 were judged, in half of the time each.
    assert found.share == pytest.approx(0.25)
    assert [options["time_limit_s"] for options in stages.windows] == [300.0, 300.0]


@pytest.mark.usefixtures("stages")
def test_without_a_window_there_is_no_verdict(monkeypatch):
    monkeypatch.setattr(acceptance, "most_stressed_windows", lambda *_, **__: ())
    with pytest.raises(MeshError, match="no window can be chosen"):
        accept_windows(None, judged(), explicit(), time_limit_s=600.0)

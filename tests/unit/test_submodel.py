"""A window of a body under uniform strain: its submodel must find what drives it."""

from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.fe.space import tet_space
from gradedesign.material.material import Material
from gradedesign.mesh.surface_mesh import enclosed_volume
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.part.box import box_surface
from gradedesign.part.part_mesh import box_part_mesh
from gradedesign.verify import submodel
from gradedesign.verify.submodel import analyse_window
from gradedesign.verify.windows import Window, window_box

E, NU = 1000.0, 0.3
SIDE = 12.0
#: Its box reaches 1.4 halves from the centre: from 2 to 10 mm, along planes of both meshes.
WINDOW = Window(centre=(6.0, 6.0, 6.0), half=4.0 / 1.4, value=1.0, load_case="pull")


class Meshed:
    """What the mesher returns."""

    attempts = ("injected",)
    seconds = 0.0

    def __init__(self, mesh):
        self.mesh = mesh


@pytest.fixture
def analysed(monkeypatch):
    """A block pulled along x by a strain of 1e-3, and a window that the injected mesher fills."""
    lower, upper = window_box(WINDOW)
    asked = []

    def mesher(surface, **options):
        asked.append((enclosed_volume(surface), options))
        mesh = box_part_mesh(tuple(upper - lower), 2.0)
        return Meshed(TetMesh(points=mesh.points + lower[:, None], tets=mesh.tets))

    monkeypatch.setattr(submodel, "tetrahedralize", mesher)
    driving = tet_space(box_part_mesh((SIDE, SIDE, SIDE), 2.0), 2)

    def call(spoil=1.0):
        strain = 1e-3 * np.array([1.0, -NU, -NU])
        displacement = strain[:, None] * driving.nodes
        # Stiffer outside a point: what the window feels at its cut differs from the driving body.
        displacement = displacement * np.where(driving.nodes[:1] > 6.0, spoil, 1.0)
        return analyse_window(
            box_surface((SIDE, SIDE, SIDE)),
            WINDOW,
            SimpleNamespace(
                space=driving,
                mesh_size=1.0,
                solutions=(SimpleNamespace(name=WINDOW.load_case, displacement=displacement),),
            ),
            Material(
                name="test",
                youngs_modulus=E,
                poissons_ratio=NU,
                density=1e-9,
                yield_strength=100.0,
                thermal_expansion=0.0,
                source="by hand",
            ),
            percentile=99.5,
            time_limit_s=60.0,
            memory_limit_bytes=1e9,
        )

    return call, asked


def test_a_window_of_uniform_strain_matches(analysed):
    call, asked = analysed
    found = call()
    # E times strain, uniaxial: 1 MPa everywhere, in the window and in the body that drives it.
    assert found.value == pytest.approx(1.0, rel=1e-6)
    assert found.driving_value == pytest.approx(1.0, rel=1e-6)
    assert found.force_gap < 1e-6
    assert found.energy_gap < 1e-6
    assert found.matches
    volume, options = asked[0]
    assert volume == pytest.approx(8.0**3)
    assert options["edge_length"] == pytest.approx(1.2)
    assert options["time_limit_s"] == 60.0


def test_a_window_that_differs_does_not_match(analysed):
    call, _ = analysed
    found = call(spoil=1.05)
    assert max(found.force_gap, found.energy_gap) > 0.03
    assert not found.matches

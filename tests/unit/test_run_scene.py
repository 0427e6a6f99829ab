"""The scene of a finished run: fields, densities and how much of a surface is drawn."""

import base64
import re
import zlib

import numpy as np
import pytest
import trimesh

from gradedesign.design.resolve.shown_case import CaseShown
from gradedesign.errors import MeshError
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part import read_part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.analysis import SurfaceFields
from gradedesign.program.outputs.scene_file import write_scene
from gradedesign.program.pictures import run_scene as run_scene_module
from gradedesign.program.pictures.run_scene import RunShown, run_scene

RADIUS = 20.0


def unpacked(data):
    size = data["bits"] // 8
    planes = np.frombuffer(zlib.decompress(base64.b64decode(data["data"])), dtype=np.uint8)
    planes = planes.reshape(data["columns"], size, data["rows"]).astype(np.uint64)
    differences = sum(planes[:, k] << np.uint64(8 * k) for k in range(size))
    return (np.cumsum(differences, axis=1) % np.uint64(2 ** data["bits"])).astype(np.int64).T


def values(data):
    return np.array(data["lower"]) + np.array(data["step"]) * unpacked(data)


def sphere(subdivisions):
    made = trimesh.creation.icosphere(subdivisions=subdivisions, radius=RADIUS)
    return SurfaceMesh(vertices=np.array(made.vertices), faces=np.array(made.faces))


@pytest.fixture(scope="module")
def box():
    """A box of 8 x 4 x 2 mm, and a domain of it that holds nothing solid."""
    spec = PartSpec.model_validate({"box": ["8 mm", "4 mm", "2 mm"]})
    part = read_part(spec, {}, {}, lambda key: key)
    half, middle = np.array([4.0, 2.0, 1.0]), np.array([4.0, 2.0, 1.0])

    def distance(points):
        beyond = np.moveaxis(np.abs(np.moveaxis(points, 0, -1) - middle) - half, -1, 0)
        return beyond.max(axis=0)

    domain = DesignDomain(distance=distance, lower=middle - half, upper=middle + half)
    return CaseShown(part=part, domain=domain)


def field(surface, peak):
    """Stress of 1 MPa with a peak at one vertex, displacement by a turn about z."""
    x, y, _ = surface.vertices.T
    stress = np.ones(len(surface.vertices))
    stress[peak] = 90.0
    displacement = 1e-3 * np.stack([-y, x, np.zeros_like(x)])
    return SurfaceFields(surface=surface, von_mises=stress, displacement=displacement)


def test_a_surface_of_few_triangles_is_drawn_whole(box):
    surface = sphere(3)
    fields = {"pull": field(surface, 5), "side": field(surface, 7)}
    data = run_scene(RunShown(case=box, printed=surface, analysed=fields, limit=80.0), "ball")
    assert [view["id"] for view in data["views"]] == ["printed", "stress", "moved", "cells", "case"]
    assert data["views"][0]["note"] == "drawn whole, 1280 triangles"
    assert np.array_equal(unpacked(data["printed"]["triangles"]), surface.faces)
    pull, side = data["analysed"]["cases"]
    assert data["limit"] == 80.0
    assert (pull["name"], pull["most"]) == ("pull", 90.0)
    assert np.argmax(values(pull["von_mises"])) == 5
    assert np.argmax(values(side["von_mises"])) == 7
    moved = values(pull["displacement"])
    assert (
        np.abs(moved - fields["pull"].displacement.T).max() <= 0.0200001 / 65535
    )  # 2 x 20 um, halved
    assert pull["largest"] == pytest.approx(0.02, rel=1e-3)
    # A twelfth of the diagonal of 69.3 mm, 5.5 mm, over 0.02 mm is 277: 1, 2 or 5 times a power.
    assert pull["factor"] == 200.0


def test_of_many_triangles_few_are_drawn_within_a_stated_distance(box, monkeypatch):
    for name in ("_MOST", "_MOST_WITH_FIELDS"):
        monkeypatch.setattr(run_scene_module, name, 3000)
    surface = sphere(6)  # 81,920
    peak = 4321
    data = run_scene(
        RunShown(case=box, printed=surface, analysed={"pull": field(surface, peak)}), "ball"
    )
    drawn = trimesh.Trimesh(
        vertices=values(data["printed"]["vertices"]),
        faces=unpacked(data["printed"]["triangles"]),
        process=False,
    )
    assert 300 < len(drawn.faces) <= 3000
    assert drawn.is_watertight
    stated = float(re.search(r"within ([\d.e-]+) mm", data["views"][0]["note"])[1])
    assert f"drawn with {len(drawn.faces)} of 81920 triangles" in data["views"][0]["note"]
    _, away, _ = trimesh.proximity.closest_point(drawn, surface.vertices)
    assert stated == pytest.approx(away.max(), rel=0.05)  # said with two figures
    # Nor does a triangle lie deeper than that within the sphere.
    assert RADIUS - np.linalg.norm(drawn.triangles_center, axis=1).min() <= 1.05 * stated
    assert stated < 0.3  # 3000 triangles of 2 mm have a sagitta of 0.03 to 0.1 mm
    # The peak is at no vertex that is drawn, and yet it shows, near its place.
    (pull,) = data["analysed"]["cases"]
    stress = values(pull["von_mises"])[:, 0]
    assert stress.max() == pytest.approx(90.0, abs=1e-3)
    at = values(data["analysed"]["vertices"])[np.argmax(stress)]
    assert np.linalg.norm(at - surface.vertices[peak]) < 3.0
    # The others move as they do on the whole surface: a turn about z.
    vertices, moved = values(data["analysed"]["vertices"]), values(pull["displacement"])
    turned = 1e-3 * np.stack([-vertices[:, 1], vertices[:, 0], 0 * vertices[:, 0]], axis=1)
    assert np.abs(moved - turned).max() < 2e-6


def test_a_surface_that_is_not_manifold_is_drawn_all_the_same(box, monkeypatch):
    for name in ("_MOST", "_MOST_WITH_FIELDS"):
        monkeypatch.setattr(run_scene_module, name, 3000)
    whole = sphere(5)
    open_one = SurfaceMesh(vertices=whole.vertices, faces=whole.faces[:-500])
    data = run_scene(RunShown(case=box, printed=open_one, analysed={}), "ball")
    assert 300 < data["printed"]["triangles"]["rows"] <= 3000
    assert re.search(r"of 19980 triangles, within [\d.]+ mm", data["views"][0]["note"])


def test_densities_fill_the_part(box):
    corners = np.array(
        [[x, y, z] for x in (0, 4, 8) for y in (0, 4) for z in (0, 2)], dtype=float
    ).T
    tets = []
    for shift in (0, 4):  # six tetrahedra along the diagonal of each half
        for path in ((1, 2, 4), (1, 4, 2), (2, 1, 4), (2, 4, 1), (4, 1, 2), (4, 2, 1)):
            nodes = shift + np.cumsum([0, *path])
            tet = corners[:, nodes]
            volume = np.linalg.det((tet[:, 1:] - tet[:, :1]).T)
            tets.append(nodes if volume > 0 else nodes[[1, 0, 2, 3]])
    mesh = TetMesh(points=corners, tets=np.array(tets).T)
    rho = np.where(centroids(mesh)[0] < 4.0, 0.2, 0.7)
    data = run_scene(RunShown(case=box, density=(mesh, rho), analysed={}), "bar")
    volume = data["volumes"]["density"]
    nx, ny, nz = volume["shape"]
    grid = unpacked(volume["values"])[:, 0].reshape(nz, ny, nx).transpose(2, 1, 0)
    density = volume["low"] + (volume["high"] - volume["low"]) * grid / 255
    x = volume["lower"][0] + volume["step"] * np.arange(nx)
    assert np.abs(density[x < 3.9] - 0.2).max() < 1e-9
    assert np.abs(density[x > 4.1] - 0.7).max() < 1e-9
    assert 60 < (x < 3.9).sum() < 100  # 350,000 points of 64 mm^3


def test_a_scene_that_fails_is_a_warning(box, monkeypatch):
    def fail(*_):
        raise MeshError("no triangles")

    monkeypatch.setattr("gradedesign.program.outputs.scene_file.run_scene", fail)
    files = {}
    told = write_scene(None, RunShown(case=box, analysed={}), "ball", files)
    assert told == ("scene.json: not written: no triangles",)
    assert files == {}

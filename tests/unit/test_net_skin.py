"""Net-skins: the struts below a face of any direction are laid onto it, in one piece."""

from dataclasses import replace

import numpy as np
import pytest
from plain_cells import plain_cells
from scipy import ndimage

from gradedesign.design.case.read_case import load_case
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.components.joint import joint_volume
from gradedesign.geometry.lattice.components.net_skin import NetSkin
from gradedesign.geometry.lattice.domain import DesignDomain, grown
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

#: A cube of 16 mm about the origin, turned about x.
HALF, RADIUS, DEEP = 8.0, 0.8, 2.4


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def growth(distance, points):
    """Unit gradient of a distance by central differences."""
    shifts = 1e-5 * np.eye(3)[:, :, None]
    gradient = np.stack([distance(points + s) - distance(points - s) for s in shifts])
    return gradient / np.linalg.norm(gradient, axis=0)


def bar(angle, **net):
    """One strut along x, 2.4 mm below the top of a cube that is turned about x."""
    rotation = turned(angle)

    def distance(points):
        away = np.abs(np.tensordot(rotation.T, points, axes=1)) - HALF
        return np.linalg.norm(np.maximum(away, 0), axis=0) + np.minimum(away.max(axis=0), 0)

    def strut(u):
        y, z = np.tensordot(rotation.T, 16.0 * u, axes=1)[1:]
        return (np.hypot(y, z - (HALF - DEEP)) - RADIUS) / 16.0

    size = np.full(3, HALF * 1.5)
    return LatticeDesign(
        domain=DesignDomain(
            distance=distance,
            lower=-size,
            upper=size,
            components=(NetSkin(outward=lambda p: growth(distance, p), **net),) if net else (),
        ),
        cells=plain_cells(strut),
        cell_map=lambda p: np.asarray(p) / 16.0,
        cell_size=16.0,
        density=0.1,
    )


@pytest.mark.parametrize("degrees", [0, 30, 45])
def test_strut_is_laid_onto_a_face_of_any_direction(degrees):
    """A strip as wide as the strut and as thick as stated."""
    design = bar(np.radians(degrees), thickness=0.5, reach=4.0)
    axes = np.meshgrid(
        (np.arange(8) + 0.5) * 2 - 8,
        (np.arange(80) + 0.5) / 20 - 2,
        (np.arange(40) + 0.5) / 40 + 7,
        indexing="ij",
    )
    points = np.tensordot(turned(np.radians(degrees)), np.array(axes), axes=1)
    strip = (lattice_field(design)(points) < 0).mean() * 16 * 4 * 1
    assert strip == pytest.approx(16.0 * 2 * RADIUS * 0.5, rel=0.02)
    # The same, counted coarsely over the whole part: nothing is added anywhere else.
    assert joint_volume(design) == pytest.approx(strip, rel=0.25)


def test_struts_below_the_reach_are_left_out():
    ends = 2 * np.pi * RADIUS**2 * 0.5  # its ends lie in the faces across already
    assert joint_volume(bar(0.3, thickness=0.5, reach=1.0)) < 0.1 * ends


def test_net_of_a_grown_part_is_that_of_the_part_inside():
    """What is contoured beyond the faces does not change what lies within them."""
    design = bar(0.4, thickness=0.5, reach=4.0)
    larger = LatticeDesign(
        domain=grown(design.domain, 0.7),
        cells=design.cells,
        cell_map=design.cell_map,
        cell_size=16.0,
        density=0.1,
    )
    points = np.random.default_rng(77).uniform(-7, 7, size=(3, 20_000))
    points = points[:, design.domain.distance(points) < -0.02]
    apart = (lattice_field(design)(points) < 0) != (lattice_field(larger)(points) < 0)
    assert apart.mean() < 2e-3


@pytest.mark.parametrize("cell", ["bcc", "sc"])
def test_net_of_a_ball_is_one_piece(cell):
    """By voxels of 0.3 mm in the layer of 1 mm alone; without the net it falls apart."""
    family = build_registry().cell_families[cell]
    ball = DesignDomain(
        distance=lambda p: np.linalg.norm(p, axis=0) - 9.0,
        lower=[-9.0] * 3,
        upper=[9.0] * 3,
        components=(
            NetSkin(thickness=1.0, reach=5.0, outward=lambda p: p / np.linalg.norm(p, axis=0)),
        ),
    )
    design = LatticeDesign(
        domain=ball,
        cells=plain_cells(family.shape, 0.1, 0.1, **family.parameters),
        cell_map=lambda p: np.asarray(p) / 5.0,
        cell_size=5.0,
        density=0.1,
    )
    axis = (np.arange(60) + 0.5) * 0.3 - 9.0
    points = np.array(np.meshgrid(axis, axis, axis, indexing="ij"))
    layer = ball.distance(points) > -1.0
    pieces = [
        ndimage.label((lattice_field(d)(points) < 0) & layer, np.ones((3, 3, 3)))[1]
        for d in (design, replace(design, domain=replace(ball, components=())))
    ]
    assert pieces[0] == 1
    assert pieces[1] > 8


CASE = """\
[case]
name = "net"
[part]
box = ["10 mm", "10 mm", "10 mm"]
[lattice]
cell = "bcc"
size = "5 mm"
origin = ["1.6 mm", "1.1 mm", "2.3 mm"]
density = 0.15
"""


def pieces_on_voxels(density, half=20):
    """Pieces of the same struts in the same box, each the voxels nearest to diagonals of cells."""
    axis = (np.arange(4 * half) + 0.5) / (2 * half)  # in cells
    u = np.array(np.meshgrid(axis, axis, axis, indexing="ij"))
    u = (u - np.reshape([0.32, 0.22, 0.46], (3, 1, 1, 1))) % 1.0
    away = np.full(u.shape[1:], np.inf)
    for corner in np.ndindex(2, 2, 2):
        from_corner = u - np.reshape(corner, (3, 1, 1, 1))
        for y, z in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            along = np.tensordot(np.array([1, y, z]) / np.sqrt(3), from_corner, axes=1)
            np.minimum(away, (from_corner**2).sum(axis=0) - along**2, out=away)
    solid = away < np.quantile(away, density)  # two whole cells each way
    return ndimage.label(solid, np.ones((3, 3, 3)))[1]


def test_a_generated_net_joins_struts_that_the_part_cuts_off(tmp_path):
    """The box cuts off eight pieces of struts, counted on voxels of 0.1 mm; with the net none."""
    results = []
    for words in ("", 'skin = {thickness = "0.8 mm", net = true}\n'):
        (tmp_path / "case.toml").write_text(CASE + words)
        case = load_case(tmp_path)
        results.append(run(case, build_registry(), folder=tmp_path / "out", overwrite=True))
    (plain,), net = ([w for w in r.warnings if "floating" in w] for r in results)
    assert plain.startswith(f"{pieces_on_voxels(0.15) - 1} floating")
    assert net == []
    assert results[1].measures["joints_mm3"] > 0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('skin = {thickness = "1 mm", net_depth = "3 mm"}', "needs net = true"),
        ('skin = {thickness = ["1 mm", "2 mm"], formula = "1 + x / 10", net = true}', "leave the"),
        (
            'skin = {thickness = "1 mm", net = true}\njoint_radius = "1 mm"',
            "not go with a net",
        ),
    ],
)
def test_keys_of_a_net(tmp_path, more, words):
    (tmp_path / "case.toml").write_text(CASE + more + "\n")
    with pytest.raises(CaseError, match=words):
        load_case(tmp_path)


def test_sheets_have_no_net(tmp_path):
    text = CASE.replace('"bcc"', '"gyroid-sheet"') + 'skin = {thickness = "1 mm", net = true}\n'
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(CaseError, match="'gyroid-sheet' has none"):
        run(load_case(tmp_path), build_registry(), folder=tmp_path / "out")

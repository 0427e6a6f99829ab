"""Skins whose thickness follows the stress of the solid part: bending of a cantilever."""

import numpy as np
import pytest
import trimesh

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.design_model import prepare
from gradedesign.errors import CaseError
from gradedesign.program.host.registry import build_registry

CASE = """\
[case]
name = "stressed skin"
[part]
box = ["60 mm", "16 mm", "16 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[region.sides]
any = ["top", "bottom"]
[region.top]
plane = "z = max"
[region.bottom]
plane = "z = min"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "bending"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "FORCE"]}]
[limits]
safety_factor = 2
percentile = 95
displacement = [{region = "tip", magnitude = "1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "16 mm"
phases = ["lattice"]
size_effects = false
skin = SKIN
[run]
stop_after = "lattice"
[output]
formats = ["stl"]
"""
LEAST, MOST = 0.8, 3.2
ALL_ROUND = '{thickness = ["0.8 mm", "3.2 mm"], follows = "stress"}'


def written(folder, skin=ALL_ROUND, force="-1 kN"):
    folder.mkdir(exist_ok=True)
    text = CASE.replace("SKIN", skin).replace("FORCE", force)
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


def test_the_thickness_is_proportional_to_the_bending_stress_in_the_worst_load_case(tmp_path):
    """Bending stress falls linearly to the tip (Euler and Bernoulli), 60 mm from the root.

    Places are a cell apart from both ends, where supports and loads disturb it. Shear adds 2 % to
    the von Mises stress nearer to the tip.
    """
    heard = []
    setup = prepare(load_case(written(tmp_path)), build_registry(), heard.append)
    (skin,) = setup.plan.domain.solids
    x = np.array([20.0, 30.0, 40.0])
    top = np.array([x, np.full(3, 8.0), np.full(3, 16.0)])
    share = (skin.thickness_at(top) - LEAST) / (MOST - LEAST)
    np.testing.assert_allclose(share / share[-1], (60.0 - x) / 20.0, rtol=0.04)
    bottom = top * np.array([[1.0], [1.0], [0.0]])
    np.testing.assert_allclose(skin.thickness_at(bottom), skin.thickness_at(top), rtol=0.02)
    # At mid-height bending changes its sign: the mean over elements of 4 mm is below a half.
    middle = skin.thickness_at(np.array([[20.0], [0.0], [8.0]]))[0]
    assert (middle - LEAST) / (MOST - LEAST) < 0.5 * share[0]
    (said,) = [event.message for event in heard if event.stage == "skin"]
    assert said.startswith("as the stress of the solid part: 0.8 mm")
    # Twice the load: twice the stress everywhere, the same shares of its percentile.
    twice = prepare(load_case(written(tmp_path / "b", force="-2 kN")), build_registry())
    other = twice.plan.domain.solids[0].thickness_at(top)
    np.testing.assert_allclose(other, skin.thickness_at(top), rtol=1e-4)


def test_the_printed_skin_is_as_thick_and_the_rest_of_the_run_knows_it(cli, tmp_path):
    sides = '{thickness = ["0.8 mm", "3.2 mm"], follows = "stress", faces = "sides"}'
    folder = written(tmp_path, skin=sides)
    checked = cli("check", folder, "--no-picture")
    assert "counts as 2 mm, the mean of its thickness, until" in " ".join(checked.out.split())
    ended = cli("run", folder, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    assert "until the stress" not in " ".join((ended.out + ended.err).split())
    mesh = trimesh.load(tmp_path / "out" / "lattice.stl")
    assert mesh.is_watertight
    skin = prepare(load_case(folder), build_registry()).plan.domain.solids[0]
    for x in (15.0, 45.0):
        # Below the thinnest place of a row there is a void: sheets join the skin beside it.
        places = np.array([[x, y] for y in np.linspace(7.0, 9.0, 9)])
        printed = min(first_solid(mesh.triangles, place) for place in places)
        there = np.array([[x], [8.0], [16.0]])
        assert printed == pytest.approx(skin.thickness_at(there)[0], abs=0.1)


def first_solid(triangles, place):
    """Thickness of the uppermost solid along z below a place ``(2,)``, mm."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    u, v, w = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2], place - a[:, :2]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    hit = np.abs(area) > 1e-12
    area = np.where(hit, area, 1.0)
    s = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / area
    t = (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / area
    hit &= (s >= 0) & (t >= 0) & (s + t <= 1)
    heights = np.unique((a[:, 2] + s * (b - a)[:, 2] + t * (c - a)[:, 2])[hit].round(6))
    return heights[-1] - heights[-2]


@pytest.mark.parametrize(
    ("skin", "words"),
    [
        ('{thickness = "1 mm", follows = "stress"}', 'found 1 mm with follows = "stress"'),
        ('{thickness = ["1 mm", "2 mm"], follows = "strain"}', "stress"),
        ('{thickness = ["1 mm", "2 mm"]}', 'a formula or follows = "stress"'),
        (
            '{thickness = ["1 mm", "2 mm"], formula = "1.5", follows = "stress"}',
            "a formula gives the thickness already",
        ),
        (
            '{thickness = ["1 mm", "2 mm"], follows = "stress", net = true}',
            "a net-skin has one thickness; leave the follows out",
        ),
    ],
)
def test_keys_that_contradict_each_other_are_refused(tmp_path, skin, words):
    with pytest.raises(CaseError, match=words):
        load_case(written(tmp_path, skin=skin))


def test_a_part_that_nothing_strains_has_no_stress_to_follow(tmp_path):
    """Free thermal expansion, held against rigid motions alone."""
    folder = written(tmp_path)
    text = (folder / "case.toml").read_text(encoding="utf-8")
    text = text.replace(
        'fix = [{region = "root"}]\nload = [{region = "tip", force = ["0 N", "0 N", "-1 kN"]}]',
        'temperature_change = "50 K"\nfix = [{region = "root", components = "x"}, '
        '{region = "side", components = "y"}, {region = "bottom", components = "z"}]',
    ).replace("[region.top]", '[region.side]\nplane = "y = min"\n[region.top]')
    known = 'youngs_modulus = "110 GPa"\npoissons_ratio = 0.34\ndensity = "4.43 g/cm^3"\n'
    text = text.replace('name = "Ti-6Al-4V"', f'{known}thermal_expansion = "9e-6 1/K"')
    text = text.replace("safety_factor = 2\n", 'stress = "400 MPa"\n')
    (folder / "case.toml").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match="the solid part carries no stress that a skin could"):
        prepare(load_case(folder), build_registry())


def test_a_stated_density_has_no_stress(cli, tmp_path):
    text = (
        '[case]\nname = "g"\n[part]\nbox = ["20 mm", "20 mm", "20 mm"]\n[lattice]\n'
        f'cell = "gyroid-sheet"\nsize = "10 mm"\ndensity = 0.3\nskin = {ALL_ROUND}\n'
    )
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 2
    told = " ".join(ended.err.split())
    assert "needs the stress of an analysis, and the run of a stated density has none" in told

"""No limit is met unjudged: over radii, meshes, limits and supports, by the stages of a run."""

import json

import numpy as np
import pytest
from small_parts import box_part, held_bar

from gradedesign.mechanics.limits.row import LEAST_JUDGED

LATTICE = """
[lattice]
cell = "gyroid-sheet"
size = "{cell} mm"
density = [0.2, 0.6]
[run]
stop_after = "solid"
[output]
formats = ["report"]
"""


def a_case(rng):
    """A bar with limits, an exclusion radius and a mesh size by chance; names of its limits."""
    size = rng.uniform(10, 40), *rng.uniform(10, 20, 2)
    limits, names = [], []
    if rng.random() < 0.8:
        limits.append(
            f"safety_factor = {rng.uniform(1, 3):.2f}" if rng.random() < 0.5
            else f'stress = "{rng.uniform(10, 300):.0f} MPa"'
        )  # fmt: skip
        names.append("stress")
    if not names or rng.random() < 0.6:
        limits.append('displacement = [{region = "tip", magnitude = "1 mm"}]')
        names.append("displacement")
    if rng.random() < 0.3:
        limits.append('mean_displacement = [{region = "tip", component = "z", magnitude = "1 mm"}]')
        names.append("mean_displacement")
    stated = rng.integers(4)
    if stated == 1:
        limits.append(f'exclusion_radius = "{rng.uniform(0, 40):.2f} mm"')
    elif stated == 2:
        limits.append(f'exclusion_radius = "{rng.uniform(0, 4):.2f} mesh sizes"')
    mesh = rng.uniform(3, 9.5)
    text = held_bar(
        box_part(*(f"{edge:.2f}" for edge in size), f"{mesh:.2f}"),
        material='name = "Ti-6Al-4V"',
        force=f"0 N, 0 N, {-(10 ** rng.uniform(1, 4.5)):.0f} N",
    )
    if rng.random() < 0.3:
        text = text.replace(
            "[material]", '[[keep]]\nregion = "root"\nmargin = "1.5 mm"\n[material]'
        )
    cell = rng.uniform(4, 0.8 * min(size))
    return (
        text + "[limits]\n" + "\n".join(limits) + LATTICE.format(cell=f"{cell:.2f}"),
        names,
        float(np.prod(size)),
    )


@pytest.mark.parametrize("seed", range(7100, 7124))
def test_every_stated_limit_has_a_row_that_judges_enough(cli, tmp_path, seed):
    text, names, _ = a_case(np.random.default_rng(seed))
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    checked = cli("check", path, "--no-picture", "--json")
    ended = cli("run", path, "-o", tmp_path / "out")
    if checked.code:
        # What check refuses a run refuses, with the value and what would do.
        assert checked.code == ended.code == 2, text
        assert "limit of stress" in checked.err
        assert "at least" in checked.err
        return
    if ended.code == 2:
        # Only the mesh shows it: tetrahedra too coarse for the radius.
        assert "part.mesh_size" in ended.err, text
        return
    assert ended.code in (0, 4)
    told = json.loads(checked.out)["unjudged_stress"]
    assert told["limited"] == ("stress" in names)
    assert max(told["part"], told["lattice"]) <= 1 - LEAST_JUDGED or "stress" not in names
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert {row["key"]["kind"] for row in result["solid"]} >= set(names), text
    for row in result["solid"]:
        assert row["judged"] >= LEAST_JUDGED, text
        assert row["judged"] == 1.0 or row["key"]["kind"] == "stress"
    # The yield strength of the library's Ti-6Al-4V, 825 MPa: on the first screen, above the table.
    assert bool(result["yields"]) == ("yields: in load case" in ended.out.partition("Limits")[0])


def test_without_a_stated_radius_a_tenth_of_the_part_goes_unjudged_at_most(cli, tmp_path):
    """A part of one cell, whose support is as wide as the part."""
    text = held_bar(box_part(10, 10, 10, 10)) + '[limits]\nstress = "20 MPa"\n'
    (tmp_path / "case.toml").write_text(text + LATTICE.format(cell=10), encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture", "--json")
    told = json.loads(ended.out)["unjudged_stress"]
    # A tenth of 10 mm is 1 mm, less than a quarter of the cell.
    assert told["around"] == "1 mm of root"
    assert told["part"] == pytest.approx(0.1, abs=0.002)


@pytest.mark.parametrize(
    ("support", "radius"),
    [
        ('region = "root"', "2 mm of root"),  # a quarter of a cell of 8 mm
        ('region = "pin"', "1.5 mm of pin"),  # half the width of a patch of 3 x 3 mm
        ('region = "root", components = "x"', ""),
        ('region = "pin", components = "x"', "2 mm of the border of pin"),
    ],
)
def test_the_default_radius_follows_cell_and_support(cli, tmp_path, support, radius):
    pin = """
[region.pin]
plane = "x = min"
box = {lower = ["-1 mm", "8.5 mm", "8.5 mm"], upper = ["1 mm", "11.5 mm", "11.5 mm"]}
clip = true
"""
    planes = '[region.low]\nplane = "z = min"\n[region.side]\nplane = "y = min"\n'
    rest = ', {region = "low", components = "z"}, {region = "side", components = "y"}'
    case = held_bar(box_part(60, 20, 20, 10), regions=pin + planes)
    case = case.replace('fix = [{region = "root"}', f"fix = [{{{support}}}{rest}")
    text = case + '[limits]\nstress = "20 MPa"\n' + LATTICE.format(cell=8)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture", "--json")
    around = json.loads(ended.out)["unjudged_stress"]["around"]
    assert around == radius

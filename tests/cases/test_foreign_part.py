"""A part that no case holds, in inches, with default settings: from the STL file to a verdict."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import gradedesign

FEATURETYPE = Path(__file__).parents[3] / "shared" / "parts" / "featuretype.STL"

CASE = """
[case]
name = "featuretype"

[part]
file = "featuretype.stl"
units = "inch"
mesh_size = "6 mm"

[region.screws]
cylinder = {diameter = "6.756 mm", axis = "z"}
count = 8
[region.pin]
cylinder = {diameter = "9.892 mm", axis = "y"}
count = 1

[material]
name = "Ti-6Al-4V"

[[keep]]
region = "screws"
margin = "3 mm"
[[keep]]
region = "pin"
margin = "3 mm"

[[load_case]]
name = "pin load"
fix = [{region = "screws"}]
load = [{region = "pin", force = ["18 kN", "0 N", "30 kN"]}]

[limits]
safety_factor = 1.5
displacement = [{region = "pin", magnitude = "0.025 mm"}]

"""
#: Its lattice: by default, and sheets below a skin, where the window begins at what 8 GB hold.
LATTICES = {
    "network": """
[lattice]
cell = "gyroid-network"
size = "15 mm"
""",
    "skin": """
[lattice]
cell = "gyroid-sheet"
size = "20 mm"
density = [0.2, 0.6]
skin = "2 mm"
""",
}


@pytest.mark.slow
@pytest.mark.timeout(2 * 3600)
@pytest.mark.skipif(not FEATURETYPE.is_file(), reason=f"{FEATURETYPE.name} is not beside the clone")
@pytest.mark.parametrize("lattice", LATTICES)
def test_a_part_in_inches_reaches_a_verdict_with_default_settings(tmp_path, lattice):
    (tmp_path / "featuretype.stl").write_bytes(FEATURETYPE.read_bytes())
    (tmp_path / "case.toml").write_text(CASE + LATTICES[lattice], encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    assert (result.status, result.lightest) == ("met", True)
    assert max(row.utilisation for row in result.limits) >= 0.97
    # Volume of the part 190,733 mm^3 by trimesh on the file, of Ti-6Al-4V with 4.41e-9 t/mm^3.
    solid = trimesh.load_mesh(FEATURETYPE).volume * 25.4**3 * 4.41e-3
    np.testing.assert_allclose(result.solid_mass_g, solid, rtol=1e-3)
    printed = trimesh.load_mesh(result.folder / "lattice.stl")
    assert printed.is_watertight
    # The analysed mesh may hold up to 4 % less or more than the field that both are made of.
    np.testing.assert_allclose(printed.volume * 4.41e-3, result.mass_g, rtol=0.04)

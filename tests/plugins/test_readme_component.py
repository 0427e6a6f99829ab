"""The component in plugins/README.md, as it stands there: from the case file to the sized part."""

import re
import sys
import types
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from small_parts import SHORT_BAR

import gradedesign
from gradedesign.errors import CaseError, PluginError
from gradedesign.program.host.read_case import load_case
from gradedesign.program.host.registry import build_registry
from gradedesign.testing import check_component

README = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
#: A bar of 16 x 8 x 8 mm.
CASE = (
    SHORT_BAR[: SHORT_BAR.index("[[keep]]")].replace('"4 mm"', '"1.5 mm"')
    + """
[[load_case]]
name = "down"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-200 N"]}]
[limits]
stress = "100 MPa"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
grading = "uniform"
density = [0.3, 0.3]
[[lattice.core]]
radius = 3.0
[run]
stop_after = "sizing"
[output]
formats = []
"""
)


@pytest.fixture(scope="module")
def plugin():
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (text,) = (block for block in blocks if "def gradedesign_components" in block)
    module = types.ModuleType("gradedesign_acme_core")
    sys.modules[module.__name__] = module
    exec(compile(text, "gradedesign_acme_core", "exec"), module.__dict__)
    yield module
    del sys.modules[module.__name__]


@pytest.fixture(scope="module")
def registry(plugin):
    import gradedesign_cells_tpms

    return build_registry(plugins=[gradedesign_cells_tpms, plugin])


def written(folder, text=CASE):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


def test_a_plugins_component_is_in_the_mass_of_the_sized_part(tmp_path, registry):
    case = load_case(written(tmp_path), registry=registry)
    result = gradedesign.run(case, registry, folder=tmp_path / "run")
    ball, bar = 4 / 3 * np.pi * 3.0**3, 16 * 8 * 8
    # The ball is taken as linear in pieces of 0.4 mm: a polyhedron, too small by some per cent.
    assert result.relative_density == pytest.approx((ball + 0.3 * (bar - ball)) / bar, rel=0.01)


def test_it_passes_the_kit_and_others_do_not(plugin):
    upper = (16.0, 8.0, 8.0)
    core = plugin.Core(name="core", centre=(8.0, 4.0, 4.0), radius=3.0)
    check_component(core, (0, 0, 0), upper)
    with pytest.raises(PluginError, match="holds no place"):
        check_component(replace(core, centre=(40.0, 4.0, 4.0)), (0, 0, 0), upper)
    with pytest.raises(PluginError, match="least thickness of 0 mm"):
        check_component(Flat(name="flat"), (0, 0, 0), upper)
    with pytest.raises(PluginError, match=r"changes by 1\.01 mm per mm; expected 1 at most"):
        check_component(Flat(name="steep", slope=1.01), (0, 0, 0), upper)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flat(gradedesign.SolidComponent):
    """The part below z = 4 mm, as thin as nothing."""

    slope: float = 1.0

    @property
    def least(self):
        return 0.0

    def distance(self, points, to_part):  # noqa: ARG002
        return self.slope * (points[2] - 4.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radius = 3.0", "radus = 3.0", "lattice.core[0].radus: unknown key"),
        ("lattice.core", "lattice.cor", 'did you mean "core"'),
        ("radius = 3.0", 'radius = "large"', "lattice.core[0].radius"),
    ],
)
def test_its_table_is_read_as_strictly_as_the_cores(tmp_path, registry, old, new, words):
    with pytest.raises(CaseError) as error:
        load_case(written(tmp_path, CASE.replace(old, new)), registry=registry)
    assert words in str(error.value)


def test_a_kind_cannot_take_a_key_of_the_core(plugin):
    taken = types.ModuleType("taken")
    taken.gradedesign_components = gradedesign.hookimpl(
        lambda: [
            gradedesign.ComponentKind(
                name="bevel", stage="solid", entry=plugin.CoreEntry, make=plugin.make
            )
        ]
    )
    taken.gradedesign_components.__name__ = "gradedesign_components"
    with pytest.raises(PluginError, match=r"'bevel' of .* has already"):
        build_registry(plugins=[taken])

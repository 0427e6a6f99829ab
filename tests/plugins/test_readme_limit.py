"""The kind of limit of plugins/README.md, made from its text: from a case to a sized lattice."""

import re
import sys
import types
from pathlib import Path

import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.errors import CaseError, PluginError
from gradedesign.program.host.read_case import load_case
from gradedesign.program.host.registry import build_registry

README = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")

CASE = (
    held_bar(box_part(40, 10, 10, 5), name="bar", load_case="down")
    + """\
[limits]
sag = [{region = "tip", at_most = "8 x solid"}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
grading = "uniform"
density = [0.1, 0.5]
[run]
stop_after = "sizing"
[output]
formats = []
"""
)


@pytest.fixture(scope="module")
def plugin():
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (text,) = (block for block in blocks if "def gradedesign_limits" in block)
    module = types.ModuleType("gradedesign_acme_mean")
    sys.modules[module.__name__] = module
    exec(compile(text, "gradedesign_acme_mean", "exec"), module.__dict__)
    yield module
    del sys.modules[module.__name__]


@pytest.fixture(scope="module")
def registry(plugin):
    import gradedesign_cells_tpms

    return build_registry(plugins=[gradedesign_cells_tpms, plugin])


def written(folder, text=CASE):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


def test_a_plugins_limit_goes_from_the_case_file_to_the_sized_lattice(tmp_path, registry):
    case = load_case(written(tmp_path), registry=registry)
    result = gradedesign.run(case, registry, folder=tmp_path / "run")
    (row,), (solid,) = result.limits, result.solid
    assert (row.name, row.load_case, row.unit) == ("sag of tip", "down", "mm")
    assert row.limit == pytest.approx(8 * solid.value)
    # Sizing aims at 99.8 % of a limit where no analysis follows, within 0.4 %.
    assert row.utilisation == pytest.approx(0.998, abs=0.005)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("at_most", "atmost", "limits.sag[0].atmost: unknown key"),
        ('"8 x solid"', '"3 N"', "limits.sag[0].at_most"),
        ("sag", "sagg", 'did you mean "sag"'),
        ('region = "tip", at', 'region = "tap", at', 'region "tap" is not defined'),
    ],
)
def test_its_table_is_read_as_strictly_as_the_cores(tmp_path, registry, old, new, words):
    with pytest.raises(CaseError) as error:
        load_case(written(tmp_path, CASE.replace(old, new)), registry=registry)
    assert words in str(error.value)


def test_its_limit_is_a_part_of_what_a_case_is(tmp_path, registry):
    one = load_case(written(tmp_path), registry=registry)
    other = load_case(written(tmp_path, CASE.replace("8 x", "9 x")), registry=registry)
    assert one.case_hash != other.case_hash
    assert one.model_dump_json() != other.model_dump_json()


def test_a_kind_cannot_take_a_key_of_the_core(plugin):
    taken = types.ModuleType("taken")
    taken.gradedesign_limits = gradedesign.hookimpl(
        lambda: [
            gradedesign.LimitKind(
                name="percentile", entry=plugin.SagEntry, make=plugin.make, stated=plugin.stated
            )
        ]
    )
    taken.gradedesign_limits.__name__ = "gradedesign_limits"
    with pytest.raises(PluginError, match=r"'percentile' of .* has already"):
        build_registry(plugins=[taken])

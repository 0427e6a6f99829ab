"""The registry: built by modules given here, so that nothing installed matters."""

import types

import numpy as np
import pytest

from gradedesign import CaseError, CellFamily, LawOrigin, PluginError, hookimpl, power_law
from gradedesign.design.resolve.choose_law import AUTO_KINDS, choose_law
from gradedesign.design.resolve.registry import lookup
from gradedesign.mechanics.material.scaling_law import has_strength
from gradedesign.program.host.registry import build_registry


def shape(u):
    return np.cos(2 * np.pi * u).sum(axis=0)


def plugin(name, **hooks):
    """A module whose hooks return the given records."""
    module = types.ModuleType(name)
    for hook, records in hooks.items():
        namespace = {}
        exec(f"def gradedesign_{hook}():\n    return RECORDS", {"RECORDS": records}, namespace)
        setattr(module, f"gradedesign_{hook}", hookimpl(namespace[f"gradedesign_{hook}"]))
    return module


def cell(name):
    return CellFamily(name=name, shape=shape)


def law(name, window=(0.1, 0.5), kind="fe", families=("cube",), c3=0.4):
    return power_law(
        name,
        families,
        youngs=(0.4, 1.2),
        strength=None if c3 is None else (c3, 1.5),
        window=window,
        origin=LawOrigin(kind=kind, source="s", test="t"),
    )


def test_built_in_records_come_without_plugins():
    registry = build_registry(plugins=[])
    assert "stl" in registry.readers
    assert "stl" in registry.exporters
    assert "Ti-6Al-4V" in registry.materials
    assert not registry.cell_families
    assert registry.sources["readers"]["stl"].startswith("gradedesign ")
    assert [p.entry_point for p in registry.plugins] == ["builtin"]


def test_records_are_sorted_and_read_only_whatever_the_order():
    one, two = (
        plugin("one", cell_families=[cell("b"), cell("c")]),
        plugin("two", cell_families=[cell("a")]),
    )
    for modules in ([one, two], [two, one]):
        registry = build_registry(plugins=modules)
        assert list(registry.cell_families) == ["a", "b", "c"]
        assert registry.sources["cell_families"]["a"] == "module two"
    with pytest.raises(TypeError):
        registry.cell_families["d"] = cell("d")


def test_registries_share_nothing():
    build_registry(plugins=[plugin("one", cell_families=[cell("a")])])
    assert not build_registry(plugins=[]).cell_families


def test_a_name_supplied_twice_names_both_sources():
    modules = [
        plugin("first", cell_families=[cell("a")]),
        plugin("second", cell_families=[cell("a")]),
    ]
    with pytest.raises(PluginError, match=r"'a'.*first.*second"):
        build_registry(plugins=modules)


def test_a_built_in_name_cannot_be_taken():
    reader = build_registry(plugins=[]).readers["stl"]
    with pytest.raises(PluginError, match=r"'stl'.*gradedesign"):
        build_registry(plugins=[plugin("mine", readers=[reader])])


def test_a_law_of_a_cell_that_does_not_exist_is_named(caplog):
    mine = plugin(
        "mine", cell_families=[cell("cube")], scaling_laws=[law("odd", families=("cub",))]
    )
    registry = build_registry(plugins=[mine])
    assert "odd" in registry.scaling_laws
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert "law 'odd' of module mine describes cell 'cub'" in record.message
    assert 'did you mean "cube"?' in record.message
    with pytest.raises(PluginError, match=r"law 'odd'.*'cub'"):
        build_registry(plugins=[mine], strict=True)


def test_a_law_of_another_plugins_cell_is_no_warning(caplog):
    cells = plugin("cells", cell_families=[cell("cube")])
    build_registry(plugins=[plugin("laws", scaling_laws=[law("one")]), cells], strict=True)
    assert not caplog.records


@pytest.mark.parametrize("name", ["Gyroid", "two words", "-a", "a--b", "a_b", "", None, 3])
def test_invalid_names_are_refused(name):
    with pytest.raises(PluginError, match="invalid name"):
        build_registry(plugins=[plugin("bad", cell_families=[cell(name)])])


def test_wrong_records_are_refused():
    with pytest.raises(PluginError, match=r"returned a str, expected CellFamily"):
        build_registry(plugins=[plugin("bad", cell_families=["cube"])])


def test_a_misspelt_hook_is_refused():
    with pytest.raises(PluginError, match="gradedesign_cell_familys"):
        build_registry(plugins=[plugin("bad", cell_familys=[cell("a")])])


def test_a_hook_with_arguments_is_refused():
    module = types.ModuleType("bad")

    @hookimpl
    def gradedesign_cell_families(size):
        return [size]

    module.gradedesign_cell_families = gradedesign_cell_families
    with pytest.raises(PluginError, match="does not match a hook"):
        build_registry(plugins=[module])


def test_a_module_given_twice_is_refused():
    module = plugin("one", cell_families=[cell("a")])
    with pytest.raises(PluginError, match="twice"):
        build_registry(plugins=[module, module])


def raising():
    module = types.ModuleType("raising")

    @hookimpl
    def gradedesign_cell_families():
        yield cell("half")
        raise OSError("table is missing")

    module.gradedesign_cell_families = gradedesign_cell_families
    return module


def test_a_hook_that_raises_disables_its_plugin_only(caplog):
    registry = build_registry(plugins=[raising(), plugin("good", cell_families=[cell("a")])])
    assert list(registry.cell_families) == ["a"]
    (failure,) = registry.failures
    assert "OSError: table is missing" in str(failure)
    assert "table is missing" in caplog.text
    assert "raising" not in [p.entry_point for p in registry.plugins]
    with pytest.raises(PluginError, match="table is missing"):
        build_registry(plugins=[raising()], strict=True)


def test_lookup_finds_or_suggests():
    registry = build_registry(plugins=[plugin("one", cell_families=[cell("gyro-sheet")])])
    assert lookup(registry, "cell_families", "gyro-sheet").name == "gyro-sheet"
    with pytest.raises(CaseError, match=r"did you mean \"gyro-sheet\"\?"):
        lookup(registry, "cell_families", "gyro-shet")
    with pytest.raises(CaseError, match=r"no material named 'mud'.*PA12"):
        lookup(registry, "materials", "mud")


def test_lookup_blames_a_disabled_plugin():
    registry = build_registry(plugins=[raising()])
    with pytest.raises(PluginError, match=r"no cell family named 'half'.*table is missing"):
        lookup(registry, "cell_families", "half")


LAWS = [
    law("a-test", kind="experiment"),
    law("b-narrow", window=(0.2, 0.3)),
    law("c-wide"),
    law("d-wide"),
    law("e-stiffness-only", window=(0.01, 0.9), c3=None),
    law("f-other", families=("octahedron",)),
]


@pytest.fixture(scope="module")
def laws():
    return build_registry(plugins=[plugin("laws", scaling_laws=LAWS)])


def test_auto_prefers_coverage_then_name_and_never_experiments(laws):
    assert AUTO_KINDS == ("computed", "fe")
    assert choose_law(laws, "cube", "auto", (0.1, 0.5)).name == "c-wide"
    assert choose_law(laws, "cube", "auto", (0.22, 0.28)).name == "b-narrow"
    assert choose_law(laws, "cube", "auto", (0.3, 0.6)).name == "c-wide"


def test_auto_prefers_computed_laws():
    computed = law("z-computed", window=(0.3, 0.35), kind="computed")
    registry = build_registry(plugins=[plugin("laws", scaling_laws=[*LAWS, computed])])
    assert choose_law(registry, "cube", "auto", (0.1, 0.5)).name == "z-computed"
    assert choose_law(registry, "cube", "auto", (0.1, 0.2)).name == "c-wide"


def test_laws_by_name(laws):
    assert choose_law(laws, "cube", "a-test", (0.1, 0.5)).kind == "experiment"
    assert choose_law(laws, "cube", "e-stiffness-only", (0.1, 0.5)).name == "e-stiffness-only"
    assert not has_strength(laws.scaling_laws["e-stiffness-only"])


@pytest.mark.parametrize(
    ("family", "name", "density", "error", "message"),
    [
        ("cube", "c-wid", (0.1, 0.5), CaseError, 'did you mean "c-wide"'),
        ("cube", "f-other", (0.1, 0.5), CaseError, "describes octahedron, not 'cube'"),
        ("sphere", "auto", (0.1, 0.5), CaseError, "laws that can be named: none"),
        ("cube", "auto", (0.6, 0.8), CaseError, "c-wide 0.1 to 0.5"),
        ("cube", "b-narrow", (0.4, 0.5), CaseError, "b-narrow 0.2 to 0.3"),
    ],
)
def test_impossible_choices_list_what_exists(laws, family, name, density, error, message):
    with pytest.raises(error, match=message):
        choose_law(laws, family, name, density)

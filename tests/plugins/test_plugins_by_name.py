"""What nothing installed supplies is named with the plugin of this project that has it."""

import sys
from importlib import metadata
from pathlib import Path

import pytest

from gradedesign import CaseError
from gradedesign.common.values import plugins_by_name
from gradedesign.design.resolve.registry import lookup
from gradedesign.program.host.command import COMMAND_GROUP, load_command
from gradedesign.program.host.markers import GROUP
from gradedesign.program.host.registry import build_registry

ROOT = Path(__file__).parents[2]
TABLE = plugins_by_name._plugins()
OURS = {path.name for path in (ROOT / "plugins").iterdir() if path.is_dir()}


def installed_commands():
    """Commands of the installed plugins of this project, by plugin; each can be loaded."""
    found = {}
    for point in metadata.entry_points(group=COMMAND_GROUP):
        assert load_command(point.name).name == point.name
        if point.dist.name in OURS:
            found.setdefault(point.dist.name, []).append(point.name)
    return {plugin: sorted(names) for plugin, names in found.items()}


def registered(kind):
    """What the installed plugins of this project register, by plugin."""
    if kind == "commands":
        return installed_commands()
    registry = build_registry()
    of_readers = kind in ("suffixes", "keys")
    sources = registry.sources["readers" if of_readers else kind]
    found = {}
    for name, source in sources.items():
        plugin = source.split()[0]
        if plugin in OURS:
            names = (name,)
            if of_readers:
                reader = registry.readers[name]
                names = reader.suffixes if kind == "suffixes" else [f"part.{reader.key}"]
                names = names if kind == "suffixes" or reader.key else ()
            if names:
                found.setdefault(plugin, set()).update(names)
    return {plugin: sorted(names) for plugin, names in found.items()}


@pytest.mark.parametrize("kind", sorted(TABLE))
def test_the_table_holds_what_the_plugins_register(kind):
    loaded = {source.distribution for source in build_registry().plugins}
    expected = {plugin: sorted(names) for plugin, names in TABLE[kind].items() if plugin in loaded}
    assert registered(kind) == expected
    assert set(TABLE[kind]) <= OURS


def test_other_kinds_come_with_the_core():
    """But for laws, whose cells are told first, and readers, told by suffix."""
    registry = build_registry()
    told = {*TABLE, "scaling_laws", "readers"}
    others = {
        source.split()[0]
        for kind, sources in registry.sources.items()
        if kind not in told
        for source in sources.values()
    }
    assert others & OURS == set()


INSTALLED = sorted(OURS & {point.dist.name for point in metadata.entry_points(group=GROUP)})


@pytest.mark.parametrize("gone", INSTALLED)
def test_without_any_one_plugin_all_others_work_and_what_is_missing_is_named(monkeypatch, gone):
    """As ``pip uninstall`` leaves it: neither its entry points nor its modules are there."""
    before, points_of, version_of = build_registry(), metadata.entry_points, metadata.version
    package = gone.replace("-", "_")
    for name in [n for n in sys.modules if n.split(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)  # importing it raises ModuleNotFoundError

    def version(name):
        if name == gone:
            raise metadata.PackageNotFoundError(name)
        return version_of(name)

    def points(**chosen):
        return [point for point in points_of(**chosen) if point.dist.name != gone]

    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setattr(metadata, "entry_points", points)
    registry = build_registry(strict=True)
    assert registry.failures == ()
    for kind, sources in before.sources.items():
        others = {name for name, source in sources.items() if source.split()[0] != gone}
        assert set(registry.sources[kind]) == others, kind
    for kind, of in TABLE.items():
        for name in of.get(gone, ()):
            assert plugins_by_name.supplied_by(kind, name) == f"install the plugin {gone}"
    installed_commands()


@pytest.fixture
def nothing_installed(monkeypatch):
    version_of = metadata.version

    def version(name):
        if name in OURS:
            raise metadata.PackageNotFoundError(name)
        return version_of(name)

    monkeypatch.setattr(plugins_by_name.metadata, "version", version)


CASE = """\
[case]
name = "block"
[part]
{part}
[lattice]
cell = "octet"
size = "5 mm"
density = 0.3
"""
BOX = 'box = ["10 mm", "5 mm", "5 mm"]'


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize(
    ("part", "words"),
    [
        (BOX, "lattice.cell: no cell family named 'octet'; install the plugin "
         "gradedesign-cells-strut"),
        ('file = "block.stp"', 'found "block.stp", which no installed reader takes; install the '
         "plugin gradedesign-step; or export it as STL"),
        ('file = "block.obj"', 'found "block.obj", which no installed reader takes; install the '
         "plugin gradedesign-formats; or export it as STL"),
        ('file = "block.3mf"', 'found "block.3mf", which no installed reader takes; install the '
         "plugin gradedesign-formats; or export it as STL"),
        ('file = "scan.nrrd"\n[part.voxels]\nthreshold = 3',
         "case.toml:5: part.voxels: unknown key; install the plugin gradedesign-volumes"),
        ('file = "scan.nrrd"', 'found "scan.nrrd", which no installed reader takes; install the '
         "plugin gradedesign-volumes"),
        ('file = "block.stl"\nunits = "mm"\nrepair = "pymeshlab"',
         'part.repair: found "pymeshlab"; install the plugin gradedesign-pymeshlab'),
        (BOX + '\n[output]\nformats = ["stl", "cli-binary"]',
         "case.toml:6: output.formats: no format named 'cli-binary'; install the plugin "
         "gradedesign-layers"),
        (BOX + '\n[output]\nformats = ["inp"]',
         "output.formats: no format named 'inp'; install the plugin gradedesign-calculix"),
    ],
    ids=["cell", "reader", "mesh", "3mf", "key", "scan", "repairer", "exporter", "output"],
)  # fmt: skip
def test_a_case_that_needs_a_plugin_is_told_which(tmp_path, cli, monkeypatch, part, words):
    monkeypatch.setenv("GRADEDESIGN_DISABLE_PLUGINS", "1")
    for name in ("block.stp", "block.stl", "block.obj", "block.3mf", "scan.nrrd"):
        (tmp_path / name).write_text("", encoding="utf-8")
    (tmp_path / "case.toml").write_text(CASE.format(part=part), encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 2
    assert words in " ".join(ended.err.split())


@pytest.mark.usefixtures("nothing_installed")
def test_a_body_in_a_format_of_a_plugin_is_told_which(tmp_path, cli, monkeypatch):
    monkeypatch.setenv("GRADEDESIGN_DISABLE_PLUGINS", "1")
    (tmp_path / "core.glb").write_text("", encoding="utf-8")
    text = CASE.format(part=BOX).replace('"octet"', '"own"')
    formula = " + ".join(f"cos(2*pi*{axis})" for axis in "xyz")
    text += f'[lattice.own_cell]\nmaker = "formula"\nformula = "{formula}"\n'
    text += '[[keep]]\nname = "core"\nbody = { file = "core.glb", units = "mm" }\n'
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture")
    words = " ".join(ended.err.split())
    assert "found core.glb, which no reader takes; install the plugin gradedesign-formats" in words


@pytest.mark.usefixtures("nothing_installed")
def test_a_density_map_of_a_plugin_is_told_which(tmp_path, cli, monkeypatch):
    monkeypatch.setenv("GRADEDESIGN_DISABLE_PLUGINS", "1")
    (tmp_path / "map.csv").write_text("", encoding="utf-8")
    text = CASE.format(part=BOX).replace('"octet"', '"own"').replace("density = 0.3\n", "")
    formula = " + ".join(f"cos(2*pi*{axis})" for axis in "xyz")
    text += '[lattice.density_map]\npoints = "map.csv"\n'
    text += f'[lattice.own_cell]\nmaker = "formula"\nformula = "{formula}"\n'
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture")
    words = " ".join(ended.err.split())
    assert "lattice.density_map.points: no reader of fields named 'points'; install the" in words
    assert "plugin gradedesign-volumes" in words


def test_a_plugin_that_is_installed_but_not_loaded_is_not_asked_for(monkeypatch):
    monkeypatch.setenv("GRADEDESIGN_DISABLE_PLUGINS", "1")
    with pytest.raises(CaseError, match="is installed but not loaded: GRADEDESIGN_DISABLE_PLUGINS"):
        lookup(build_registry(), "cell_families", "octet")
    with pytest.raises(CaseError, match="no cell family named 'octett'; available: none"):
        lookup(build_registry(), "cell_families", "octett")


@pytest.mark.usefixtures("nothing_installed")
def test_a_command_that_needs_a_plugin_is_told_which(cli, monkeypatch):
    monkeypatch.setenv("GRADEDESIGN_DISABLE_PLUGINS", "1")
    for words in (("sweep", "study.toml"), ("schema", "--study")):
        ended = cli(*words)
        assert ended.code == 2
        assert "no command named 'sweep'; install the plugin gradedesign-sweep" in ended.err
    assert "sweep" not in cli("--help").out
    assert "No such command" in cli("swep").err

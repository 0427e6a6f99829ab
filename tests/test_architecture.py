"""The design, checked on the source: direction of imports, place of heavy libraries, hooks."""

import ast
import doctest
import importlib
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import FunctionType

import pytest

import gradedesign
import gradedesign.fields
import gradedesign.properties
import gradedesign.testing
from gradedesign.program.host import hookspecs

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "gradedesign"

#: Rooms in the order of imports: a module imports only from rooms before its own, and from its own.
ROOMS = (
    "errors", "arrays",
    "common/values", "common/system",
    "geometry/fields", "geometry/triangles", "geometry/tets", "geometry/part", "geometry/cell",
    "geometry/maps", "geometry/contour", "geometry/lattice", "geometry/formats", "fields",
    "mechanics/material", "mechanics/solver", "mechanics/fe", "mechanics/finite_cell",
    "mechanics/homogenise", "mechanics/limits", "mechanics/sizing", "mechanics/explicit",
    "design/printing", "design/case", "design/acceptance", "design/resolve", "design/loop",
    "design/check", "design/verdict",
    "program/store", "program/pictures", "program/outputs", "program/host",
    "pipeline", "testing", "program/commands", "commands", "properties", "__main__",
)  # fmt: skip

#: Where each heavy library may be imported at all.
HEAVY = {
    "skfem": ("mechanics/fe", "geometry/part", "geometry/tets/long_edges.py"),
    "pytetwild": ("geometry/tets/_tetwild_worker.py",),
    "vtk": (),
    "vtkmodules": (),
    "pyvista": (),
    "matplotlib": ("program/pictures",),
    "skimage": (),
    "igl": (),
    "filelock": ("program/store", "common/system"),
    "platformdirs": ("common/system",),
    "jinja2": ("program/outputs",),
    "meshio": ("geometry/formats",),
    "trimesh": ("program/pictures/without_octant.py",),
    "manifold3d": ("geometry/triangles", "geometry/part"),
    "pymeshlab": (),
}

#: Libraries that importing the command line must not load: they cost seconds.
LAZY = ("pytetwild", "vtk", "vtkmodules", "pyvista", "matplotlib", "trimesh", "igl", "jinja2")

#: What plugins may import of the core.
PUBLIC = (
    "gradedesign", "gradedesign.commands", "gradedesign.fields", "gradedesign.properties",
    "gradedesign.testing",
)  # fmt: skip

#: Files of the core with a name that holds the word, which may only become fewer: 60 and 115 when a
#: solid was made of six typed tuples. Other things are kept as well, such as free unknowns.
MOST_FILES_WITH_SKIN, MOST_FILES_WITH_KEEP = 18, 45

MODULES = sorted(path for path in SOURCE.rglob("*.py"))
PLUGIN_MODULES = sorted((ROOT / "plugins").glob("*/src/**/*.py"))


@cache
def parsed(path):
    """Syntax tree of a file, read once for all tests."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports(path):
    """Names of the modules a file imports, those only for type checking left out."""
    found = []

    def visit(node):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        if isinstance(node, ast.Import):
            found.extend(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            # `from gradedesign.mechanics import fe` imports a module, `... .fe.x import y` too.
            found.append(node.module)
            found.extend(f"{node.module}.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(parsed(path))
    return found


def place(path):
    """Room of a file: its entry in ROOMS."""
    return room_of(path.relative_to(SOURCE).with_suffix("").parts)


def room_of(parts):
    """Room of a module, from the parts of its name below the package."""
    inside = "/".join(parts[:2])
    return inside if inside in ROOMS else parts[0]


def short(path):
    return str(path.relative_to(ROOT))


def of_all(violations, paths):
    """Whatever is wrong with any file; in one test, since thousands of tests cost half a minute."""
    assert len(paths) > 50
    return [words for path in paths for words in violations(path)]


def not_upward(path):
    """Imports of a module of the core from a later room than its own, and those without a room."""
    here = place(path)
    if here == "__init__" or path.relative_to(SOURCE).match("*/__init__.py"):
        return
    if here not in ROOMS:
        yield f"{short(path)}: {here} has no place in the design"
        return
    for name in imports(path):
        parts = name.split(".")
        if parts[0] != "gradedesign":
            continue
        if len(parts) == 1:
            yield f"{short(path)} imports the package itself"
            continue
        room = room_of(parts[1:])
        if room not in ROOMS:
            if not hasattr(gradedesign, parts[1]) or len(parts) > 2:
                yield f"{short(path)} imports {name}"
        elif (
            ROOMS.index(room) > ROOMS.index(here)
            and (SOURCE / "/".join(parts[1:])).with_suffix(".py").is_file()
        ):
            yield f"{path.relative_to(SOURCE)} -> {name}"


def test_imports_point_to_earlier_rooms():
    assert of_all(not_upward, MODULES) == []


def test_every_room_says_what_it_is():
    rooms = [SOURCE / room for room in ROOMS if "/" in room]
    for folder in {*rooms, *(room.parent for room in rooms)}:
        assert ast.get_docstring(parsed(folder / "__init__.py")), folder
    assert sorted({p.parent for p in MODULES if p.parent.parent.parent == SOURCE}) == sorted(rooms)


def crossing_names():
    """Names that a room defines and files of other rooms import, by room."""
    found = {room: set() for room in ROOMS if "/" in room}
    for path in MODULES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("gradedesign."):
                room = room_of(node.module.split(".")[1:])
                if room in found and room != place(path):
                    found[room] |= {alias.name for alias in node.names}
    return found


#: Names that cross the walls of rooms: fewer is a house understood sooner. Lower it where it falls.
#: Natural frequencies and solid members, whose stages are sizing, bodies and rows, brought ten; the
#: scene, which shows what every room finds, eighteen; what other bodies weigh four; members within
#: tetrahedra and void eight; processes and as-built bodies, fourteen.
#: Buckling of the part brought five. Still and figure in the page of `compare` brought two; records
#: that show themselves in notebooks, eight; cases of a suite in processes of their own, four;
#: energies by moments of the stiffness, from which those of all members follow at once, one;
#: records of coupons, which two tables of a case name, one.
#: Bodies made elsewhere, which are read, measured and judged, brought eight; names that the shell
#: completes, two, less one by a single way to draw; questions of a new case with proposals, ten.
#: Sections of the report that plugins add, with their tables and those built in, three.
CROSSING = 1111


def test_rooms_have_doors_and_few_other_names_cross_their_walls():
    """A room's docstring names what it is understood by; the rest is for its neighbours."""
    crossing = crossing_names()
    for room, names in crossing.items():
        _, _, door = ast.get_docstring(parsed(SOURCE / room / "__init__.py")).partition("Door: ")
        listed = re.findall(r"`(\w+)`", door.partition("\n\n")[0])
        assert 1 <= len(listed) <= 8, room
        assert [name for name in listed if name not in names] == [], room
    assert sum(map(len, crossing.values())) <= CROSSING


def test_the_order_of_the_test_sees_an_upward_import(tmp_path):
    wrong = tmp_path / "x.py"
    wrong.write_text(
        "from gradedesign.program.commands import app\nimport gradedesign.mechanics.fe.space\n"
    )
    assert "gradedesign.program.commands" in imports(wrong)
    assert "gradedesign.mechanics.fe.space" in imports(wrong)


def test_only_the_pipeline_and_the_command_line_use_plugins():
    users = {
        place(p)
        for p in MODULES
        if any(n.startswith("gradedesign.program.host") for n in imports(p))
    }
    allowed = {"program/host", "pipeline", "program/commands"}
    assert users <= allowed | {"commands", "__init__"}


def kernels_with(*arguments):
    """Files that hold a compiled function with all these arguments."""
    return {
        path.stem
        for path in MODULES
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.FunctionDef)
        and set(arguments) <= {argument.arg for argument in node.args.args}
    }


def test_triangles_are_looked_for_by_one_tree_and_one_grid_classifier():
    """Nodes of a tree, and lists of triangles by place, are known to these kernels only."""
    assert kernels_with("right", "first", "count") == {
        "_tree_kernels", "_closest_kernels", "_ray_kernels", "_winding_kernels",
        "_crossing_kernels", "_contact_kernels",
    }  # fmt: skip
    assert kernels_with("corners", "first", "member") == {"_grid_kernels"}
    doors = {"triangle_tree", "winding", "grid_classifier"}
    kernels = ("tree", "ray", "winding", "grid")
    names = tuple(f"triangles._{kernel}_kernels" for kernel in kernels)
    users = {p.stem for p in MODULES if any(n.endswith(names) for n in imports(p))}
    assert {u for u in users if not u.endswith("_kernels")} == doors


@pytest.mark.parametrize("library", HEAVY)
def test_heavy_libraries_have_their_place(library):
    for path in MODULES:
        if any(name.split(".")[0] == library for name in imports(path)):
            inside = path.relative_to(SOURCE).as_posix()
            assert any(inside == p or inside.startswith(f"{p}/") for p in HEAVY[library]), (
                f"{short(path)} imports {library}"
            )


def test_importing_the_core_loads_nothing_heavy():
    code = (
        "import sys, gradedesign, gradedesign.pipeline, gradedesign.testing\n"
        "import gradedesign.program.commands\n"
        f"print(*sorted(set(sys.modules) & set({LAZY!r})))"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert result.stdout.split() == []


def test_every_public_name_has_its_home():
    assert sorted(gradedesign._MODULES) == sorted(gradedesign.__all__)
    assert all(hasattr(gradedesign, name) for name in gradedesign.__all__)


#: Most arguments and lines of a function, its docstring apart, and most lines of a file.
#: Kernels and command lines have the arguments and lines that they need; a longer file says why in
#: its first lines, in a sentence that names this number.
MOST_ARGUMENTS, MOST_LINES, LONG_FILE = 8, 60, 300


def functions(path):
    """Functions of a file that are no kernels."""
    if path.stem.endswith("_kernels"):
        return
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.FunctionDef) and not any(
            "njit" in ast.unparse(decorator) for decorator in node.decorator_list
        ):
            yield node


def lines(node):
    """Lines of a function without its docstring."""
    count = node.end_lineno - node.lineno + 1
    if ast.get_docstring(node) is None:
        return count
    return count - (node.body[0].end_lineno - node.body[0].lineno + 1)


def is_command_line(path):
    """Whether a file is of a command: ours, or ``command.py`` and ``run_...`` of a plugin."""
    of_plugin = path.stem == "command" or path.stem.startswith("run_")
    return path.is_relative_to(SOURCE / "program/commands") or (
        path in PLUGIN_MODULES and of_plugin
    )


def wide_or_long(path):
    """Functions of a module with too many arguments or lines."""
    if is_command_line(path):
        return
    for node in functions(path):
        stated = node.args
        count = len(stated.posonlyargs) + len(stated.args) + len(stated.kwonlyargs)
        where = f"{short(path)}:{node.lineno}: {node.name}"
        if count > MOST_ARGUMENTS:
            yield f"{where} takes {count} arguments; hand on a record"
        if lines(node) > MOST_LINES:
            yield f"{where} has {lines(node)} lines; split it"


def test_functions_are_narrow_and_short():
    assert of_all(wide_or_long, [*MODULES, *PLUGIN_MODULES]) == []


def unexplained_length(path):
    """A file that is long, its imports apart, and does not say why."""
    text = path.read_text(encoding="utf-8").splitlines()
    imported = [n for n in parsed(path).body if isinstance(n, ast.Import | ast.ImportFrom)]
    count = len(text) - sum(n.end_lineno - n.lineno + 1 for n in imported)
    if not (count <= LONG_FILE or is_command_line(path) or str(LONG_FILE) in "".join(text[:8])):
        yield f"{short(path)} has {count} lines; split it, or say why not in its first lines"


def names_in(path):
    """Every name that a file writes, words in strings and comments left out."""
    for node in ast.walk(parsed(path)):
        yield from (
            word
            for field in ("id", "attr", "name", "arg", "asname", "module")
            if isinstance(word := getattr(node, field, None), str)
        )


@pytest.mark.parametrize(
    ("word", "most"),
    [("skin", MOST_FILES_WITH_SKIN), ("passive|keep(?!dims|ends)", MOST_FILES_WITH_KEEP)],
)
def test_components_are_known_to_few_files(word, most):
    """A component stands in its own file; what others need of it is in the protocol."""
    found = [
        short(path)
        for path in MODULES
        if any(re.search(word, name, re.IGNORECASE) for name in names_in(path))
    ]
    assert len(found) <= most, "; ".join(found)


def test_long_files_say_why():
    assert of_all(unexplained_length, [*MODULES, *PLUGIN_MODULES]) == []


def is_number(node):
    """Whether an expression consists of numbers and operators, or of tuples of them."""
    parts = (ast.Constant, ast.operator, ast.unaryop, ast.BinOp, ast.UnaryOp, ast.Tuple, ast.Load)
    values = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)]
    plain = all(isinstance(n, parts) for n in ast.walk(node))
    return plain and bool(values) and all(type(v) in (int, float) for v in values)


def unexplained_constants(path, text=None):
    """Numbers of a module that have no comment above them, alone or with those before them."""
    text = path.read_text(encoding="utf-8") if text is None else text
    rows, explained = text.splitlines(), set()
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value and is_number(node.value):
            above, last = node.lineno - 2, node.end_lineno - 1
            if rows[above].startswith("#") or above in explained or "  # " in rows[last]:
                explained.add(last)
            else:
                target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
                yield f"{path.name}: {ast.unparse(target)}"


def test_constants_say_why():
    found = of_all(unexplained_constants, MODULES)
    assert found == [], "say why it has its value, or 'Chosen, not measured.'"


def test_a_constant_without_a_word_is_found():
    text = "#: Why.\nA = 1\nB = -2.5\n\nC, D = 3, 4\nE = 'text'\nF = 2**10  # bytes\n"
    assert list(unexplained_constants(Path("a.py"), text)) == ["a.py: (C, D)"]


#: Records of which most functions need one part: how many take one whole, and how many
#: expressions climb through the case that another record holds (`model.plan.case.run.time`).
#: Both may only become fewer.
WHOLE = {"Case", "Plan", "DesignModel"}
MOST_WHOLE, MOST_CLIMBS = 95, 30


def taken_whole(path):
    """Parameters of a module's functions that are such records of the design."""
    names = {
        alias.asname or alias.name
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.ImportFrom) and node.module.startswith("gradedesign.design")
        for alias in node.names
        if alias.name in WHOLE
    }
    if place(path).startswith("design"):
        names |= {n.name for n in ast.walk(parsed(path)) if isinstance(n, ast.ClassDef)} & WHOLE
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.FunctionDef):
            stated = node.args
            for one in (*stated.posonlyargs, *stated.args, *stated.kwonlyargs):
                words = () if one.annotation is None else ast.walk(one.annotation)
                if any(getattr(word, "id", "") in names for word in words):
                    yield f"{short(path)}:{node.lineno}: {node.name}({one.arg})"


def climbs(path):
    """Expressions of a module that read a field of a record's case."""
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Attribute) and getattr(node.value, "attr", "") == "case":
            yield f"{short(path)}:{node.lineno}: {ast.unparse(node)}"


def test_stages_take_what_they_use(tmp_path, monkeypatch):
    """A function of a lower room gets its table of the case and `Where`, see docs/architecture."""
    assert len(of_all(taken_whole, MODULES)) <= MOST_WHOLE
    assert len(of_all(climbs, MODULES)) <= MOST_CLIMBS
    for name in ("ROOT", "SOURCE"):
        monkeypatch.setattr(sys.modules[__name__], name, tmp_path)
    file = tmp_path / "stage.py"
    file.write_text(
        "from gradedesign.design.case.schema import Case\nfrom elsewhere import Problem\n"
        "def f(one: Case | None, other: Problem): return one.case.run.time + other.run\n"
    )
    assert list(taken_whole(file)) == ["stage.py:3: f(one)"]
    assert list(climbs(file)) == ["stage.py:3: one.case.run"]


def test_the_count_leaves_docstrings_out():
    tree = ast.parse('def f(a):\n    """Doc.\n\n    More.\n    """\n    return a\n')
    assert lines(tree.body[0]) == 2


#: The primitives of a glTF file are no cells.
FAMILY_WORDS = re.compile(
    r"gyroid|schwar[tz]z?|diamond|(?<!gltf_)primitive(?!s)|neovius|\biwp\b|octet", re.IGNORECASE
)


def prose(tree):
    """Nodes that may name a cell: docstrings, and the examples of a schema."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield node.value
        if isinstance(node, ast.keyword) and node.arg == "examples":
            yield from ast.walk(node.value)


def families_named(path):
    """Names of cell families in the code of a module; prose may have them."""
    tree = parsed(path)
    allowed = {id(node) for node in prose(tree)}
    for node in ast.walk(tree):
        text = getattr(node, "id", None) or getattr(node, "name", None) or ""
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = "" if id(node) in allowed else node.value
        if FAMILY_WORDS.search(str(text)):
            yield f"{short(path)}:{node.lineno} names {text!r}"


def test_the_core_knows_no_family_by_name():
    assert of_all(families_named, MODULES) == []


def private_imports(path):
    """Imports of a plugin's module that are not public, or belong to another plugin."""
    own = path.relative_to(ROOT / "plugins").parts[2]
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            wrong = [a.name for a in node.names if a.name.startswith("gradedesign.")]
        elif not isinstance(node, ast.ImportFrom):
            continue
        elif node.module in PUBLIC:
            public = importlib.import_module(node.module).__all__
            wrong = sorted({a.name for a in node.names} - set(public))
        else:
            core = node.module.split(".")[0] == "gradedesign"
            other = node.module.startswith("gradedesign_") and not node.module.startswith(own)
            wrong = [node.module] if core or other else []
        if wrong:
            yield f"{short(path)}:{node.lineno} imports {', '.join(wrong)}"


def test_plugins_import_only_public_names():
    assert of_all(private_imports, PLUGIN_MODULES) == []


def test_what_is_wrong_with_a_file_is_found(monkeypatch, tmp_path):
    """Each of the checks above, on a file that breaks it."""
    here = sys.modules[__name__]
    core, plugin = tmp_path / "core", tmp_path / "plugins" / "gradedesign-x" / "src"
    monkeypatch.setattr(here, "ROOT", tmp_path)
    monkeypatch.setattr(here, "SOURCE", core)
    (core / "mechanics/fe").mkdir(parents=True)
    (core / "program/commands").mkdir(parents=True)
    (core / "program/commands/app.py").touch()
    wrong = core / "mechanics/fe" / "wrong.py"
    arguments = ", ".join(f"a{k}" for k in range(9))
    wrong.write_text(
        "from gradedesign.program.commands import app\nfrom gradedesign.cube import x\n"
        "import gradedesign\n"
        f"def wide({arguments}):\n" + "    a0 = 1\n" * 61 + "gyroid = 'octet'\n" + "\n" * 300
    )
    words = [*not_upward(wrong), *wide_or_long(wrong)]
    words += [*unexplained_length(wrong), *families_named(wrong)]
    for part in ("commands.app", "cube", "itself", "9 arguments", "62 lines", "363 lines",
                 "'gyroid'", "'octet'"):  # fmt: skip
        assert any(part in line for line in words), part
    (core / "lost.py").write_text("")
    assert list(not_upward(core / "lost.py")) == ["core/lost.py: lost has no place in the design"]
    (plugin / "gradedesign_x").mkdir(parents=True)
    mine = plugin / "gradedesign_x" / "a.py"
    mine.write_text(
        "import gradedesign.mechanics.fe\nfrom gradedesign import nothing, CellFamily\n"
        "from gradedesign.mechanics.fe import space\nfrom gradedesign_y import z\n"
        "from gradedesign_x import b\nimport ast\n"
    )
    assert [line.split("imports ")[1] for line in private_imports(mine)] == [
        "gradedesign.mechanics.fe", "nothing", "gradedesign.mechanics.fe", "gradedesign_y",
    ]  # fmt: skip


def test_every_hook_is_in_the_readme():
    readme = (ROOT / "plugins" / "README.md").read_text(encoding="utf-8")
    hooks = [name for name in vars(hookspecs) if name.startswith("gradedesign_")]
    assert len(hooks) >= 5
    for hook in hooks:
        assert f"`{hook}`" in readme, f"plugins/README.md does not explain {hook}"


def test_every_plugin_has_its_own_project_readme_and_tests():
    folders = [p.parent for p in (ROOT / "plugins").glob("*/pyproject.toml")]
    assert folders
    for folder in folders:
        assert (folder / "README.md").is_file()
        assert list((folder / "tests").glob("test_*.py"))
        project = (folder / "pyproject.toml").read_text(encoding="utf-8")
        assert "gradedesign>=0.1" in project
        assert "[project.entry-points.gradedesign]" in project


def docstrings(path):
    """Documented nodes of a module with their docstrings."""
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "lineno", 1), text


def test_docstrings_say_what_a_thing_is():
    """No docstring opens with "What ...": its first line names the thing or what is returned."""
    wrong = [
        f"{short(path)}:{line}"
        for path in MODULES + PLUGIN_MODULES
        for line, text in docstrings(path)
        if text.startswith("What ")
    ]
    assert wrong == []


def documented_modules():
    """Modules of the core with examples in their docstrings, importable without heavy libraries."""
    for path in MODULES:
        if ">>> " in path.read_text(encoding="utf-8"):
            parts = path.relative_to(SOURCE.parent).with_suffix("").parts
            yield ".".join(p for p in parts if p != "__init__")


@pytest.mark.parametrize("name", list(documented_modules()))
def test_examples_in_docstrings_run(name, monkeypatch):
    monkeypatch.chdir(ROOT)  # some read a case of the repository
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted > 0
    assert result.failed == 0


def missing_names(path):
    """Names that a script imports from the core and that are not there, wherever it does so."""
    for node in ast.walk(parsed(path)):
        if not (
            isinstance(node, ast.ImportFrom) and (node.module or "").startswith("gradedesign.")
        ):
            continue
        for name in (alias.name for alias in node.names):
            try:
                if not hasattr(importlib.import_module(node.module), name):
                    importlib.import_module(f"{node.module}.{name}")
            except ModuleNotFoundError:
                yield f"{short(path)}: {node.module}.{name}"


def test_scripts_import_what_exists(tmp_path, monkeypatch):
    """No test runs benchmarks or the makers of parts and figures; many import only when called."""
    scripts = [
        p for folder in ("benchmarks", "cases", "docs") for p in (ROOT / folder).rglob("*.py")
    ]
    assert len(scripts) > 25
    assert [name for path in scripts for name in missing_names(path)] == []
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path)
    script = tmp_path / "script.py"
    script.write_text(
        "def f():\n    from gradedesign.mechanics.fe.stress import von_mises, no_such\n"
    )
    assert list(missing_names(script)) == ["script.py: gradedesign.mechanics.fe.stress.no_such"]


def test_messages_of_the_library_name_no_option():
    """They are read in Python too; where a command prints them, it says the option."""
    option = re.compile(r"(?<![\w-])(?:--[a-z][a-z-]+|-o)(?![\w-])")
    wrong = []
    for path in MODULES:
        if "commands" in path.relative_to(SOURCE).parts:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        shown = {id(d) for node in ast.walk(tree) for d in [docstring_of(node)] if d is not None}
        for node in ast.walk(tree):
            text = node.value if isinstance(node, ast.Constant) else ""
            if not isinstance(text, str) or id(node) in shown or " " not in text:
                continue
            # A whole command may be named.
            if option.search(text) and "gradedesign " not in text:
                wrong.append(f"{short(path)}:{node.lineno}: {option.search(text)[0]}")
    assert wrong == []


def docstring_of(node):
    """The constant that holds the docstring of a node, or any text that stands alone."""
    return (
        node.value if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) else None
    )


#: Public functions whose example is not run: what each takes is made by a run or of hundreds of
#: numbers, or the function is a step of another one or the main part of a process of its own.
WITHOUT_EXAMPLE = {
    "check_component", "conjugate_gradients", "locked", "read_property_table", "require_read_back",
    "serve_mesher", "serve_repairer", "solid_surface", "tabulated_law",
}  # fmt: skip


def test_public_functions_have_examples():
    """What the API reference shows of each function is run by the test above."""
    doors = (gradedesign, gradedesign.fields, gradedesign.properties, gradedesign.testing)
    found = {
        name
        for door in doors
        for name in door.__all__
        if isinstance(thing := getattr(door, name), FunctionType)
        and ">>> " not in (thing.__doc__ or "")
    }
    assert found == WITHOUT_EXAMPLE

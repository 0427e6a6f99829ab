"""The design, checked on the source: direction of imports, place of heavy libraries, hooks."""

import ast
import doctest
import importlib
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import gradedesign
import gradedesign.fields
import gradedesign.testing
from gradedesign.plugin import hookspecs

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "gradedesign"

#: Direction of imports: a module imports only from above itself, or its own package.
ORDER = (
    "errors", "arrays", "fields", "workspace", "case", "mesh", "part", "material", "cell", "fe",
    "voxel", "homogenise", "limits", "sizing", "lattice", "finite_cell", "layout", "size_effects",
    "verify", "output", "plugin", "resolve", "loop", "results", "generate", "check", "pipeline",
    "sweep", "testing", "cli", "__main__",
)  # fmt: skip

#: Where each heavy library may be imported at all.
HEAVY = {
    "skfem": ("fe", "part", "mesh/long_edges.py"),
    "pytetwild": ("mesh/_tetwild_worker.py",),
    "vtk": ("output",),
    "vtkmodules": ("output",),
    "pyvista": ("output",),
    "matplotlib": ("output",),
    "skimage": (),
    "igl": (),
    "filelock": ("workspace",),
    "platformdirs": ("workspace",),
    "jinja2": ("output",),
    "meshio": ("output",),
    "trimesh": ("part/trimesh_formats.py", "output/trimesh_formats.py"),
    "manifold3d": ("mesh", "part"),
    "pymeshlab": (),
}

#: Libraries that importing the command line must not load: they cost seconds.
LAZY = ("pytetwild", "vtk", "vtkmodules", "pyvista", "matplotlib", "trimesh", "igl", "jinja2")

#: What plugins may import of the core.
PUBLIC = ("gradedesign", "gradedesign.fields", "gradedesign.testing")

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
            # `from gradedesign import fe` imports a module, `from gradedesign.fe.x import y` too.
            found.append(node.module)
            found.extend(f"{node.module}.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(parsed(path))
    return found


def place(path):
    """First part of a module's place below the package: its entry in ORDER."""
    return path.relative_to(SOURCE).parts[0].removesuffix(".py")


def short(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", MODULES, ids=short)
def test_imports_point_upwards(path):
    here = place(path)
    if here == "__init__":
        return
    assert here in ORDER, f"{here} has no place in the design"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] != "gradedesign" or len(parts) == 1:
            assert name != "gradedesign", f"{short(path)} imports the package itself"
            continue
        if parts[1] not in ORDER:
            assert hasattr(gradedesign, parts[1]), f"{short(path)} imports {name}"
            continue
        assert ORDER.index(parts[1]) <= ORDER.index(here), f"{short(path)} imports {name}"


def test_the_order_of_the_test_sees_an_upward_import(tmp_path):
    wrong = tmp_path / "x.py"
    wrong.write_text("from gradedesign.cli import app\nimport gradedesign.fe.space\n")
    assert "gradedesign.cli" in imports(wrong)
    assert "gradedesign.fe.space" in imports(wrong)


def test_only_the_pipeline_and_the_command_line_use_the_registry():
    users = {
        place(p) for p in MODULES if any(n.startswith("gradedesign.plugin") for n in imports(p))
    }
    assert users <= {
        "plugin", "resolve", "loop", "results", "generate", "check", "pipeline", "sweep", "cli",
        "__init__",
    }  # fmt: skip


def test_elasticity_knows_no_case_file():
    for path in sorted((SOURCE / "fe").rglob("*.py")):
        assert not [n for n in imports(path) if n.startswith("gradedesign.case")], short(path)


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
        "import sys, gradedesign, gradedesign.pipeline, gradedesign.testing, gradedesign.cli\n"
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
    return path.is_relative_to(SOURCE / "cli")


@pytest.mark.parametrize("path", [*MODULES, *PLUGIN_MODULES], ids=short)
def test_functions_are_narrow_and_short(path):
    if is_command_line(path):
        return
    for node in functions(path):
        stated = node.args
        count = len(stated.posonlyargs) + len(stated.args) + len(stated.kwonlyargs)
        where = f"{short(path)}:{node.lineno}: {node.name}"
        assert count <= MOST_ARGUMENTS, f"{where} takes {count} arguments; hand on a record"
        assert lines(node) <= MOST_LINES, f"{where} has {lines(node)} lines; split it"


@pytest.mark.parametrize("path", [*MODULES, *PLUGIN_MODULES], ids=short)
def test_long_files_say_why(path):
    text = path.read_text(encoding="utf-8").splitlines()
    assert len(text) <= LONG_FILE or is_command_line(path) or str(LONG_FILE) in "".join(text[:8]), (
        f"{short(path)} has {len(text)} lines; split it, or say why not in its first lines"
    )


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


@pytest.mark.parametrize("path", MODULES, ids=short)
def test_the_core_knows_no_family_by_name(path):
    tree = parsed(path)
    allowed = {id(node) for node in prose(tree)}
    for node in ast.walk(tree):
        text = getattr(node, "id", None) or getattr(node, "name", None) or ""
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = "" if id(node) in allowed else node.value
        assert not FAMILY_WORDS.search(str(text)), f"{short(path)}:{node.lineno} names {text!r}"


@pytest.mark.parametrize("path", PLUGIN_MODULES, ids=short)
def test_plugins_import_only_public_names(path):
    own = path.relative_to(ROOT / "plugins").parts[2]
    tree = parsed(path)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert not [a.name for a in node.names if a.name.startswith("gradedesign.")]
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "gradedesign":
            assert node.module in PUBLIC, f"{short(path)} imports from {node.module}"
            public = importlib.import_module(node.module).__all__
            assert {a.name for a in node.names} <= set(public), f"{short(path)}: {node.module}"
        elif isinstance(node, ast.ImportFrom):
            assert not node.module.startswith("gradedesign_") or node.module.startswith(own)


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
        if ">>> " in path.read_text(encoding="utf-8") and "_opengl" not in path.name:
            parts = path.relative_to(SOURCE.parent).with_suffix("").parts
            yield ".".join(p for p in parts if p != "__init__")


@pytest.mark.parametrize("name", list(documented_modules()))
def test_examples_in_docstrings_run(name):
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted > 0
    assert result.failed == 0

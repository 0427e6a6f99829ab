"""Nothing unreachable: functions and records that production uses, record fields that it reads.

Functions and classes are followed through their imports, methods and fields by name (a dead field
that shares its name with a living one is not seen). What only dead code uses is dead as well.
"""

import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = (ROOT / "src", *sorted((ROOT / "plugins").glob("*/src")))

#: Modules whose names are for others: what they list needs no user here.
PUBLIC = (
    "gradedesign", "gradedesign.commands", "gradedesign.fields",
    "gradedesign.properties", "gradedesign.testing", "gradedesign_cad",
)  # fmt: skip

#: Decorators that hand a function to a framework, which calls it.
CALLED_BY_FRAMEWORK = {
    "hookimpl", "hookspec", "command", "callback", "model_validator", "field_validator", "override",
}  # fmt: skip

#: Methods that notebooks, `reprlib` and users of a record call.
CALLED_BY_NAME = {"_repr_html_", "repr_ndarray", "repr_instance", "to_frame"}

#: Definitions that no code here names, each with its reader. A record stands for its fields.
ALLOWED = {
    # Written whole: result.json, `check --json`, the reports of cells and of the repair.
    "gradedesign.geometry.maps.map_report.MapReport": "result.json, cells of the layout",
    "gradedesign.geometry.maps.map_report.SizeError": "result.json, cells of the layout",
    "gradedesign.geometry.maps.map_report.Spread": "result.json, cells of the layout",
    "gradedesign.geometry.contour.islands.Islands": "result.json, islands_dropped",
    "gradedesign.design.loop.predicted_cost.CostPrediction": "check --json, stages",
    "gradedesign.design.loop.iteration_row.Iteration": "result.json, iterations",
    "gradedesign.geometry.part.repair.RepairReport": "check --json, repairs",
    "gradedesign.design.acceptance.body_comparison.BodyComparison": "result.json, printed",
    "gradedesign.mechanics.explicit.measures.StressMeasure": "result.json, measures",
    "gradedesign.design.printing.voids.Voids": "result.json, printability",
    # Evidence that a solution balances, which tests compare with other programs.
    "gradedesign.mechanics.fe.solution.Solution.reaction": "tests/verification",
    # Interfaces for code of others.
    "gradedesign.program.commands.app.Commands.invoke": "typer calls it",
    "gradedesign.program.commands.app.Commands.list_commands": "typer calls it",
    "gradedesign.common.system.compiling._Compilations.notify": "numba calls it",
    "gradedesign.program.commands.serve_page._Handler.do_GET": "http.server calls it",
    "gradedesign.program.commands.serve_page._Handler.log_message": "http.server calls it",
    "gradedesign.program.commands.serve_page._Handler.server": "http.server sets it",
    "gradedesign.program.commands.serve_page._PageServer.handle_error": "http.server calls it",
}


def read_modules(folders):
    """Syntax trees of the modules below some folders, by dotted name."""
    modules = {}
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            name = ".".join(part for part in parts if part != "__init__")
            modules[name] = ast.parse(path.read_text(encoding="utf-8"))
    return modules


def imported(tree):
    """Names that a module imports, with the module and name they come from."""
    return {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


class Uses:
    """What pieces of code use: ``(module, name)`` of functions and classes, names of attributes."""

    def __init__(self, modules):
        self.imports = {name: imported(tree) for name, tree in modules.items()}

    def origin(self, module, name):
        """Module and name that define what a module calls so."""
        home = self.imports.get(module, {}).get(name, (module, name))
        return home if home[0] == module else self.origin(*home)

    def of(self, node, module):
        counts = Counter()
        for part in ast.walk(node):
            if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load):
                counts[self.origin(module, part.id)] += 1
            elif isinstance(part, ast.Attribute) and isinstance(part.ctx, ast.Load):
                counts[part.attr] += 1
                if isinstance(part.value, ast.Name):  # perhaps a function of an imported module
                    home = ".".join(self.origin(module, part.value.id))
                    counts[self.origin(home, part.attr)] += 1
            elif isinstance(part, ast.Call) and getattr(part.func, "id", "") == "lookup":
                counts[part.args[1].value] += 1  # a shelf of the registry, by its name
            elif isinstance(part, ast.ImportFrom):
                renamed = [alias.name for alias in part.names if alias.asname]
                counts.update(self.origin(part.module, name) for name in renamed)
        return counts


def decorators(node):
    """Names in the decorators of a function or class."""
    return {
        part.attr if isinstance(part, ast.Attribute) else part.id
        for decorator in node.decorator_list
        for part in ast.walk(decorator)
        if isinstance(part, ast.Attribute | ast.Name)
    }


def exported(modules, uses):
    """Module and name of every definition that the public modules list."""
    return {
        uses.origin(place, element.value)
        for place in PUBLIC
        for node in (modules[place].body if place in modules else ())
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
        for element in ast.walk(node.value)
        if isinstance(element, ast.Constant)
    }


def definitions(modules, public):
    """Functions and classes, their methods and fields: place, key among the uses, code, kept."""
    for module, tree in modules.items():
        for node in tree.body:
            if not isinstance(node, ast.FunctionDef | ast.ClassDef):
                continue
            place = f"{module}.{node.name}"
            kept = (
                (module, node.name) in public
                or node.name.startswith("__")
                or decorators(node) & CALLED_BY_FRAMEWORK
            )
            yield place, (module, node.name), node, bool(kept)
            for part in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(part, ast.FunctionDef):
                    kept = part.name.startswith("__") or part.name in CALLED_BY_NAME
                    kept = kept or decorators(part) & CALLED_BY_FRAMEWORK
                    yield f"{place}.{part.name}", part.name, part, bool(kept)
                elif isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
                    yield f"{place}.{part.target.id}", part.target.id, part, False


def unreachable(modules):
    """Places of the definitions that no living code uses, outermost only, sorted."""
    uses = Uses(modules)
    living = Counter()
    for module, tree in modules.items():
        living.update(uses.of(tree, module))
    rest = {}
    for place, key, node, kept in definitions(modules, exported(modules, uses)):
        if not kept:
            module = next(m for m in (place.rsplit(".", n)[0] for n in (1, 2)) if m in modules)
            rest[place] = key, uses.of(node, module)
    dead = set()
    while more := {place for place, (key, own) in rest.items() if living[key] <= own[key]}:
        for place in sorted(more):
            if place not in rest:  # gone with its class
                continue
            _, own = rest.pop(place)
            living.subtract(own)
            holder = rest.get(place.rpartition(".")[0])
            if holder:
                holder[1].subtract(own)
            for member in [other for other in rest if other.startswith(f"{place}.")]:
                del rest[member]
            dead.add(place)
    return sorted(dead)


def test_everything_is_reached_by_a_command_a_case_or_the_public_names():
    found = {
        place: {place, place.rpartition(".")[0]} for place in unreachable(read_modules(SOURCES))
    }
    dead = [place for place, names in found.items() if not names & set(ALLOWED)]
    assert not dead, "only tests use: " + ", ".join(dead)
    stale = set(ALLOWED).difference(*found.values())
    assert not stale, f"reached by now, not to be listed: {stale}"


def test_the_dead_are_found_with_what_only_they_use(tmp_path):
    package = tmp_path / "gradedesign"
    package.mkdir()
    (package / "__init__.py").write_text('from gradedesign.a import run\n__all__ = ["run"]\n')
    (package / "a.py").write_text(
        "from gradedesign.b import helper as help_with\n"
        "def run(): return help_with().read\n"
        "def alone(): return alone(), below()\n"
        "def below(): return 1\n"
    )
    (package / "b.py").write_text(
        "class Record:\n    read: int\n    unread: int\n    def method(self): return self.read\n"
        "def helper(): return Record(read=1, unread=2)\n"
        "def run(): return 'same name, elsewhere'\n"
    )
    assert unreachable(read_modules([tmp_path])) == [
        "gradedesign.a.alone",
        "gradedesign.a.below",
        "gradedesign.b.Record.method",
        "gradedesign.b.Record.unread",
        "gradedesign.b.run",
    ]

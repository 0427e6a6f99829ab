"""A linear solver of a plugin, from installing it to the case that names it."""

import re
from pathlib import Path

import numpy as np
import pytest
from small_parts import box_part, held_bar

from gradedesign import PluginError, SolverError, load_case, run
from gradedesign.design.resolve.tools import linear_solver
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.supports import supports_at
from gradedesign.program.host.registry import build_registry

PLUGIN = """
import numpy as np
from gradedesign import LinearAnswer, LinearSolver, hookimpl

def prepare(system):
    free = np.flatnonzero(system.free)
    assert system.near_null_space.shape == (system.matrix.shape[0], 6)
    inverse = np.linalg.inv(system.matrix.toarray()[np.ix_(free, free)])

    def solve(right, start, rtol):
        x = np.zeros_like(right)
        x[:, free] = right[:, free] @ inverse
        {body}
        return LinearAnswer(x=x)

    return solve

@hookimpl
def gradedesign_solvers():
    yield LinearSolver(name="fake-inverse", prepare=prepare)
"""
CASE = (
    held_bar(
        box_part(24, 12, 12, 6),
        name="solved",
        material='name = "Ti-6Al-4V"',
        load_case="tip",
        force="0 N, 0 N, -40 N",
    )
    + """\
[limits]
displacement = [{region = "tip", magnitude = "1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "6 mm"
density = [0.2, 0.5]
[output]
formats = ["stl"]
[run]
stop_after = "solid"
solver = "fake-inverse"
"""
)


@pytest.fixture
def case(tmp_path):
    def write(solver="fake-inverse"):
        (tmp_path / "case.toml").write_text(CASE.replace("fake-inverse", solver))
        return tmp_path

    return write


def test_a_case_is_solved_by_the_solver_of_the_readme(install, case, tmp_path):
    text = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    (module,) = (block for block in blocks if "def gradedesign_solvers" in block)
    install("fake-solver", module)
    tips = {}
    for solver in ("acme-pyamg", "direct"):
        result = run(load_case(case(solver)), build_registry(), folder=tmp_path / solver)
        assert result.status == "partial"
        (tips[solver],) = [row.value for row in result.limits]
    assert tips["acme-pyamg"] == pytest.approx(tips["direct"], rel=1e-7)
    assert tips["acme-pyamg"] != tips["direct"]


@pytest.mark.parametrize(
    ("body", "error", "words"),
    [
        ("int('x')", PluginError, "solver 'fake-inverse' of fake-solver 1.2 failed: ValueError"),
        (
            "x *= 1.01",
            SolverError,
            "'tip', solved by fake-inverse: the residual is off by 1.00e-02",
        ),
        ("x = x[:, 1:]", SolverError, "returned (1, 674), expected a LinearAnswer"),
        ("return x", SolverError, "returned ndarray, expected a LinearAnswer"),
        ("x[0, 200] = np.nan", SolverError, "returned 1 displacements that are not finite"),
    ],
)
def test_a_broken_solver_is_named(install, case, body, error, words):
    install("fake-solver", PLUGIN.format(body=body))
    read = load_case(case())
    solver = linear_solver(read.run.solver, build_registry(), read.where)
    space = tet_space(box_part_mesh((8.0, 4.0, 4.0), 2.0), 2)
    steel = IsotropicStiffness(E=np.full(space.element_count, 2.1e5), nu=0.3)
    held = supports_at(space, [(np.flatnonzero(space.nodes[0] < 1e-9), (0.0, 0.0, 0.0))])
    force = np.where(space.nodes[0] > 8.0 - 1e-9, [[0.0], [0.0], [-1.0]], 0.0)
    with pytest.raises(error, match=re.escape(words)):
        solve_elastic(
            space, steel, [LoadVector(name="tip", supports=held, force=force)], solver=solver
        )


def test_a_solver_that_nothing_supplies_is_told_with_its_line(case, cli):
    ended = cli("check", case("multigird"))
    assert ended.code == 2
    line = CASE.splitlines().index('solver = "fake-inverse"') + 1
    assert f"case.toml:{line}: run.solver: no linear solver named 'multigird'" in ended.err
    assert 'did you mean "multigrid"? available: direct, multigrid' in ended.err

"""A linear solver of a plugin, from installing it to the case that names it."""

import pytest

from gradedesign import load_case, run
from gradedesign.plugin.registry import build_registry

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
CASE = """\
[case]
name = "solved"
[part]
box = ["24 mm", "12 mm", "12 mm"]
mesh_size = "6 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "tip"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-40 N"]}]
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


@pytest.fixture
def case(tmp_path):
    def write(solver="fake-inverse"):
        (tmp_path / "case.toml").write_text(CASE.replace("fake-inverse", solver))
        return tmp_path

    return write


def test_a_case_is_solved_by_a_plugins_solver(install, case, tmp_path):
    install("fake-solver", PLUGIN.format(body=""))
    tips = {}
    for solver in ("fake-inverse", "direct"):
        result = run(load_case(case(solver)), build_registry(), folder=tmp_path / solver)
        assert result.status == "partial"
        (tips[solver],) = [row.value for row in result.limits]
    assert tips["fake-inverse"] == pytest.approx(tips["direct"], rel=1e-9)
    assert tips["fake-inverse"] != tips["direct"]


@pytest.mark.parametrize(
    ("body", "code", "words"),
    [
        ("int('x')", 7, "solver 'fake-inverse' of fake-solver 1.2 failed: ValueError"),
        (
            "x *= 1.01",
            6,
            "'tip', solved by fake-inverse: the residual is off by 1.00e-02",
        ),
        ("x = x[:, 1:]", 6, "solver 'fake-inverse' returned (1, 674), expected a LinearAnswer"),
        ("return x", 6, "solver 'fake-inverse' returned ndarray, expected a LinearAnswer"),
        ("x[0, 100] = np.nan", 6, "fake-inverse returned 1 displacements that are not finite"),
    ],
)
def test_a_broken_solver_is_named(install, case, tmp_path, cli, body, code, words):
    install("fake-solver", PLUGIN.format(body=body))
    ended = cli("run", case(), "-o", tmp_path / "out")
    assert ended.code == code
    assert words in ended.err


def test_a_solver_that_nothing_supplies_is_told_with_its_line(case, cli):
    ended = cli("check", case("multigird"))
    assert ended.code == 2
    line = CASE.splitlines().index('solver = "fake-inverse"') + 1
    assert f"case.toml:{line}: run.solver: no linear solver named 'multigird'" in ended.err
    assert 'did you mean "multigrid"? available: direct, multigrid, scikit-fem' in ended.err

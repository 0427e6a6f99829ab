"""An eigenvalue solver of a plugin, from installing it to the command that names it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from gradedesign import PluginError, SolverError
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.program.host.registry import build_registry
from gradedesign_laboratory import run_homogenise as command
from gradedesign_laboratory.buckling import macro_prestress, weakest_modes
from gradedesign_laboratory.critical_stress import CriticalStress

PLUGIN = """
import numpy as np
from gradedesign import EigenSolver, ExtremeValue, hookimpl
from gradedesign_laboratory.lanczos import lanczos

def solve(problem):
    high, low = lanczos(problem)
    value, vector = high.value, high.vector
    {body}
    return ExtremeValue(value=value, vector=vector), low

@hookimpl
def gradedesign_eigen_solvers():
    yield EigenSolver(name="fake-solver", solve=solve)
"""


def ends(solver, *, both=True):
    """Ends of the spectrum of a frame of square bars under a general stress."""
    fill = np.zeros((8, 8, 8))
    fill[:2, :2] = fill[:2, :, :2] = fill[:, :2, :2] = 1.0
    stress = macro_prestress(solve_periodic(fill), np.array([0, 0.3, 0, 0.5, 0, 0]))
    start = np.random.default_rng(96).standard_normal((3, *fill.shape))
    found = weakest_modes(fill, stress, poissons_ratio=0.3, start=start, both=both, solver=solver)
    return [None if end is None else end.value for end in found]


def test_the_solver_of_the_readme_finds_what_the_built_in_ones_find(install):
    text = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    (module,) = (block for block in blocks if "def gradedesign_eigen_solvers" in block)
    install("fake-eigen", module)
    solvers = build_registry().eigen_solvers
    assert list(solvers) == ["acme-lobpcg", "lanczos", "scipy"]
    # The residuals that each is content with leave 1e-3 of the value at most.
    values = {name: ends(solver) for name, solver in solvers.items()}
    assert values["scipy"] == pytest.approx(values["lanczos"], rel=1e-3)
    assert values["acme-lobpcg"] == pytest.approx(values["lanczos"], rel=1e-3)
    assert len({tuple(found) for found in values.values()}) == 3
    assert ends(solvers["scipy"], both=False)[1] is None


@pytest.mark.parametrize(
    ("body", "error", "words"),
    [
        ("int('x')", PluginError, "eigenvalue solver 'fake-solver' of fake-eigen 1.2 failed: Valu"),
        ("value *= 1.03", SolverError, "as the largest value, whose residual is"),
        ("value, vector = low.value, low.vector", SolverError, "expected a value above 0"),
        ("vector = vector[1:]", SolverError, "returned a vector of shape (1535,)"),
        ("vector = vector * np.nan", SolverError, "expected (1536,) finite numbers"),
        ("return high", SolverError, "expected the largest ExtremeValue and the smallest"),
        ("return high, None", SolverError, "expected the largest ExtremeValue and the smallest"),
    ],
)
def test_a_wrong_answer_is_refused(install, body, error, words):
    install("fake-eigen", PLUGIN.format(body=body))
    with pytest.raises(error, match=re.escape(words)):
        ends(command.blamed_eigen_solver(build_registry(), "fake-solver"))


def test_the_command_hands_on_the_solver_that_it_names(cli, monkeypatch):
    names = []

    def critical(cell, rho, *, poissons_ratio, solver):
        names.append(solver.name)
        return CriticalStress(
            density=rho, resolution=32, wall_voxels=4.0, critical=np.ones((6, 2)),
            cells=np.ones((6, 2), dtype=int), error=0.1,
        )  # fmt: skip

    monkeypatch.setattr(command, "critical_stress", critical)
    words = ("homogenise", "gyroid-network", "--density", "0.5", "--resolution", "8", "--json")
    chosen = cli(*words, "--buckling", "--eigen-solver", "scipy")
    assert json.loads(chosen.out)["buckling"]["error"] == 0.1
    assert names == ["scipy"]
    ended = cli(*words, "--buckling", "--eigen-solver", "lanzcos")
    assert ended.code == 2
    assert 'did you mean "lanczos"? available: lanczos, scipy' in ended.err

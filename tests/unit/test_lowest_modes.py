"""The lowest modes of dense matrices, whose eigenvalues LAPACK knows."""

import numpy as np
import pytest
from scipy.linalg import eigh

from gradedesign.errors import SolverError
from gradedesign.mechanics.solver import lowest_modes as module
from gradedesign.mechanics.solver.lowest_modes import ModeProblem, lowest_modes


def chain(n, masses):
    """Equal springs between two walls, with masses at their joints."""
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return stiffness, np.diag(masses)


def roughly_inverse(stiffness, error, seed):
    """The inverse, of whose form a share is wrong: symmetric and positive."""
    root = np.linalg.cholesky(stiffness)
    noise = np.random.default_rng(seed).standard_normal(stiffness.shape)
    noise = error * (noise + noise.T) / np.linalg.norm(noise + noise.T, 2)
    half = np.linalg.inv(root)
    return half.T @ (np.eye(len(root)) + noise) @ half


def modes_of(stiffness, mass, inverse, count, *, start=None, rtol=1e-8):
    problem = ModeProblem(
        stiffness=lambda x: stiffness @ x,
        mass=lambda x: mass @ x,
        precondition=lambda forces: forces @ inverse,
        start=[np.ones(len(mass))] if start is None else start,
    )
    return lowest_modes(problem, count, rtol=rtol, name="test")


def squares(stiffness, mass):
    """Squared angular frequencies, lowest first, of a mass that may be nearly singular."""
    return 1.0 / eigh(mass, stiffness, eigvals_only=True)[::-1]


def test_modes_are_those_of_lapack_where_a_mass_nearly_vanishes():
    random = np.random.default_rng(6007)
    masses = random.uniform(0.5, 2.0, 120)
    masses[[5, 60]] = 1e-13
    stiffness, mass = chain(120, masses)
    found = modes_of(stiffness, mass, roughly_inverse(stiffness, 0.4, 6011), 4)
    assert found.values == pytest.approx(squares(stiffness, mass)[:4], rel=1e-10)
    work = found.shapes @ stiffness @ found.shapes.T
    assert work == pytest.approx(np.eye(4), abs=1e-6)
    assert found.frequencies == pytest.approx(np.sqrt(found.values) / (2 * np.pi), rel=1e-12)
    assert found.residuals.max() <= 1e-8


def test_equal_frequencies_are_found_as_often_as_they_are():
    stiffness, mass = chain(40, np.linspace(1.0, 2.0, 40))
    twice = np.kron(np.eye(2), stiffness), np.kron(np.eye(2), mass)
    # The start lies in the first chain alone: the second one is found by the random forces.
    start = [np.concatenate([np.ones(40), np.zeros(40)])]
    found = modes_of(*twice, roughly_inverse(twice[0], 0.3, 6029), 4, start=start)
    single = squares(stiffness, mass)[:2]
    assert found.values == pytest.approx(np.repeat(single, 2), rel=1e-10)


def test_modes_of_a_similar_problem_shorten_the_iteration():
    stiffness, mass = chain(200, np.linspace(1.0, 2.0, 200))
    inverse = roughly_inverse(stiffness, 0.4, 6037)
    first = modes_of(stiffness, mass, inverse, 3)
    again = modes_of(stiffness, mass * 1.02, inverse, 3, start=[*first.shapes])
    assert again.iterations < first.iterations
    assert again.values == pytest.approx(first.values / 1.02, rel=1e-9)


def test_fewer_unknowns_than_modes_give_all_of_them():
    stiffness, mass = chain(2, [1.0, 3.0])
    found = modes_of(stiffness, mass, np.linalg.inv(stiffness), 3)
    assert found.values == pytest.approx(squares(stiffness, mass), rel=1e-10)


def test_an_iteration_that_does_not_converge_is_refused(monkeypatch):
    monkeypatch.setattr(module, "MAX_ITERATIONS", 2)
    stiffness, mass = chain(300, np.linspace(1.0, 2.0, 300))
    with pytest.raises(SolverError, match=r"the lowest 3 natural frequencies stopped after 2"):
        modes_of(stiffness, mass, np.eye(300), 3)


def test_a_solid_without_mass_has_no_frequency():
    stiffness, _ = chain(10, np.ones(10))
    with pytest.raises(SolverError, match="no mass"):
        modes_of(stiffness, np.zeros((10, 10)), np.linalg.inv(stiffness), 1)

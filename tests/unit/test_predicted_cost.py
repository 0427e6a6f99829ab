"""Predicted cost: units of work times measured speeds, replaced by those of the first iteration."""

from dataclasses import replace

import pytest

from gradedesign.design.acceptance.acceptance import choose_scope
from gradedesign.design.acceptance.meshed_anew import mesher_tets
from gradedesign.design.loop.predicted_cost import (
    MEASURED,
    WITHIN,
    RunWork,
    learned_speed,
    predict_cost,
)
from gradedesign.mechanics.explicit.tets import solve_seconds

#: Of `cases/mini`: its own numbers of the first iteration, whole lattice re-meshed.
MINI = RunWork(
    part_dofs=4131,
    load_cases=1,
    adjoint_solves=1,
    explicit_dofs=155_343,
    explicit_memory=7,
    explicit_mesh_s=0.5,
    explicit_solve_s=1.4,
    whole_s=20.0,
    mesher_tets=33_797,
    iterations=6,
)


def test_a_measured_iteration_is_predicted_within_the_factor():
    # Seconds of cases/mini on two idle cores, iteration 1: sizing, mesh, solve, together.
    found = predict_cost(MINI)
    for value, measured in (
        (found.sizing_s, 1.01),
        (found.explicit_mesh_s, 0.56),
        (found.explicit_solve_s, 1.3),
        (found.iteration_s, 2.9),
    ):
        assert measured / WITHIN < value < measured * WITHIN


def test_work_counts_where_it_is_done():
    base = predict_cost(MINI)
    assert predict_cost(replace(MINI, part_dofs=2 * 4131)).sizing_s == pytest.approx(
        2 * base.sizing_s
    )
    assert base.explicit_mesh_s == MINI.explicit_mesh_s
    assert base.memory_bytes == MINI.explicit_memory
    more = predict_cost(replace(MINI, load_cases=3))
    # The mesh of the acceptance is solved in every load case too; the mesher's time stays.
    assert base.acceptance_s < more.acceptance_s < 3 * base.acceptance_s
    assert more.sizing_s == pytest.approx(2 * base.sizing_s)  # 4 solves instead of 2
    # Ten iterations size; prediction and correction take the time of two more.
    assert base.iteration_s == pytest.approx(
        1.2 * base.sizing_s + base.explicit_mesh_s + base.explicit_solve_s
    )


def test_a_run_holds_its_iterations_and_acceptances():
    one, many = predict_cost(replace(MINI, iterations=1)), predict_cost(MINI)
    assert (one.iterations, many.iterations) == (1, 3)
    assert one.run_s == pytest.approx(
        MEASURED.start + one.iteration_s + one.whole_s + one.acceptance_s
    )
    # Sizing takes 10, 20 and 8 iterations (`loop.iteration_steps`).
    stages = (3.8 + 0.6) * many.sizing_s + 3 * (many.explicit_mesh_s + many.explicit_solve_s)
    # The second acceptance is that of the last design.
    stages += one.judging_s
    assert many.run_s - one.run_s == pytest.approx(stages - one.iteration_s)


def test_the_first_iteration_replaces_the_measured_speeds():
    took = {"sizing": 40.0, "explicit mesh": 30.0, "explicit solve": 100.0}
    speed = learned_speed(MINI, 10, took)
    found = predict_cost(MINI, speed, learned=True)
    assert found.sizing_s == pytest.approx(40.0)
    assert found.explicit_mesh_s == pytest.approx(30.0)
    assert found.explicit_solve_s == pytest.approx(100.0)
    assert found.iteration_s == pytest.approx(178.0)
    assert found.learned
    # No iteration runs the mesher: it is as much slower as the solve was.
    slower = 100.0 / predict_cost(MINI).explicit_solve_s
    assert speed.tet == pytest.approx(MEASURED.tet * slower)


def test_a_stage_that_is_missing_teaches_nothing():
    assert learned_speed(MINI, 10, {}) == MEASURED
    assert learned_speed(MINI, 10, {"sizing": 0.0}) == MEASURED


def test_tetrahedra_of_the_mesher_are_estimated_before_they_are_made():
    # 100 mm^3 in cubes of 1.2 surface sizes, 18 tetrahedra each.
    assert mesher_tets(100.0, 1.0) == pytest.approx(100.0 / 1.2**3 * 18)
    # Two further load cases add 45 % each.
    assert solve_seconds(7140, 3) == pytest.approx(1.9 * solve_seconds(7140, 1))


def test_scope_follows_stated_budgets():
    # 400 tetrahedra a second, a sixtieth of the stated time: by definition.
    most = 400.0 * 1200.0 / 60.0
    assert choose_scope("auto", 0.99 * most, 1200.0) == "whole"
    assert choose_scope("auto", 1.01 * most, 1200.0) == "submodels"
    assert choose_scope("whole", 1e9, 1.0) == "whole"
    assert choose_scope("submodels", 1.0, 1e9) == "submodels"

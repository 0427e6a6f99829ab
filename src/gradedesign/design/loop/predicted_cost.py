"""Cost of a run in unknowns, memory and seconds, before it and after its first iteration.

Every stage takes a number of seconds for each unit of its work, measured on two cores of an
otherwise idle machine. After its first iteration a run replaces them by the times of its own
stages.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gradedesign.design.loop.iteration_steps import (
    FIRST_SIZING_ITERATIONS,
    TUNING_SIZING_ITERATIONS,
)
from gradedesign.design.resolve.least_density import USUAL_ITERATIONS
from gradedesign.mechanics.explicit.tets import DOFS_PER_TET, solve_seconds
from gradedesign.mechanics.sizing.size_members import member_iterations

#: Homogenised analyses beside sizing, counted in its iterations: prediction and correction.
_LEARNING_SIZING_ITERATIONS = 2
#: Acceptances of a run of more than one iteration: the first that holds teaches factors, the last
#: decides. Two in `mini` and in `size-graded`.
_USUAL_ACCEPTANCES = 2
#: A prediction is meant to be right within this factor on an idle machine. Chosen, not measured.
WITHIN = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RunWork:
    """Amount of work of a run, in plain numbers."""

    part_dofs: int  #: Unknowns of the part's own mesh.
    load_cases: int
    adjoint_solves: int  #: That limits by gradient cost sizing beside the solves of the load cases.
    explicit_dofs: int  #: Unknowns of the explicit lattice.
    explicit_memory: int  #: Bytes that its analysis asks of [run] memory before it begins.
    explicit_mesh_s: float  #: s. As the analysis estimates them.
    explicit_solve_s: float  #: s. As the analysis estimates them.
    #: s. Of the whole printed surface at two resolutions, as its analysis estimates them.
    whole_s: float
    #: Tetrahedra of the mesher of the acceptance: of the whole lattice, or of all submodels.
    mesher_tets: int
    iterations: int  #: That the run may take at most.
    members: bool = False  #: Whether sizing looks for solid members.
    cells: bool = True  #: Whether they lie among cells.


@dataclass(frozen=True, slots=True, kw_only=True)
class Speed:
    """Seconds for a unit of work."""

    sizing: float  #: s. For each unknown of the part and each of its solves in an iteration.
    mesh: float  #: Over what the explicit analysis estimates.
    solve: float  #: Over what the explicit analysis estimates.
    tet: float  #: s. For each tetrahedron of the mesher of the acceptance.
    start: float  #: s. Reading and meshing the part, pictures and report.


#: Measured in first iterations: sizing 0.5 to 0.85e-5 of processor time, the mesher 0.4 to 0.9e-3
#: on two idle cores since surfaces come to it with fewer triangles.
MEASURED = Speed(
    sizing=0.7e-5,
    mesh=1.0,
    solve=1.0,
    tet=0.7e-3,
    start=8.0,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class CostPrediction:
    """Predicted size and time of a run."""

    part_dofs: int
    explicit_dofs: int
    memory_bytes: int  #: That the explicit analysis asks of [run] memory before it begins.
    sizing_s: float  #: s. Of a first iteration.
    explicit_mesh_s: float  #: s. Of every iteration.
    explicit_solve_s: float  #: s. Of every iteration.
    whole_s: float  #: s. The whole printed surface at two resolutions.
    acceptance_s: float  #: s. Body-fitted meshes of the exported file and their analysis.
    #: s. A first iteration: sizing, mesh, solve, and the update of the corrections.
    iteration_s: float
    run_s: float  #: s. ``iterations`` iterations, their acceptances, part and output.
    iterations: int  #: That ``run_s`` counts.
    learned: bool = False  #: Whether a finished iteration of the same run stands behind it.

    @property
    def judging_s(self) -> float:
        """Seconds of an acceptance with both of its analyses, s."""
        return self.whole_s + self.acceptance_s


def predict_cost(
    work: RunWork, speed: Speed = MEASURED, *, learned: bool = False
) -> CostPrediction:
    """Predict the size and time of a run from plain numbers.

    ``speed``: of this machine and case; what was measured on small cases by default. ``learned``:
    whether ``speed`` comes from a finished iteration of the run itself.
    """
    sizing = _sizing_seconds(work, speed, _sizing_iterations_of(work, 0))
    mesh, solve = speed.mesh * work.explicit_mesh_s, speed.solve * work.explicit_solve_s
    remeshed = int(work.mesher_tets * DOFS_PER_TET)
    again = speed.solve * solve_seconds(remeshed, work.load_cases)
    accept = mesher_seconds(work.mesher_tets, speed) + again
    whole = speed.solve * work.whole_s
    learning = _sizing_seconds(work, speed, _LEARNING_SIZING_ITERATIONS)
    iterations = min(USUAL_ITERATIONS, work.iterations)
    sized = sum(
        _sizing_seconds(work, speed, _sizing_iterations_of(work, n)) for n in range(iterations)
    )
    accepted = min(_USUAL_ACCEPTANCES, iterations) * (whole + accept)
    return CostPrediction(
        part_dofs=work.part_dofs,
        explicit_dofs=work.explicit_dofs,
        memory_bytes=work.explicit_memory,
        sizing_s=sizing,
        explicit_mesh_s=mesh,
        explicit_solve_s=solve,
        whole_s=whole,
        acceptance_s=accept,
        iteration_s=sizing + mesh + solve + learning,
        run_s=speed.start + sized + iterations * (mesh + solve + learning) + accepted,
        iterations=iterations,
        learned=learned,
    )


def _sizing_iterations_of(work: RunWork, finished: int) -> int:
    """Sizing iterations of the iteration after ``finished`` ones."""
    if work.members:
        return member_iterations(first=not finished, cells=work.cells)
    return (
        FIRST_SIZING_ITERATIONS[finished]
        if finished < len(FIRST_SIZING_ITERATIONS)
        else TUNING_SIZING_ITERATIONS
    )


def _sizing_seconds(work: RunWork, speed: Speed, iterations: int) -> float:
    """Seconds of a sizing, s."""
    solves = work.load_cases + work.adjoint_solves
    return speed.sizing * work.part_dofs * solves * iterations


def mesher_seconds(tets: int, speed: Speed = MEASURED) -> float:
    """Seconds of the mesher of the acceptance, s."""
    return speed.tet * tets


def learned_speed(
    work: RunWork, iterations: int, seconds: Mapping[str, float], speed: Speed = MEASURED
) -> Speed:
    """Speed from the times of the stages of a finished iteration.

    Solves depend least on the case, so that theirs tells how fast the machine is at present: the
    mesher, which no iteration runs, is taken to be as much slower or faster.

    - ``work``: with the unknowns that the iteration really had
    - ``iterations``: of its sizing
    - ``seconds``: by stage, ``sizing``, ``explicit mesh``, ``explicit solve``; a
      stage that is missing teaches nothing
    - ``speed``: for the other stages
    """
    believed = {
        "sizing": _sizing_seconds(work, speed, iterations),
        "explicit mesh": speed.mesh * work.explicit_mesh_s,
        "explicit solve": speed.solve * work.explicit_solve_s,
    }
    ratio = {
        name: seconds[name] / value
        for name, value in believed.items()
        if seconds.get(name, 0.0) > 0 and value > 0
    }
    return replace(
        speed,
        sizing=speed.sizing * ratio.get("sizing", 1.0),
        mesh=speed.mesh * ratio.get("explicit mesh", 1.0),
        solve=speed.solve * ratio.get("explicit solve", 1.0),
        tet=speed.tet * ratio.get("explicit solve", 1.0),
    )

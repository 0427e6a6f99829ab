"""Seconds of the first sizing of a case, stage by stage, nothing taken from the cache.

``python benchmarks/bench_sizing.py CASE.toml [...]``. Two idle cores: `bracket` with members of
6 mm on tetrahedra of 4 mm (162,000 unknowns, two load cases, five limits), 44 analyses, 287 s and
178.0 g of design before kept solids were one adjoint problem each, residuals ten times to a hundred
times larger and the surface's first offset that of a member under tension, 196 s and 174.7 g after,
143 s and 179.6 g (43 analyses, another mesh) since moments of stiffness are assembled without
unpacking them and the last stage ends within 2 % of its aim (177.9 g there without);
the same in solid and void with members of 5.5 mm (217,000 unknowns), the first four stages: 411 s
and 73.2 g before, 93 s and 72.5 g after. The times before are under a profiler, which costs up to a
tenth of them.
"""

import argparse
import time


def timed_sizing(stages):
    """Sizing that is not stored, and leaves what each of its stages took in a list."""
    from gradedesign.mechanics.sizing.size import size

    def sized(problem, _stated, **effort):
        began = time.perf_counter()
        result = size(problem, **effort)
        stages.append((problem.members, result, time.perf_counter() - began))
        return result

    return sized


def main():
    """Print a line for every stage of every case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="+")
    from gradedesign import load_case
    from gradedesign.design.loop import iteration_steps
    from gradedesign.design.resolve.design_model import prepare
    from gradedesign.design.resolve.oriented import oriented
    from gradedesign.design.resolve.own_cell import with_own_cell
    from gradedesign.design.resolve.size_effects import with_size_effects
    from gradedesign.design.resolve.solid import solve_solid, with_solid
    from gradedesign.mechanics.explicit.correction import Correction
    from gradedesign.program.host.registry import build_registry

    for path in parser.parse_args().case:
        case = load_case(path)
        registry = with_own_cell(case.lattice, build_registry(), case.where)
        model = prepare(case, registry)
        model = with_size_effects(oriented(with_solid(model, solve_solid(model.homogenised))))
        stages = []
        iteration_steps.stored_sizing = timed_sizing(stages)
        began = time.perf_counter()
        result = iteration_steps.size_design(
            model, Correction(), {}, iteration_steps.design_filter(model),
            iteration_steps.SizingPlan(),
        )  # fmt: skip
        whole = time.perf_counter() - began
        print(f"{path}: {model.homogenised.space.dof_count} unknowns")
        for members, found, seconds in stages:
            last, sharpness = found.history[-1], "" if members is None else members.sharpness
            print(
                f"  sharpness {sharpness!s:5} {len(found.history):3} analyses {seconds:6.1f} s "
                f"{last.mass_g:8.3f} g, {last.utilisation:.1%}"
            )
        last = result.history[-1]
        print(
            f"  all {len(result.history)} {whole:.1f} s {last.mass_g:.3f} g {last.utilisation:.1%}"
        )


if __name__ == "__main__":
    main()

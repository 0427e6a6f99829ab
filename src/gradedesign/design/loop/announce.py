"""Progress events of a run, and the seconds of its stages."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field

from gradedesign.common.system.progress import Event, Listener, stepping
from gradedesign.design.acceptance.printed_body import PrintedBody
from gradedesign.design.acceptance.submodel import SubmodelResult
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.predicted_cost import CostPrediction
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.sizing.size import SizingStep


@dataclass(slots=True)
class Announcer:
    """Sender of progress events, which adds up the seconds of stages and keeps iterations."""

    listener: Listener
    seconds: dict[str, float] = field(default_factory=dict)  #: By stage, s.
    #: Those that were reported, for the result of a run that fails after them.
    finished: list[DesignIteration] = field(default_factory=list)

    def timing(self) -> dict[str, float]:
        """Seconds per stage so far."""
        return {name: round(value, 3) for name, value in self.seconds.items()}

    @contextmanager
    def stage(self, name: str, which: str = "") -> Iterator[None]:
        """Time a stage; stages of the same name add up, ``which`` says which of them this is."""
        began = time.perf_counter()
        self.listener(Event(stage=name, message="started"))
        try:
            with stepping(which) if which else nullcontext():
                yield
        finally:
            took = time.perf_counter() - began
            self.seconds[name] = self.seconds.get(name, 0.0) + took
        self.listener(Event(stage=name, message="done", seconds=took))

    def took(self, name: str, seconds: float) -> None:
        """Add seconds of a part of a stage, without an event."""
        self.seconds[name] = self.seconds.get(name, 0.0) + seconds

    def cost(self, cost: CostPrediction, budget: RunSpec) -> None:
        """Report the predicted cost of a run beside its budgets."""
        basis = "by its first iteration" if cost.learned else "within a factor of two"
        iterations = f"{cost.iterations} iteration{'' if cost.iterations == 1 else 's'}"
        self.say(
            "cost",
            f"predicted {basis}: {cost.explicit_dofs / 1e6:.2g} M unknowns, "
            f"{cost.memory_bytes / 1e9:.2g} of {budget.memory / 1e9:.3g} GB; an iteration "
            f"{cost.iteration_s:.0f} s, an acceptance {cost.judging_s:.0f} s, "
            f"a run of {iterations} {cost.run_s:.0f} of {budget.time:.0f} s",
            seconds_per_iteration_s=cost.iteration_s,
            seconds_per_run_s=cost.run_s,
        )
        if cost.run_s > budget.time:
            self.say(
                "warning",
                f"a run of {iterations} is predicted to take {cost.run_s:.0f} s, more than [run] "
                f"time of {budget.time:.0f} s, which may then end it before its lightest design",
            )
        if cost.memory_bytes > budget.memory:
            self.say(
                "warning",
                f"the explicit analysis is predicted to take {cost.memory_bytes / 1e9:.3g} GB, "
                f"more than [run] memory of {budget.memory / 1e9:.3g} GB",
            )

    def say(self, stage: str, message: str, **values: float) -> None:
        """Send one line."""
        self.listener(Event(stage=stage, message=message, values=values))

    def part(self, model: DesignModel) -> None:
        """Report the size of the part, the cell and the law."""
        part, cells, lattice = model.homogenised, model.cells, model.plan.case.lattice
        filled = (
            f"cell {cells.cell.name} of {lattice.size_words}, law {cells.law.name}, density "
            f"{cells.bounds[0]:.3g} to {cells.bounds[1]:.3g}"
            if lattice.cells
            else f"solid members of {lattice.least_member:g} mm or more, and void"
        )
        self.say(
            "part",
            f"{part.volumes.sum():.6g} mm^3, {part.volumes.size} tets, {part.space.dof_count} dof; "
            f"{filled}, method {lattice.method}",
        )
        self.warnings(model.warnings)

    def warnings(self, words: Sequence[str]) -> None:
        """Send warnings, one line each."""
        for warning in words:
            self.say("warning", warning)

    def limits(self, stage: str, rows: Sequence[LimitRow]) -> None:
        """Report the decisive value and utilisation of each limit, with its band."""
        for row in rows:
            word = "" if row.word == "holds" else f"  {row.word}"
            band = f"; band {row.band_words}" if row.band_words else ""
            largest = "" if row.largest is None else f", largest {row.largest:.4g} {row.unit}"
            self.say(
                stage,
                f"{row.name} ({row.load_case}): {row.words}{word}{band}{largest}"
                f"{row.bodies_words and f'; {row.bodies_words}'}",
                utilisation=row.utilisation,
            )

    def sizing_step(self, step: SizingStep) -> None:
        """Report one sizing iteration."""
        lattice = step.mass_g - step.members_g
        members = f"solid members {step.members_g:.4g} g" if step.members_g else ""
        cells = members
        if step.mean_density:
            cells = f"lattice {lattice:.4g} g" + (f" and {members}" if members else "")
            cells += f", density {step.mean_density:.4f}"
        self.say(
            "sizing",
            f"iteration {step.iteration + 1}: {cells}, utilisation {step.utilisation:.1%}, "
            f"change {step.change:.2%}",
            mass_g=step.mass_g,
            utilisation=step.utilisation,
        )

    def iteration(self, iteration: DesignIteration, *, resumed: bool = False) -> None:
        """Report one finished iteration."""
        summary = iteration.summary
        self.finished.append(iteration)
        if not resumed:
            for name, seconds in summary.timing_s.items():
                self.took(name, seconds)
        discrepancies = "".join(
            f", {kind} discrepancy {value:+.1%}"
            for kind, value in _governing_discrepancies(iteration).items()
        )
        stiff = (iteration.expected.get(row.key, 1.0) for row in iteration.rows if row.converges)
        error = max(stiff, default=1.0) - 1.0
        self.say(
            "iteration",
            f"iteration {summary.number}{' (resumed)' if resumed else ''}: mass "
            f"{summary.mass_g:.4g} g (lattice {summary.lattice_mass_g:.4g} g), utilisation "
            f"{summary.utilisation:.1%}"
            f"{f', elements too stiff by up to {error:.0%}' if error > 0.0 else ''}"
            f"{discrepancies}, {summary.dofs / 1e6:.2f} M dof, "
            f"{summary.seconds:.0f} s",
            mass_g=summary.mass_g,
            utilisation=summary.utilisation,
        )

    def printed(self, body: PrintedBody, material: Material) -> None:
        """Report the printed file: its mass, its thinnest walls, and how far the analysed one is.

        A difference beyond its threshold is a warning of the result.
        """
        thin, both = body.thickness.percentiles_mm, body.comparison
        apart = f" and surface up to {both.distance_mm:.2g} mm" if both.contoured else ""
        self.say(
            "printed",
            f"mass {body.mass_g(material.density):.4g} g by the file; 5 % of the surface has "
            f"less than {thin['5']:.3g} mm of solid behind it, half of it {thin['50']:.3g} mm; "
            f"volume {both.volume_difference:+.1%}{apart} off the analysed solid"
            f"{_joints(body.joints_mm3)}",
        )

    def submodel(self, result: SubmodelResult) -> None:
        """Report one analysed submodel."""
        self.say(
            "acceptance",
            f"{'enlarged ' if result.submodel.enlarged else ''}submodel at "
            f"{tuple(round(c, 1) for c in result.submodel.centre)} mm: "
            f"{result.value:.4g} MPa against {result.driving_value:.4g} MPa in the driving "
            f"analysis, whose displacements are taken times {result.drive_factor:.3f}; "
            f"force {result.force_discrepancy:.1%}, energy {result.energy_discrepancy:.1%}, "
            f"{result.tets} tets, mesher {result.seconds:.0f} s",
        )


def _joints(volume: float) -> str:
    """Words on the volume that joints add, mm^3; none without joints."""
    return f"; joints add {volume:.4g} mm^3 to the lattice" if volume else ""


def _governing_discrepancies(iteration: DesignIteration) -> dict[str, float]:
    """Discrepancy of the most used limit of every kind that an explicit analysis measures."""
    utilisation = {row.key: row.utilisation for row in iteration.rows}
    discrepancies: dict[str, tuple[float, float]] = {}
    for limit in iteration.summary.limits:
        if limit.discrepancy is not None:
            kind, pair = limit.key.kind, (utilisation[limit.key], limit.discrepancy)
            discrepancies[kind] = max(pair, discrepancies.get(kind, pair))
    return {kind: discrepancy for kind, (_, discrepancy) in discrepancies.items()}

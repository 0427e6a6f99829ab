"""The registry: records that the built-ins and the installed plugins supply, found by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.suggest import described, instead, meant, question
from gradedesign.design.printing.process import Process
from gradedesign.errors import CaseError, PluginError
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.maker import CellMaker
from gradedesign.geometry.formats.exporter import Exporter
from gradedesign.geometry.lattice.component_kind import ComponentKind
from gradedesign.geometry.lattice.field_reader import FieldReader
from gradedesign.geometry.part.reader import PartReader
from gradedesign.geometry.part.repairer import Repairer
from gradedesign.geometry.tets.mesher import Mesher
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis
from gradedesign.mechanics.limits.limit import LimitKind
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.solver.eigen_solver import EigenSolver
from gradedesign.mechanics.solver.linear_solver import LinearSolver

if TYPE_CHECKING:
    # Outputs are about finished runs, of which nothing here knows anything but their names.
    from gradedesign.program.outputs.output import Output
    from gradedesign.program.outputs.report_section import ReportSection

Kind = Literal[
    "cell_families",
    "cell_makers",
    "scaling_laws",
    "materials",
    "processes",
    "readers",
    "field_readers",
    "repairers",
    "exporters",
    "outputs",
    "report_sections",
    "solvers",
    "eigen_solvers",
    "meshers",
    "limits",
    "components",
    "analyses",
]

#: Names of the kinds in messages.
NOUNS: Mapping[Kind, str] = {
    "cell_families": "cell family",
    "cell_makers": "cell maker",
    "scaling_laws": "scaling law",
    "materials": "material",
    "processes": "printing process",
    "readers": "part reader",
    "field_readers": "reader of fields",
    "repairers": "repairer",
    "exporters": "exporter",
    "outputs": "output",
    "report_sections": "section of the report",
    "solvers": "linear solver",
    "eigen_solvers": "eigenvalue solver",
    "meshers": "mesher",
    "limits": "kind of limit",
    "components": "kind of component",
    "analyses": "explicit analysis",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginSource:
    """A plugin that was loaded: its entry point (or module), distribution and version."""

    entry_point: str
    distribution: str
    version: str

    def __str__(self) -> str:
        """Name the distribution and version, as reports print them."""
        return f"{self.distribution} {self.version}".strip()


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginFailure:
    """A plugin that could not be loaded and supplies nothing."""

    entry_point: str
    distribution: str
    error: str

    def __str__(self) -> str:
        """Name entry point, distribution and error in one line."""
        return f"plugin '{self.entry_point}' of {self.distribution}: {self.error}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Registry:
    """Records by kind and name, sorted by name."""

    cell_families: Mapping[str, CellFamily]
    cell_makers: Mapping[str, CellMaker]
    scaling_laws: Mapping[str, ScalingLaw]
    materials: Mapping[str, Material]
    processes: Mapping[str, Process]
    readers: Mapping[str, PartReader]
    field_readers: Mapping[str, FieldReader]
    repairers: Mapping[str, Repairer]
    exporters: Mapping[str, Exporter]
    outputs: Mapping[str, Output]
    report_sections: Mapping[str, ReportSection]
    solvers: Mapping[str, LinearSolver]
    eigen_solvers: Mapping[str, EigenSolver]
    meshers: Mapping[str, Mesher]
    limits: Mapping[str, LimitKind]
    components: Mapping[str, ComponentKind]
    analyses: Mapping[str, ExplicitAnalysis]
    #: By kind and name, ``"distribution version"`` that supplied the record.
    sources: Mapping[str, Mapping[str, str]]
    plugins: tuple[PluginSource, ...]  #: Every plugin that was loaded, for the report.
    failures: tuple[PluginFailure, ...]  #: Every plugin that was not.
    warnings: tuple[str, ...] = ()  #: Warnings about mistakes of loaded plugins.

    @property
    def notes(self) -> tuple[str, ...]:
        """Everything that a user should hear about the plugins, one sentence each."""
        return (*(f"disabled {failure}" for failure in self.failures), *self.warnings)


def lookup(registry: Registry, kind: Kind, name: str) -> Any:
    """Find a record by the name a case gives.

    ``kind``: a mapping of the registry. Raises `CaseError` if there is no such name; names the
    plugin of this project that has it, or lists the valid ones and the nearest spelling. Raises
    `PluginError`: the same, when a plugin that might have supplied it failed to load.
    """
    shelf: Mapping[str, Any] = getattr(registry, kind)
    if name in shelf:
        return shelf[name]
    if plugin := supplied_by(kind, name):
        raise absent(registry, f"no {NOUNS[kind]} named '{name}'; {plugin}")
    near = instead(name, shelf)
    if not meant(name, shelf):
        texts = {known: getattr(record, "source", "") for known, record in shelf.items()}
        near = f"{question(described(name, texts))} {near}".lstrip()
    raise absent(registry, f"no {NOUNS[kind]} named '{name}'; {near}")


def absent(registry: Registry, message: str) -> CaseError | PluginError:
    """The error of something that a case names and nothing supplies.

    Returns
    -------
    CaseError
        With the message.
    PluginError
        With the causes added, when a plugin that might have supplied it failed to load.
    """
    if registry.notes:
        causes = "; ".join(registry.notes)
        return PluginError(f"{message}. A plugin may be to blame: {causes}")
    return CaseError(message)

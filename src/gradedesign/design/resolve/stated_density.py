"""The density that a case states: one number, or a map from outside."""

from __future__ import annotations

from collections.abc import Callable

from gradedesign.arrays import FloatArray
from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError, blaming
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.density_source import DensitySource, sample_density
from gradedesign.geometry.lattice.density_value import formula_field
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.field_reader import DensityRequest, FieldReader
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec

#: The density grid resolves a cell by this many nodes. Chosen, not measured.
NODES_PER_CELL = 8


def stated_density(
    case: Case,
    registry: Registry,
    source: DensitySource | None,
    *,
    domain: DesignDomain,
    window: tuple[float, float],
    level_of: Callable[[FloatArray | float], FloatArray],
) -> DensityGrid | float:
    """Density of a case, checked against its allowed range.

    Raises DensityError if a density is not allowed. Raises CaseError if a file cannot be used.

    ``source``: takes the place of the case's density. ``window``: densities the cell, and the
    printer, allow. ``level_of``: of the cell; refuses a density it does not have.
    """
    spec = case.lattice
    low, high = spec.stated_range or window
    if source is None and isinstance(spec.density, float):
        with locating(case.where, "lattice.density"):
            level_of(spec.density)
            _require_floor(spec.density, window)
        return spec.density
    source_kind = "function"
    key = "lattice.density_map"
    if source is None and spec.density_map is not None:
        source_kind = spec.density_map.source
        written = f"{key}.{source_kind}"
        key = written if written in case.lines else "lattice.density"
    with locating(case.where, key):
        if source is None:
            source = _source(spec, domain, registry, case.run.memory)
        return sample_density(
            source,
            domain.distance,
            domain.lower,
            domain.upper,
            spacing=case.lattice.cell_size / NODES_PER_CELL,
            window=(max(low, window[0]), min(high, window[1])),
            quantity=f"density {source_kind}",
            memory_limit_bytes=case.run.memory,
        )


def _require_floor(density: float, window: tuple[float, float]) -> None:
    if not density >= window[0] - 1e-9:
        raise CaseError(
            f"found {density:g}, but walls of [print] min_wall need at least {window[0]:.4g}; use "
            f"larger cells or a higher density"
        )


def _source(
    lattice: LatticeSpec, domain: DesignDomain, registry: Registry, memory: int
) -> DensitySource:
    """The density source that the map names."""
    spec = lattice.density_map
    if spec is None:
        raise CaseError("there is neither a density nor a map")
    if spec.formula is not None:
        return formula_field(parse_formula(spec.formula), domain.distance)
    reader: FieldReader = lookup(registry, "field_readers", spec.source)
    with blaming(
        f"field reader '{reader.name}' of {registry.sources['field_readers'][reader.name]}",
        always=False,
    ):
        return reader.density(
            DensityRequest(
                spec=spec,
                lower=domain.lower,
                upper=domain.upper,
                cell_size=lattice.cell_size,
                spacing=lattice.cell_size / NODES_PER_CELL,
                grey=lattice.stated_range,
                memory_limit_bytes=memory,
            )
        )

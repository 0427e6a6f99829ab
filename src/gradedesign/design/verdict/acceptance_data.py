"""Plain data on the analyses that a verdict rests on, and on the stress that they found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.resolve.exclusion import exclusion_data
from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.limits.row import LimitRow


def acceptance_data(accepted: Accepted) -> dict[str, Any]:
    """Analyses that the verdict rests on, per limit."""
    a, whole = accepted.acceptance, accepted.whole.result
    entries = []
    for row in accepted.rows:
        if row.homogenised:
            continue
        fitted = row.key in accepted.fitted
        entries.append(
            {
                "limit": row.name,
                "load_case": row.load_case,
                "judged_by": row.judged_by,
                "mesher": accepted.analysed.solid.mesher.name
                if fitted
                else whole.solved.division.made_by,
                "scope": a.scope if fitted else "whole",
                "volume_mm3": a.volume if fitted else whole.volume,
                "mesh_sizes_mm": [] if row.band is None else list(row.band.sizes_mm),
                "order": None if row.band is None else row.band.order,
                "value": row.value,
                "low": None if row.band is None else row.band.low,
                "high": None if row.band is None else row.band.high,
                "decisive": row.decisive,
                "unit": row.unit,
            }
        )
    return {
        "scope": a.scope,
        "share_of_volume": a.share,
        "exclusion": exclusion_data(
            (a.whole or whole).exclusion, stress_ratios(accepted.rows, a.whole or whole)
        ),
        "limits": entries,
        "submodels": [
            {
                "centre_mm": list(w.submodel.centre),
                "load_case": w.submodel.load_case,
                "value_MPa": w.value,
                "driving_MPa": w.driving_value,
                "drive_factor": w.drive_factor,
                "force_discrepancy": w.force_discrepancy,
                "energy_discrepancy": w.energy_discrepancy,
                "matches": w.matches,
                "enlarged": w.submodel.enlarged,
                "buffer_cells": list(w.submodel.buffer),
                "tets": w.tets,
                "mesher_seconds": w.seconds,
            }
            for w in a.submodels
        ],
        "mesher_attempts": list(a.attempts),
        "islands_dropped": asdict(accepted.islands),
        "tet_components_dropped": accepted.analysed.result.solved.division.dropped_components,
    }


def stress_ratios(rows: Sequence[LimitRow], result: ExplicitResult) -> dict[str, float]:
    """Stress by submodels over stress by finite cells, for each limited phase."""
    found = {
        (case, measure.phase): measure.value
        for case, measures in result.measures.items()
        for measure in measures
    }
    ratios: dict[str, float] = {}
    for row in rows:
        if row.phase:
            value = found.get((row.load_case, row.phase), 0.0)
            ratios[row.phase] = row.value / value if value else 1.0
    return ratios


def measure_data(result: ExplicitResult) -> dict[str, Any]:
    """Stress measures of an analysis by load case and phase, worst neighbourhood included."""
    return {
        case: {m.phase: asdict(m) for m in measures} for case, measures in result.measures.items()
    }

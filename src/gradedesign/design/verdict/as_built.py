"""Plain data on the as-built body of a judged design, beside the designed one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.printing.as_built_body import (
    StatedProcess,
    as_built_data,
    process_warnings,
)
from gradedesign.design.verdict.result import RunResult
from gradedesign.design.verdict.shown import Shown
from gradedesign.mechanics.material.material import Material

#: Volume of the as-built surface over that of its elements, less one, beyond which its facets
#: overlap or are inside out, so that its mass is said to be uncertain: twice the usual difference.
#: Chosen, not measured.
_UNSURE_MASS = 0.03


def with_as_built(
    result: RunResult,
    process: StatedProcess | None,
    material: Material,
    shown: Shown,
    accepted: Accepted | None,
) -> RunResult:
    """The result with what the process builds of the design; the same without a process."""
    if process is None:
        return result
    data = _measures(process, material, shown, accepted)
    words = _warnings(process, material, shown, data)
    return replace(
        result,
        measures={**result.measures, "as_built": data},
        warnings=(*result.warnings, *words),
    )


def _measures(
    process: StatedProcess, material: Material, shown: Shown, accepted: Accepted | None
) -> dict[str, Any]:
    """Plain data on the as-built body."""
    data = as_built_data(process, shown.built, material.density)
    judged = None if accepted is None or accepted.bodies.built is None else accepted.bodies
    if judged is not None and accepted is not None:
        data |= {
            "judged": judged.judged,
            "unknown": judged.unknown,
            "limits": [
                {
                    "limit": row.name,
                    "load_case": row.load_case,
                    "unit": row.unit,
                    "allowed": row.limit,
                    "nominal": row.nominal,
                    "as_built": row.as_built,
                }
                for row in accepted.rows
                if row.as_built is not None
            ],
            "elements_mm3": dict(judged.volumes_mm3),
            "seconds": dict(judged.seconds),
            "variants": [asdict(spread) for spread in shown.spreads],
        }
    return data


def _warnings(
    process: StatedProcess, material: Material, shown: Shown, data: Mapping[str, Any]
) -> list[str]:
    """Sentences on what is not known of it; what was said before the run is not repeated."""
    before = process_warnings(process, material)
    after = process_warnings(process, material, shown.printed.thickness.percentiles_mm)
    words = [told for told in after if told not in before]
    if process.process.has_body and "judged" not in data:
        words.append("no design was accepted or refused, so that nothing was analysed as built")
    if data.get("unknown"):
        words.append(f"nothing is known of the body that is printed, {data['unknown']}")
    held = data.get("elements_mm3", {}).get("as built")
    if held:
        off = data["as_built_mm3"] / held - 1.0
        if abs(off) > _UNSURE_MASS:
            words.append(
                f"the as-built surface encloses {data['as_built_mm3']:.4g} mm^3, the solid that "
                f"was analysed has {held:.4g} mm^3: surfaces that the process moves into each "
                f"other count twice, walls that vanish count as negative; the latter is right"
            )
    for entry in data.get("variants", ()):
        if entry["held"] < 1.0:
            words.append(
                f"{entry['limit']} ({entry['load_case']}): {1.0 - entry['held']:.0%} of the "
                f"as-built variants break the limit; 5 to 95 % of them lie within "
                f"{entry['low']:.4g} to {entry['high']:.4g} {entry['unit']}"
            )
    return words

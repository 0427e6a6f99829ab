"""Sentences that say how the values of the limits were taken, and on what they rest."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from gradedesign.output._html import table


def allowed(row: Mapping[str, Any]) -> str:
    """The limit of a row of result.json, with the words of the case where it states no number."""
    stated = f" ({row['stated']})" if row.get("stated") else ""
    return f"{row['limit']:.4g} {row['unit']}{stated}"


def measures_note(result: Mapping[str, Any]) -> str:
    """How each kind of value is taken from its analysis, as a paragraph; empty where unknown."""
    by_measure: dict[str, list[str]] = {}
    for row in result.get("limits") or ():
        if row.get("measure"):
            names = by_measure.setdefault(row["measure"], [])
            if row["name"] not in names:
                names.append(row["name"])
    said = [f"{', '.join(names)}: {measure}" for measure, names in by_measure.items()]
    return f"<p>How values are taken. {escape('. '.join(said))}.</p>" if said else ""


def solid_section(result: Mapping[str, Any]) -> str:
    """The same limits on the fully solid part, as a section; empty before its analysis."""
    rows = [
        (
            row["name"],
            row["load_case"],
            f"{row['value']:.4g} {row['unit']}",
            allowed(row),
            f"{row['use']:.1%}",
        )
        for row in result.get("solid") or ()
    ]
    if not rows:
        return ""
    header = ("limit", "load case", "value", "allowed", "use")
    return "<h2>Fully solid part</h2>" + table(header, rows, numbers={2, 3, 4})


def scope_words(acceptance: Mapping[str, Any]) -> str:
    """What of the verdict rests on the printed surface, as plain text; empty before acceptance."""
    if not acceptance:
        return ""
    share = f"{acceptance['share_of_volume']:.1%} of the printed volume"
    if acceptance["scope"] == "whole":
        return (
            f"displacement and stress are judged on the printed surface: read back from the file, "
            f"meshed again by an independent mesher and analysed whole ({share})"
        )
    count = len(acceptance["windows"])
    windows = f"{count} most stressed windows" if count != 1 else "most stressed window"
    return (
        f"displacements are judged by the explicit analysis of a mesh of the lattice's field; the "
        f"printed surface was read back and meshed again by an independent mesher only in its "
        f"{windows} ({share}), whose stress over that of the explicit analysis scales the stress "
        f"in the lattice"
    )


def stress_note(result: Mapping[str, Any]) -> str:
    """How the judged stress, the maximum, the picture and the exclusion radius belong together.

    Returns
    -------
    str
        HTML; empty where no stress was judged.
    """
    found = [
        (row, (result.get("measures") or {}).get(row["load_case"], {}).get(row["phase"]))
        for row in result.get("limits") or ()
        if row.get("phase")
    ]
    zone = (result.get("acceptance") or {}).get("exclusion")
    share = f"{zone['percentile']:g} %" if zone else "all but a small share"
    said = [_connected(row, m, share) for row, m in found if m]
    if not said:
        return ""
    said.append(
        "The picture of the stress shows the explicit analysis everywhere, at nodes, extrapolated "
        "from the integration points and averaged: like the maximum it may exceed the value that "
        "is judged."
    )
    return f"<p>{escape(' '.join(said))}</p>" + (_zone_note(zone, result) if zone else "")


def _connected(row: Mapping[str, Any], m: Mapping[str, Any], share: str) -> str:
    """Sentences from the limit over the judged percentile to the largest value."""
    ratio = row["value"] / m["value"] if m["value"] > 0 else 1.0
    scaled = "" if abs(ratio - 1) < 1e-9 else f", {m['value']:.4g} MPa times {ratio:.3f}"
    return (
        f"{row['name']} ({row['load_case']}): the limit of {row['limit']:.4g} MPa is compared with "
        f"{row['value']:.4g} MPa{scaled}, the percentile: {share} of the volume outside the "
        f"exclusion radius has less in the analysis. {m['share_above']:.2%} of "
        f"that volume lies above the limit; the largest value at an integration point is "
        f"{m['maximum']:.4g} MPa, which grows as the mesh is refined at corners and is not judged."
    )


def _zone_note(zone: Mapping[str, Any], result: Mapping[str, Any]) -> str:
    """What the exclusion radius leaves out, and the percentile with and without it."""
    shares = ", ".join(f"{name} {share:.1%}" for name, share in zone["share_of_volume"].items())
    measures = result.get("measures") or {}
    rows = []
    for case, phases in zone["stress_everywhere_MPa"].items():
        for phase, value in phases.items():
            outside = measures.get(case, {}).get(phase)
            rows.append(
                (
                    case,
                    phase,
                    "–" if outside is None else f"{outside['value']:.4g}",
                    f"{value:.4g}",
                )
            )
    header = ("load case", "phase", "outside the radius MPa", "everywhere MPa")
    return (
        f"<p>Within {zone['radius_mm']:.4g} mm of the held regions stress is not judged, because "
        f"ideally rigid supports make it grow without end as the mesh is refined. That leaves out "
        f"this share of the volume: {escape(shares)}. Percentile {zone['percentile']:g} of the "
        f"analysis outside that radius, and everywhere:</p>" + table(header, rows, numbers={2, 3})
    )

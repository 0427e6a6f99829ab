"""The sections of the report that say what was used: law, material, zones, files and versions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from gradedesign.design.verdict.result import RunResult
from gradedesign.program.outputs.report_section import ReportSection, ReportTable

#: Names of the numbers of a material as the report shows them.
_QUANTITIES = {
    "youngs_modulus_MPa": "Young's modulus E, MPa",
    "poissons_ratio": "Poisson's ratio nu",
    "density_g_cm3": "density, g/cm³",
    "yield_strength_MPa": "yield strength, MPa",
    "thermal_expansion_per_K": "thermal expansion, 1/K",
}


def builtin_sections() -> tuple[ReportSection, ...]:
    """The sections of the core."""
    return (
        ReportSection(
            name="bodies",
            title="Bodies of the file that are not in the part",
            content=lambda result: _table(
                ("body", "role", ""),
                [(b["name"], b["role"], b["done"]) for b in result.file_bodies],
            ),
        ),
        ReportSection(name="cell-and-law", title="Cell and law", content=_law),
        ReportSection(name="files", title="Files", content=_files),
        ReportSection(name="material", title="Material", content=_material),
        ReportSection(
            name="repair",
            title="Input repair",
            content=lambda result: _table(
                ("what was changed in the file's surface", "count"),
                [(change.replace("_", " "), str(n)) for change, n in result.repairs.items()],
                right=(1,),
            ),
        ),
        ReportSection(name="versions", title="Versions and time", content=_versions),
        ReportSection(name="zones", title="Zones", content=_zones),
    )


def _table(
    header: tuple[str, ...], rows: Iterable[tuple[str, ...]], right: tuple[int, ...] = ()
) -> Iterator[ReportTable]:
    """A table, or nothing without rows."""
    if found := tuple(rows):
        yield ReportTable(header=header, rows=found, right=right)


def _law(result: RunResult) -> Iterator[ReportTable]:
    """Cell and law, and where the law holds."""
    return _table(
        ("", ""),
        [
            (key.replace("_", " "), _plain(value))
            for key, value in result.law.items()
            if value is not None and value != ""
        ],
    )


def _material(result: RunResult) -> Iterator[ReportTable]:
    """Numbers of the material, and its S-N curves."""
    rows = [
        (_QUANTITIES.get(key, key), _plain(value))
        for key, value in result.material.items()
        if key != "fatigue"
    ]
    for curve in result.material.get("fatigue", ()):
        amplitudes, cycles = (
            ", ".join(map(str, curve[key])) for key in ("amplitude_MPa", "cycles")
        )
        rows.append(
            (
                f"S-N curve, {curve['surface']}",
                f"amplitude {amplitudes} MPa for {cycles} cycles at R = {curve['ratio']}, "
                f"Walker {curve['walker']}; {curve['source']}",
            )
        )
    return _table(("", ""), rows)


def _zones(result: RunResult) -> Iterator[ReportTable]:
    """Volume, mass and density of every zone."""
    rows = [
        (
            name,
            f"{zone['volume_mm3']:.5g}",
            f"{zone['share_of_lattice']:.1%}",
            f"{zone['mass_g']:.4g}",
            "" if zone["density"] is None else f"{zone['density']:.3f}",
        )
        for name, zone in result.measures.get("zones", {}).items()
    ]
    header = ("zone", "volume mm^3", "share of lattice", "mass g", "mean density")
    return _table(header, rows, right=(1, 2, 3, 4))


def _files(result: RunResult) -> Iterator[ReportTable]:
    """Files that were read and written, by checksum."""
    return _table(
        ("", "file", "SHA-256"),
        [
            (what, name, digest)
            for what, files in result.checksums.items()
            for name, digest in files.items()
        ],
    )


def _versions(result: RunResult) -> Iterator[ReportTable]:
    """Programs and plugins that made the run, and what each stage took."""
    return _table(
        ("", ""),
        [
            *result.versions.items(),
            *(("plugin", plugin) for plugin in result.plugins),
            *((f"seconds, {stage}", f"{spent:.1f}") for stage, spent in result.timing_s.items()),
            ("case hash", result.case_hash),
        ],
    )


def _plain(value: Any) -> str:
    """Write a value of the law for a person."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{k.replace('_', ' ')} {_plain(v)}" for k, v in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return " to ".join(_plain(v) for v in value)
    return str(value)

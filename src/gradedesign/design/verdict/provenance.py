"""Origin of a result: date, version, checksums of what was read and printed, material."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime
from importlib import metadata
from typing import Any

from gradedesign.design.case.read_case import part_files
from gradedesign.design.case.schema import Case
from gradedesign.design.verdict.result import RunResult
from gradedesign.mechanics.material.material import Material
from gradedesign.program.store.manifest import measure_artefact
from gradedesign.program.store.run_folder import RunFolder


def stamped(
    out: RunFolder, case: Case, result: RunResult, printed: Iterable[str] = ()
) -> RunResult:
    """The result with its date, the version that made it, and the checksums of files.

    None of them enters the hash of the case: a finished run that is resumed keeps its own.

    Parameters
    ----------
    case : Case
        Whose part files are read again for their checksums.
    printed : iterable of str
        Names of the files of the printed lattice; those that were not written are left out.
    """
    written = out.artefacts()
    return replace(
        result,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        version=metadata.version("gradedesign"),
        checksums={
            "part": {
                path.name: measure_artefact(path).sha256
                for path in part_files(case.part)
                if path.is_file()
            },
            "print": {name: written[name].sha256 for name in printed if name in written},
        },
    )


def material_data(material: Material) -> dict[str, Any]:
    """Numbers of the material, with their units, and their source."""
    return {
        "name": material.name,
        "youngs_modulus_MPa": material.youngs_modulus,
        "poissons_ratio": material.poissons_ratio,
        # Rounded: 4.41 as stated, not 4.410000000000001.
        "density_g_cm3": float(f"{1e9 * material.density:.12g}"),
        # A case that limits no stress may leave it out.
        "yield_strength_MPa": (
            None if math.isnan(material.yield_strength) else material.yield_strength
        ),
        "thermal_expansion_per_K": material.thermal_expansion,
        "source": material.source,
    }

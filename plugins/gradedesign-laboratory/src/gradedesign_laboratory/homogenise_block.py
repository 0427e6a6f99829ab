"""``gradedesign homogenise --boundary``: options and results of a finite block of cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gradedesign import CaseError, CellFamily
from gradedesign.commands import instead, library_versions
from gradedesign_laboratory.apparent import BOUNDARIES, ApparentStiffness
from gradedesign_laboratory.moduli_data import cell_header, digits, moduli_data, rounded

#: The boundary condition of a lattice without end.
PERIODIC = "periodic"


def require_boundary(boundary: str, unused: Sequence[str]) -> None:
    """Refuse an unknown boundary condition, and options that a finite block does not have.

    Raises
    ------
    CaseError
    """
    if boundary not in BOUNDARIES:
        conditions = (PERIODIC, *BOUNDARIES)
        raise CaseError(f"--boundary {boundary} is unknown; {instead(boundary, conditions)}")
    if unused:
        raise CaseError(
            f"{' and '.join(unused)} need --boundary {PERIODIC}: of a finite block only the "
            f"stiffness is computed"
        )


def block_data(
    family: CellFamily,
    parameters: Mapping[str, float],
    density: float,
    apparent: ApparentStiffness,
    poissons_ratio: float,
) -> dict[str, Any]:
    """Plain data of the apparent stiffness of a finite block, beside the periodic one."""
    return {
        **cell_header(family, parameters, density, poissons_ratio, apparent.resolution),
        "boundary": apparent.boundary,
        "cells": apparent.cells,
        "solid_volume_fraction": digits(apparent.solid),
        "void_stiffness": apparent.void,
        "C": rounded(apparent.stiffness),
        **moduli_data(apparent.stiffness),
        "periodic": {"C": rounded(apparent.periodic), **moduli_data(apparent.periodic)},
        "energy_over_periodic": [digits(ratio) for ratio in apparent.energy_ratios],
        "in_order": apparent.in_order,
        "versions": library_versions(),
    }

"""Buckling of the cells in a run: whether it is judged, what is unknown, and the row it gives."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.ladder.setup import Setup
from gradedesign.ladder.verdict import LimitRow
from gradedesign.mesh.tet_mesh import centroids
from gradedesign.sizing.buckling_limit import BucklingLimit, BucklingUse

#: Name of the row among the limits.
BUCKLING = "buckling of cells"


def buckling_limit(setup: Setup) -> BucklingLimit | None:
    """The limit on buckling, where the case asks for it and the law knows it."""
    factor = setup.buckling_factor
    if factor is None or setup.law.buckling is None:
        return None
    return BucklingLimit(law=setup.law.buckling, factor=factor)


def buckling_rows(setup: Setup, use: BucklingUse | None) -> tuple[LimitRow, ...]:
    """The row of a predicted use: homogenised, since the explicit analyses are linear."""
    if use is None:
        return ()
    place = centroids(setup.space.mesh)[:, use.element]
    at = ", ".join(f"{c:.1f}" for c in place)
    return (
        LimitRow(
            name=BUCKLING,
            load_case=use.load_case,
            value=use.value,
            limit=1.0,
            unit="of the critical stress",
            judged_by=f"homogenised prediction, most used at ({at}) mm",
            measure="most used element of the part",
        ),
    )


def buckling_data(setup: Setup) -> dict[str, Any]:
    """What the judgement of buckling rests on, for the report."""
    law = setup.law.buckling
    if law is None:
        return {"buckling": "unknown"}
    c, n, residual = law.power_fit(0, 0)
    return {
        "buckling": (
            f"modes that repeat after one or two cells, densities {law.window[0]:g} to "
            f"{law.window[1]:g}, {law.table.version}, {law.table.date}; compression along x "
            f"{c:.3g} rho^{n:.3g} E within {residual:.0%}; extrapolation added up to "
            f"{float(np.max(law.table.error)):.0%}"
        ),
        "buckling_factor": setup.buckling_factor,
    }


def thin_warning(setup: Setup, rho: FloatArray) -> tuple[str, ...]:
    """Say how much of a lattice is thinner than buckling is known for."""
    limit = buckling_limit(setup)
    if limit is None:
        return ()
    weights = setup.model.lattice_volumes
    least = limit.law.window[0]
    share = float(weights[rho < least * (1 - 1e-9)].sum() / weights.sum())
    if share == 0:
        return ()
    return (
        f"{share:.1%} of the lattice is thinner than relative density {least:g}, from which on "
        f"buckling of law '{setup.law.name}' was computed; below, its power law is extrapolated",
    )

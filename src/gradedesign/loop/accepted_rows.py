"""Rows that an acceptance decides on: of the whole printed surface, with its body-fitted meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradedesign.errors import LatticeError
from gradedesign.limits.banded import Banded
from gradedesign.limits.limit import Limit
from gradedesign.limits.row import LimitRow
from gradedesign.limits.verdict import limit_rows
from gradedesign.verify.acceptance import Acceptance
from gradedesign.verify.submodel import SubmodelResult


def with_remeshed(
    limits: Sequence[Limit], rows: Sequence[LimitRow], acceptance: Acceptance
) -> tuple[LimitRow, ...]:
    """Rows beside the body-fitted mesh of the whole surface.

    It judges stress; the bands of values that converge are widened to hold its values.
    """
    if acceptance.whole is None:
        raise LatticeError("acceptance of the whole lattice returned no analysis")
    judge = "re-meshed whole lattice"
    remeshed = {row.key: row for row in limit_rows(limits, acceptance.whole, judge)}
    out = []
    for row in rows:
        remeshed_row = remeshed.get(row.key)
        if remeshed_row is None or (row.converges and row.band is None):
            out.append(row)
        elif not row.converges:
            ratio = remeshed_row.value / row.value if row.value else 1.0
            out.append(row.scaled(Banded(value=ratio, low=ratio, high=ratio), judge))
        elif row.band is not None:
            band = row.band.including(remeshed_row.value)
            words = f"{row.judged_by}; {remeshed_row.value:.4g} {row.unit} by {judge}"
            out.append(replace(row, band=band, judged_by=words))
    return tuple(out)


def with_submodels(
    limits: Sequence[Limit], rows: Sequence[LimitRow], submodels: Sequence[SubmodelResult]
) -> tuple[LimitRow, ...]:
    """Rows with the factors that submodels find for the limits that they can judge."""
    factors = {limit.key: limit.submodel_factor(submodels) for limit in limits}
    out = []
    for row in rows:
        factor = factors.get(row.key)
        words = f"{row.judged_by} times the ratio of {len(submodels)} submodels"
        out.append(row if factor is None else row.scaled(factor, words))
    return tuple(out)


def unjudged_words(rows: Sequence[LimitRow], refused: Sequence[str]) -> str:
    """Limits without a band, with the resolutions that were refused; empty without any."""
    names = ", ".join(dict.fromkeys(row.name for row in without_band(rows)))
    return f"{names} at one resolution only: {'; '.join(refused)}" if names else ""


def without_band(rows: Sequence[LimitRow]) -> tuple[LimitRow, ...]:
    """Rows that were analysed at one resolution only, so that nothing is known of their error."""
    return tuple(row for row in rows if row.band is None and not row.homogenised)

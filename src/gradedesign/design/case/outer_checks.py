"""Checks that nothing in a case opens the outer triangles of a part that it wants unchanged."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign.common.values.problems import Problem
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec


def outer_problems(lattice: LatticeSpec, spec: PrintSpec | None) -> Iterator[Problem]:
    """Find keys that would open the triangles that ``[print] outer = "cad"`` keeps."""
    if spec is None or spec.outer != "cad":
        return
    key = ("print", "outer")
    if not any(not skin.net and not skin.faces for skin in lattice.skin):
        yield Problem(
            key=key,
            message='found "cad", which needs a skin all round: elsewhere the lattice ends at the '
            'triangles of the part and divides them; add e.g. skin = "1 mm" to [lattice], or "cut"',
        )
    if lattice.drain is not None:
        yield Problem(
            key=key,
            message='found "cad" with [lattice.drain]: holes cut the triangles of the part; leave '
            'one out, drill the holes later, or expected "cut"',
        )

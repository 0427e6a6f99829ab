"""Walls that the printer of a case cannot make, and what opens the outer triangles it keeps."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign.common.values.problems import Problem
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.case.schema import CaseFile
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec

#: Thinnest wall and layer, mm, of the coarsest printers, which lay beads of concrete or weld metal.
#: Chosen, not measured.
_MOST_LEAST_WALL = 50.0
#: Elements along the shortest edge of a cell, at least: two for its solid and two for its void.
_LEAST_ELEMENTS = 4


def grid_problems(lattice: LatticeSpec, run: RunSpec) -> Iterator[Problem]:
    """Find a stated grid of the explicit analysis that is too coarse for the cells."""
    stated, most = run.explicit_mesh_size, lattice.cell_size / _LEAST_ELEMENTS
    if stated is not None and stated > most:
        yield Problem(
            key=("run", "explicit_mesh_size"),
            message=f"found {stated:g} mm for cells of {lattice.cell_size:g} mm, whose walls such "
            f"elements step over; expected {most:.3g} mm at most",
        )


def feather_problems(spec: PrintSpec | None) -> Iterator[Problem]:
    """Find a limit on feather edges without the wall that they are thinner than."""
    if spec is not None and spec.min_wall is None and spec.limits.feather_edges is not None:
        yield Problem(
            key=("print", "limits", "feather_edges"),
            message=f"found {spec.limits.feather_edges:g} without [print] min_wall; expected the "
            'thinnest wall that the printer makes beside it, such as min_wall = "0.4 mm"',
        )


def wall_problems(lattice: LatticeSpec, spec: PrintSpec | None) -> Iterator[Problem]:
    """Find cells too small for the stated thinnest wall, and stated walls no printer has."""
    if spec is None:
        return
    for key, what in (
        ("min_wall", "thinnest wall that the printer makes"),
        ("layer_height", "height of a layer"),
        ("pixel_size", "resolution within a layer"),
    ):
        value = getattr(spec, key)
        if value is not None and value > _MOST_LEAST_WALL:
            yield Problem(
                key=("print", key),
                message=f"found {value:g} mm; expected the {what}, {_MOST_LEAST_WALL:g} mm at "
                f"most; is its unit right?",
            )
    least = spec.min_wall
    if least is None or least > _MOST_LEAST_WALL:
        return
    size, wall = lattice.cell_size, lattice.wall
    if lattice.cells and size < 2 * least:
        yield Problem(
            key=("lattice", "size"),
            message=f"found {size:g} mm, less than twice the min_wall of {least:g} mm; "
            f"expected at least {2 * least:g} mm",
        )
    if wall is not None and wall < least:
        yield Problem(
            key=("lattice", "wall"),
            message=f"found {wall:g} mm, thinner than the min_wall of {least:g} mm; "
            f"expected at least that",
        )


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


#: Keys of ``[run]`` that matter where the density is stated.
_OF_STATED = {"memory", "time", "stop_after"}


def stated_problems(file: CaseFile) -> Iterator[Problem]:
    """Find what asks for an analysis beside a stated density, which is not analysed."""
    run = file.run
    for key in sorted(run.model_fields_set - _OF_STATED):
        yield Problem(
            key=("run", key),
            message="belongs to an analysis, and the lattice of a stated density is not analysed: "
            "its surface is as fine as the density needs; leave it out, or state density = "
            "[lowest, highest]",
        )
    if "stop_after" in run.model_fields_set and run.stop_after != "lattice":
        yield Problem(
            key=("run", "stop_after"),
            message=f'found "{run.stop_after}", but the run of a stated density ends with its '
            'lattice; leave it out, expected "lattice", or state density = [lowest, highest]',
        )
    orientation = file.lattice.orientation
    if orientation is not None and orientation.load_case is not None:
        yield Problem(
            key=("lattice", "orientation", "load_case"),
            message="needs the stress of an analysis, which the run of a stated density has not; "
            "expected direction or vtu",
        )
    if any(skin.follows for skin in file.lattice.skin):
        yield Problem(
            key=("lattice", "skin"),
            message="found follows, which needs the stress of an analysis, and the run of a stated "
            "density has none; expected a formula or one thickness",
        )
    for k, zone in enumerate(file.zone):
        if zone.density is not None:
            yield Problem(
                key=("zone", k, "density"),
                message="found beside the stated density of the whole lattice; leave it out: a "
                "density that differs from place to place stands in [lattice.density_map]",
            )

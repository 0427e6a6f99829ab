"""Reading the case of ``gradedesign generate``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from gradedesign.common.values.problems import Problem
from gradedesign.design.case.checks import cell_map_problems, skin_problems
from gradedesign.design.case.generate_schema import GenerateCase, GenerateFile
from gradedesign.design.case.outer_checks import outer_problems
from gradedesign.design.case.read_case import (
    LimitEntries,
    body_files,
    case_hash,
    dotted_lines,
    no_entries,
    part_files,
    read_layout,
)
from gradedesign.design.case.wall_checks import feather_problems
from gradedesign.geometry.cell.own_cell_schema import own_cell_file

#: Keys of ``[run]`` that ``generate`` reads.
OF_GENERATE = {"memory", "time"}


def load_generate_case(
    path: str | Path, *, allow_outside: bool = False, entries: LimitEntries = no_entries
) -> GenerateCase:
    """Read and check a case whose lattice has a stated density.

    Parameters
    ----------
    path : str or Path
        The TOML file, or the folder that holds a ``case.toml``. It needs ``[case]``, ``[part]``
        and ``[lattice]``; the tables of an analysis may be there, and are checked if they are.
    allow_outside : bool
        Whether files may lie outside the folder of the case.
    entries : callable
        Lists that registered kinds of limits add to ``[limits]``.

    Returns
    -------
    GenerateCase

    Raises
    ------
    CaseError
        With every problem: file, line, key, what was found, what would be right.
    """
    content, file, lines = read_layout(
        path, GenerateFile, allow_outside=allow_outside, across=generate_problems, entries=entries
    )
    return GenerateCase(
        name=content.case.name,
        path=file,
        folder=file.parent,
        part=content.part,
        region=content.region,
        material=content.material,
        keep=content.keep,
        lattice=content.lattice,
        print=content.print,
        run=content.run,
        output=content.output,
        case_hash=case_hash(
            content,
            file,
            *part_files(content.part),
            *body_files(*content.keep),
            *_map_files(content),
            own_cell_file(content.lattice),
        ),
        lines=dotted_lines(lines),
    )


def _map_files(content: GenerateFile) -> tuple[Path, ...]:
    """Files of a density map or of directions, whose bytes belong to what is asked."""
    spec, orientation = content.lattice.density_map, content.lattice.orientation
    turned = () if orientation is None or orientation.vtu is None else (orientation.vtu,)
    if spec is None:
        return turned
    if spec.images is not None:
        return (*sorted(p for p in spec.images.iterdir() if p.is_file()), *turned)
    return (*(p for p in (spec.voxels, spec.points, spec.vtu) if p is not None), *turned)


def generate_problems(file: GenerateFile) -> Iterator[Problem]:
    """Contradictions between different tables."""
    orientation = file.lattice.orientation
    if orientation is not None and orientation.load_case is not None:
        yield Problem(
            key=("lattice", "orientation", "load_case"),
            message="belongs to `gradedesign run`, which analyses the part; expected direction or "
            "vtu",
        )
    for key in sorted(file.run.model_fields_set - OF_GENERATE):
        yield Problem(
            key=("run", key),
            message="belongs to `gradedesign run`, which analyses the lattice; `generate` reads "
            f"{' and '.join(sorted(OF_GENERATE))} alone: its surface is as fine as the stated "
            "density needs",
        )
    yield from cell_map_problems(file.lattice, file.region)
    yield from outer_problems(file.lattice, file.print)
    yield from feather_problems(file.print)
    if file.part.box is not None:
        yield from skin_problems(file.lattice, file.part.box)

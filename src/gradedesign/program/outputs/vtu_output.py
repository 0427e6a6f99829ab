"""The output ``vtu``: the fields of a run, and the densities of its iterations as a series."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from xml.sax.saxutils import quoteattr

from gradedesign.common.system.atomic import write_text
from gradedesign.geometry.formats.exporter import FieldSet
from gradedesign.geometry.formats.vtu import write_vtu
from gradedesign.program.outputs.output import FinishedRun, Output

_SERIES_NAME = "iterations.pvd"


def _write_fields(run: FinishedRun) -> tuple[str, ...]:
    """Write every set of fields, and ``iterations.pvd``, whose times are the iterations."""
    lines = []
    for fields in run.fields():
        if fields.number is None:
            run.write(f"{fields.name}.vtu", partial(_write, fields), key=f"{fields.name}_vtu")
            continue
        name = f"iterations/{fields.name}_{fields.number:02d}.vtu"
        run.write(name, partial(_write, fields))
        lines.append(
            f'<DataSet timestep="{fields.number}" group="" part="0" file={quoteattr(name)}/>\n'
        )
    if lines:
        run.write(_SERIES_NAME, partial(_write_series, lines), key="iterations_pvd")
    return ()


def _write(fields: FieldSet, path: Path) -> None:
    write_vtu(
        path,
        (fields.points, fields.elements),
        point_data=fields.point_data,
        cell_data=fields.element_data,
    )


def _write_series(lines: Sequence[str], path: Path) -> None:
    write_text(
        path,
        '<?xml version="1.0"?>\n'
        '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n'
        f"<Collection>\n{''.join(lines)}</Collection>\n</VTKFile>\n",
    )


VTU = Output(name="vtu", write=_write_fields)

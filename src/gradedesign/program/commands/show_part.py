"""Tables of a part on the terminal: its regions, its holes and the faces of its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.place_words import number
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.round_shapes import RoundShapes
from gradedesign.program.commands.check_data import file_faces
from gradedesign.program.commands.show import print_table, print_text, without_noise

#: Groups of round shapes that are printed; ``check --json`` has all. Chosen, not measured.
_MOST_HOLES = 12
#: Faces of the file that are printed; ``check --json`` has all. Chosen, not measured.
_MOST_FILE_FACES = 24
#: Points of one group that are printed. Chosen, not measured.
_MOST_POINTS = 4


def part_words(part: Part) -> str:
    """Name, unit, size and volume of a part."""
    edges = np.ptp(part.surface.vertices, axis=0)
    unit = "" if part.units is None else f", read in {part.units}"
    if part.chord_tolerance is not None:
        unit += f", triangles within {part.chord_tolerance:.2g} mm of its faces"
    box = " x ".join(f"{edge:.4g}" for edge in edges)
    return f"part: {part.source}{unit}, {box} mm, {part.volume:.6g} mm^3"


def repair_words(part: Part) -> str:
    """Every change that repair made, with its count."""
    made = part.report.changes
    return "repairs: " + (", ".join(f"{key} {count}" for key, count in made.items()) or "none")


def print_regions(
    part: Part, regions: Mapping[str, Region], shapes: Mapping[str, RoundShapes] | None = None
) -> None:
    """Print area and place of regions; of a draft numbered, with the shapes that they are."""
    rows = []
    for number_, (name, r) in enumerate(sorted(regions.items()), start=1):
        row = [name, str(len(r.faces)), f"{r.area:.4g}", point_words(r.centroid, extent(part))]
        if shapes is not None:
            shape = shapes.get(name)
            round_ = ("-", "-") if shape is None else (f"{shape.diameter:.4g}", _axis_words(shape))
            row = [str(number_), name, row[1], *round_, *row[2:]]
        rows.append(row)
    columns: tuple[str, ...] = ("region", "faces", "area mm^2", "centroid mm")
    if shapes is not None:
        columns = ("#", *columns[:2], "diameter mm", "axis", *columns[2:])
    print_table("Regions", columns, rows)


def _axis_words(shape: RoundShapes) -> str:
    # Three decimals are a twentieth of a degree.
    return shape.axis_name or triple(np.round(shape.axis, 3) + 0.0)


def print_holes(part: Part, holes: Sequence[RoundShapes]) -> None:
    """Print the round shapes of a part, with the lines that select them."""
    if not holes:
        return
    print_table(
        "Holes, slots, cones and bosses",
        ("kind", "faces", "to select them", "on their axes, mm"),
        [
            (
                group.kind,
                str(group.count),
                group.selector,
                _points(group.points, extent(part)),
            )
            for group in holes[:_MOST_HOLES]
        ],
    )
    more = len(holes) - _MOST_HOLES
    if more > 0:
        print_text(f"  and {more} more; `gradedesign check --json` lists all")


def print_file_faces(part: Part) -> None:
    """Print the faces that the part's file tells apart; nothing where it tells none."""
    rows = file_faces(part)
    if not rows:
        return
    print_table(
        "Faces of the file",
        ("face", "name", "color", "area mm^2", "surface", "centroid mm"),
        [
            (
                str(row["face"]),
                row["name"] or "",
                row["color"] or "",
                f"{row['area_mm2']:.4g}",
                _surface_words(row),
                point_words(np.array(row["centroid_mm"]), extent(part)),
            )
            for row in rows[:_MOST_FILE_FACES]
        ],
    )
    more = len(rows) - _MOST_FILE_FACES
    if more > 0:
        print_text(f"  and {more} more; `gradedesign check --json` lists all")


def point_words(point: FloatArray, size: float) -> str:
    """Coordinates in mm, without rounding noise beside the size of the part."""
    return f"({', '.join(number(v) for v in without_noise(point, size))})"


def triple(vector: FloatArray, size: float = 0.0) -> str:
    """Three figures for display, without rounding noise relative to each other and a size."""
    largest = max(float(np.abs(vector).max(initial=0.0)), size)
    return f"({', '.join(f'{v:.4g}' for v in without_noise(vector, largest))})"


def extent(part: Part) -> float:
    """Longest edge of the part's box, mm."""
    return float(np.ptp(part.surface.vertices, axis=0).max())


def _surface_words(row: dict[str, Any]) -> str:
    diameter = row["diameter_mm"]
    return (row["surface"] or "") + ("" if diameter is None else f" of {diameter:.4g} mm")


def _points(points: FloatArray, size: float) -> str:
    text = " ".join(point_words(point, size) for point in points[:_MOST_POINTS])
    more = len(points) - _MOST_POINTS
    return text if more <= 0 else f"{text} and {more} more"

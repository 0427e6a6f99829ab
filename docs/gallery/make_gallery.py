"""Draw every installed cell family and every grading: ``python docs/gallery/make_gallery.py``.

Pictures that exist are kept; ``--again`` draws them anew. ``-k WORD`` draws those whose name holds
the word. README.md beside this file is written from the pictures that exist.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from gradedesign.arrays import Field
from gradedesign.errors import GradeDesignError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import cell_increments, cell_pair, row_weights
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import evaluate_shape, spread_points
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.maps.cell_map import CellMap, uniform_map
from gradedesign.geometry.maps.conformal_map import conformal_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.geometry.maps.frame_field import frame_field
from gradedesign.geometry.maps.phase_fields import graded_size_map
from gradedesign.geometry.maps.size_law import size_by_ratio, wall_ratio
from gradedesign.geometry.maps.spherical_map import spherical_map
from gradedesign.geometry.maps.warp_map import MorphingSphere, warp_map
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.boolean import intersection
from gradedesign.program.host.registry import build_registry
from gradedesign.program.pictures.draw import draw as draw_scene
from gradedesign.program.pictures.scene import Layer, Scene

HERE = Path(__file__).parent
#: Relative density of the families' pictures: all families have it.
DENSITY = 0.35
#: Grid steps along a cell, and edge of a picture in pixels.
STEPS, PIXELS = 24, 280
#: Largest picture, bytes.
LARGEST = 60_000

Box = tuple[float, float, float]
Picture = tuple[Field, Box, float]


def draw(path: Path, field: Field, upper: Box, h: float) -> None:
    """Surface of a field in the box from the origin to ``upper``, as a small picture."""
    # Contoured beyond the box and cut by it, as what is printed, so that edges are sharp.
    raw = extract_surface(field, (-2 * h,) * 3, [edge + 2 * h for edge in upper], h)
    surface = intersection(raw, box_surface(upper), subject="the picture")
    layer = Layer(vertices=surface.vertices, faces=surface.faces, colour="#7f9fbf")
    image = Image.open(io.BytesIO(draw_scene(Scene(title="", layers=(layer,))))).convert("RGB")
    pixels = np.array(image)
    # The corner with the axes is left out.
    pixels[int(0.75 * pixels.shape[0]) :, : int(0.15 * pixels.shape[1])] = 255
    image = Image.fromarray(pixels)
    drawn = (pixels < 250).any(axis=2)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    image = image.crop((int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1))
    image.thumbnail((PIXELS, PIXELS), Image.Resampling.LANCZOS)
    image.quantize(24).save(path, optimize=True)
    if path.stat().st_size > LARGEST:
        raise SystemExit(f"{path} has {path.stat().st_size} bytes, more than {LARGEST}")


def family_picture(family: CellFamily) -> Picture:
    """Two cells along each axis of one family, or all that a random one has."""
    parameters = dict(family.parameters)
    sample = evaluate_shape(family, parameters, family.period * spread_points(60_000))
    level = float(np.quantile(sample, DENSITY))

    def field(points: np.ndarray) -> np.ndarray:
        return evaluate_shape(family, parameters, points) - level

    if family.period == 1:
        return field, (2.0, 2.0, 2.0), 1 / STEPS
    return field, (float(family.period),) * 3, 2 / STEPS


def graded(
    family: CellFamily, cell_map: Callable[[np.ndarray], np.ndarray], density: Field
) -> Field:
    """Lattice of a family with a map and a density."""
    cell = calibrate(family)

    def field(points: np.ndarray) -> np.ndarray:
        g = family.shape(cell_map(points), **cell.parameters)
        return np.asarray(g - cell.level_of(density(points)))

    return field


def gradings(families: dict[str, CellFamily]) -> Iterator[tuple[str, Callable[[], Picture]]]:
    """Every grading and cell map by name, each as a function that makes it."""
    sheet, struts = families["gyroid-sheet"], families["bcc"]
    walls = families["gyroid-wall"]
    plain = uniform_map(1.0)

    def even(points: np.ndarray) -> np.ndarray:
        return np.full(points.shape[1:], 0.25)

    def ramp(points: np.ndarray) -> np.ndarray:
        return np.clip(0.1 + 0.07 * points[0], 0.1, 0.5)

    def size_of(points: np.ndarray) -> np.ndarray:
        return 1.4 - 0.15 * points[0]

    def bar(field: Field, step: float = 1 / STEPS) -> Picture:
        return field, (6.0, 2.0, 2.0), step

    def mapped(cell_map: CellMap, step: float = 1 / 20) -> Picture:
        return graded(sheet, cell_map, even), (4.0, 4.0, 2.0), step

    def transition() -> Picture:
        mixed = cell_pair(calibrate(sheet), calibrate(struts))

        def field(points: np.ndarray) -> np.ndarray:
            s = np.clip((points[0] - 2.0) / 2.0, 0.0, 1.0)
            weights = row_weights(s**2 * (3 - 2 * s), 2)
            return mixed.shape(np.concatenate([points, weights])) - 0.3

        return bar(field)

    def graded_size() -> Picture:
        sizes = graded_size_map(size_of, (0, 0, 0), (6, 2, 2), spacing=0.2)
        return bar(graded(sheet, sizes, even))

    def by_ratio() -> Picture:
        ends = wall_ratio(walls, None, np.array([0.1, 0.5]))

        def small_where_dense(points: np.ndarray) -> np.ndarray:
            ratio = wall_ratio(walls, None, ramp(points))
            return size_by_ratio(ratio, (0.7, 1.6), (float(ends[0]), float(ends[1])))

        sizes = graded_size_map(small_where_dense, (0, 0, 0), (6, 2, 2), spacing=0.2)
        return bar(graded(walls, sizes, ramp), 1 / 32)

    def parameter() -> Picture:
        helix = families["bcc-helix"]
        cells = cell_increments(helix, None, "amplitude", (0.1, 0.0), 5)

        def field(points: np.ndarray) -> np.ndarray:
            s = np.clip((points[0] - 0.5) / 5.0, 0.0, 1.0)
            weights = row_weights(s**2 * (3 - 2 * s), 5)
            return cells.shape(np.concatenate([points, weights])) - 0.2

        return bar(field)

    def along(points: np.ndarray) -> np.ndarray:
        x, y = points[0] - 2, points[1] + 3
        v = np.stack([y, -x, 0 * x]) / np.hypot(x, y)
        return v[:, None] * v[None]

    def directions() -> Picture:
        box = (0, 0, 0), (4, 4, 2)
        cells = graded_size_map(
            lambda p: np.ones(p.shape[1:]), *box, spacing=0.2, iterations=0,
            frame_of=frame_field(along, *box, length=1.0),
        )  # fmt: skip
        return graded(families["sc"], cells, even), (4.0, 4.0, 2.0), 1 / 20

    def depth(points: np.ndarray) -> np.ndarray:
        away = np.minimum.reduce([points, np.array([6.0, 2.0, 2.0]).reshape(
            3, *[1] * (points.ndim - 1)) - points]).min(axis=0)  # fmt: skip
        return np.clip(0.5 - 0.4 * away, 0.1, 0.5)

    yield "grading-level", lambda: bar(graded(sheet, plain, ramp))
    yield "grading-struts", lambda: bar(graded(struts, plain, ramp))
    yield "grading-thickness", lambda: bar(graded(walls, plain, ramp))
    yield "grading-ratio", by_ratio
    yield "grading-depth", lambda: bar(graded(sheet, plain, depth))
    yield "grading-size", graded_size
    yield "grading-family", transition
    yield "grading-parameter", parameter
    yield "map-directions", directions
    yield (
        "map-cylindrical",
        lambda: mapped(
            cylindrical_map(
                around=20, radial_size=1.0, axial_size=1.0, inner_radius=2.0, origin=(2, -3, 0)
            )
        ),
    )
    yield "map-spherical", lambda: mapped(
        spherical_map(
            around=24, pole_to_pole=12, radial_size=1.0, inner_radius=3.0, polar_cap=10.0,
            origin=(2, 2, -4), axis=(1, 0, 0),
        )
    )  # fmt: skip
    yield (
        "map-conformal",
        lambda: mapped(
            conformal_map(
                lambda p: np.hypot(np.hypot(p[0] - 2, p[1] - 2), p[2] + 6) - 6,
                1.0,
                normal=(0, 0, 1),
            )
        ),
    )
    sphere = MorphingSphere(
        centre=np.array([2.0, 2.0, 1.0]), stable_radius=0.8, outer_radius=2.2, magnification=1.6
    )
    yield "map-warp", lambda: mapped(warp_map(plain, [sphere]))


def write_index() -> None:
    """A page with every picture that exists."""
    names = sorted(path.stem for path in HERE.glob("*.png"))
    lines = [
        "# Gallery",
        "",
        f"Cell families at a relative density of {DENSITY:g}, two cells along each axis and a",
        "whole period of random ones, gradings and cell maps. `make_gallery.py` draws those that",
        "are missing.",
    ]
    groups = {"Gradings": "grading-", "Cell maps": "map-", "Families": ""}
    left = list(names)
    for heading, start in groups.items():
        chosen = [name for name in left if name.startswith(start)]
        left = [name for name in left if name not in chosen]
        lines += ["", f"## {heading}", ""]
        for row in range(0, len(chosen), 4):
            part = chosen[row : row + 4]
            cells = part + [""] * (4 - len(part))
            lines.append("| " + " | ".join(cells) + " |")
            if row == 0:
                lines.append("|---|---|---|---|")
            pictures = [f"![{n}]({n}.png)" if n else "" for n in cells]
            lines.append("| " + " | ".join(pictures) + " |")
    (HERE / "README.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Draw what is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--again", action="store_true", help="draw pictures that exist, too")
    parser.add_argument("-k", default="", help="only names that hold this")
    options = parser.parse_args()
    families = dict(build_registry().cell_families)
    wanted = [
        *gradings(families),
        *((name, lambda f=family: family_picture(f)) for name, family in families.items()),
    ]
    for name, make in wanted:
        path = HERE / f"{name}.png"
        if options.k not in name or (path.exists() and not options.again):
            continue
        try:
            draw(path, *make())
        except GradeDesignError as error:
            print(f"{name}: {error}")  # noqa: T201  a script tells what it could not draw
        else:
            print(f"{name}: {path.stat().st_size} bytes", flush=True)  # noqa: T201
    write_index()


if __name__ == "__main__":
    main()

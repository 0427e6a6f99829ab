"""Write ``published.md`` and its picture: lattices that others pressed, and what we compute.

``python docs/make_published.py`` from ``cases/published/*.toml`` and ``computed.json`` beside them;
``python docs/make_published.py --compute [SOURCE ...]`` computes that file again first, by the
names of the source files (all: half an hour).
"""

from __future__ import annotations

import json
import sys
import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign import CellFamily, DensityError
from gradedesign.design.resolve.registry import lookup
from gradedesign.fields import periodic_distance_to_level_set
from gradedesign.program.host.registry import build_registry
from gradedesign.properties import calibrate, cell_properties

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "cases" / "published"
REGISTRY = build_registry()
#: Strain of a pressed block; the analysis is linear.
STRAIN = 1e-3
#: A source without a scatter is judged by this one: no study read here repeats moduli better.
SCATTER = 0.10
#: Along a cell denser than its table, of which a layer gives 1 % of the flexibility. Chosen.
VOXELS = 24
#: Grid of the distance to the surface of a cell. Chosen: twice as many move its density by 1e-4.
DISTANCE_STEPS = 48
#: The least slope of shape functions over a cell is about 2 pi and the largest 4 pi: divided by
#: this the function is near enough to a distance for the grid to find its zero.
SLOPE = 8.0
#: Half an edge of the two squares that keep a block from sliding away, cells.
PATCH = 0.5


def sources() -> dict[str, dict[str, Any]]:
    """What every source says, by the name of its file."""
    files = sorted(FOLDER.glob("*.toml"))
    return {f.stem: tomllib.loads(f.read_text(encoding="utf-8")) for f in files}


def modulus(family: CellFamily, rho: float) -> float:
    """Young's modulus along x of the endless lattice over that of its solid, by its table."""
    law = lookup(REGISTRY, "scaling_laws", f"{family.name}-computed")
    return along_x(law.stiffness(rho))


def along_x(stiffness: np.ndarray) -> float:
    """Young's modulus along x."""
    return float(1 / np.linalg.inv(np.reshape(stiffness, (6, 6)))[0, 0])


def layer_modulus(family: CellFamily, rho: float) -> float:
    """The same of a layer, which may be denser than the table reaches."""
    try:
        return modulus(family, rho)
    except DensityError:
        cell = calibrate(family)
        found = cell_properties(cell, rho, resolution=VOXELS, with_surface=False)
        return along_x(found.stiffness)


def family_of(row: dict[str, Any]) -> CellFamily:
    """The cell of a row."""
    found: CellFamily = lookup(REGISTRY, "cell_families", row["cell"])
    return found


def built_density(row: dict[str, Any], rho: float, growth: float) -> float:
    """Density of a layer whose ligaments are wider than designed, mm."""
    cell = calibrate(family_of(row))
    distance = periodic_distance_to_level_set(
        lambda u: cell.family.shape(u, **cell.parameters),
        level=float(cell.level_of(rho)),
        resolution=DISTANCE_STEPS,
    )
    moved = calibrate(replace(cell.family, name="moved", shape=distance, distance=True))
    return float(moved.density_of(0.5 * growth / row["size_mm"]))


def in_series(row: dict[str, Any], densities: list[float]) -> float:
    """Layers of one height between solid ends, one upon the other."""
    soft = np.mean([1 / layer_modulus(family_of(row), rho) for rho in densities])
    return float(1 / ((1 - row["ends"]) * soft + row["ends"]))


def pressed(row: dict[str, Any], *, held: bool) -> float:
    """Modulus of a block of whole cells with free sides between rigid plates, over the solid's.

    By finite cells. Ends are held in all directions or slide; with mirrors an eighth is analysed.
    """
    from finite_cell_solids import analyse, box_face, box_field, problem, region

    from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec
    from gradedesign.mechanics.material.material import Material

    cell, mirrors = calibrate(family_of(row)), row.get("mirrors", False)
    edge = row["block"] / (2 if mirrors else 1)
    level, high = float(cell.level_of(row["density"])), (edge,) * 3
    box, slope = box_field((0, 0, 0), high), 1.0 if cell.family.distance else SLOPE

    def field(points: np.ndarray) -> np.ndarray:
        solid = (cell.family.shape(points, **cell.parameters) - level) / slope
        return np.maximum(solid, box(points))

    faces = {"x": (0, 0), "y": (1, 0), "z": (2, 0), "top": (2, 1)}
    regions = {name: box_face(name, (0, 0, 0), high, *at) for name, at in faces.items()}
    side = "0 mm" if held else "free"
    fix = [FixSpec(region="top", displacement=[side, side, f"{-STRAIN * edge!r} mm"])]
    if mirrors:
        fix += [FixSpec(region=axis, components=axis) for axis in "xyz"]
    elif held:
        fix.append(FixSpec(region="z", components="xyz"))
    else:
        fix.append(FixSpec(region="z", components="z"))
        for name, x, parts in (("left", PATCH, "xy"), ("right", edge - PATCH, "y")):
            corner = np.array([x, edge / 2, 0.0]) - [PATCH, PATCH, 0]
            a, b, c, d = corner + 2 * PATCH * np.array([[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]])
            regions[name] = region(name, [[a, b, c], [a, c, d]])
            fix.append(FixSpec(region=name, components=parts))
    solid = Material(name="of modulus 1", youngs_modulus=1.0, poissons_ratio=0.3,
                     density=1e-9, yield_strength=1.0)  # fmt: skip
    case = LoadCaseSpec(name="press", fix=fix, load=[])
    used = regions if mirrors else {k: r for k, r in regions.items() if k not in ("x", "y")}
    (found,) = analyse(
        problem(field, (0, 0, 0), high, [case], used, solid), 1 / row["per_cell"]
    ).solutions
    return float(2 * found.energy / (edge**3 * STRAIN**2))


def compute(row: dict[str, Any]) -> dict[str, list[float]]:
    """Moduli over the solid's: nominal, where its table reaches, and as built and tested."""
    if "layers" in row:
        nominal = [in_series(row, row["layers"])]
        ((_, by_process),) = lookup(REGISTRY, "processes", row["process"]).strut_size
        by_tomography = row["tomography"] * np.array(row["ligaments_mm"])
        built = [
            in_series(row, list(map(partial(built_density, row), row["layers"], growth)))
            for growth in ([by_process] * len(row["layers"]), by_tomography)
        ]
        return {"nominal": nominal, "built": built}
    try:
        nominal = [modulus(family_of(row), row["density"])]
    except DensityError:
        nominal = []
    if "block" not in row:
        return {"nominal": nominal, "built": nominal}
    ends = (False, True) if row.get("held") else (False,)
    return {"nominal": nominal, "built": [pressed(row, held=held) for held in ends]}


def label(row: dict[str, Any]) -> str:
    """Name of a row."""
    if "layers" in row:
        return f"{row['cell']} in {len(row['layers'])} layers, {row['size_mm']:g} mm"
    return f"{row['cell']} {row['density']:g}"


def distance(row: dict[str, Any], base: float, values: list[float]) -> float:
    """Computed over measured, less one, of the value or the range that comes nearest."""
    measured = row["measured_MPa"] / base
    return min(max(measured, min(values)), max(values)) / measured - 1


def lines(source: dict[str, Any], computed: list[dict[str, Any]]) -> list[str]:
    """Section of a source."""
    head, base = source["source"], source["source"]["base_MPa"]
    doi = f" [{head['doi']}](https://doi.org/{head['doi']})." if head["doi"] else ""
    unit = "of the solid" if base == 1 else "MPa"
    text = [
        f"## {head['name']}", "", f"{head['title']}.{doi}", "", f"- Read: {head['read']}.",
        f"- Specimens: {head['specimens']}.",
        f"- Modulus of the solid: {base:g} MPa: {head['base_origin']}." if base != 1
        else f"- {head['base_origin'].capitalize()}.",
        f"- Why they differ: {head['why']}", "",
        f"| specimen | measured, {unit} | nominal | | as built and tested | |",
        "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for row, found in zip(source["row"], computed, strict=True):
        off = distance(row, base, found["built"])
        within = "within" if abs(off) <= head.get("scatter", SCATTER) else "outside"
        built = " to ".join(f"{base * e:.4g}" for e in found["built"])
        nominal = "below its table | "
        if found["nominal"]:
            far = distance(row, base, found["nominal"])
            nominal = f"{base * found['nominal'][0]:.4g} | {round(100 * far):+d}%"
        measured, far_off = f"{row['measured_MPa']:g}", f"{round(100 * off):+d}%"
        text.append(f"| {label(row)} | {measured} | {nominal} | {built} | {far_off}, {within} |")
    return [*text, ""]


def text() -> str:
    """The page."""
    computed = json.loads((FOLDER / "computed.json").read_text(encoding="utf-8"))
    body: list[str] = []
    offs = []
    for name, source in sources().items():
        body += lines(source, computed[name])
        base = source["source"]["base_MPa"]
        for row, found in zip(source["row"], computed[name], strict=True):
            offs.append(abs(distance(row, base, found["built"])))
    head = (FOLDER / "head.txt").read_text(encoding="utf-8")
    near = sum(off <= SCATTER for off in offs)
    counts = {"rows": len(offs), "near": near, "outside": len(offs) - near}
    return head.format(**counts) + "\n".join(body)


def draw(path: Path) -> None:
    """Predicted over measured."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    computed = json.loads((FOLDER / "computed.json").read_text(encoding="utf-8"))
    figure, axes = plt.subplots(figsize=(7, 4.6), layout="constrained")
    axes.axhspan(1 - SCATTER, 1 + SCATTER, color="#d0d7de", lw=0)
    axes.axhline(1, color="#57606a", lw=1)
    for k, (name, source) in enumerate(sources().items()):
        base, rows = source["source"]["base_MPa"], source["row"]
        measured = np.array([row["measured_MPa"] / base for row in rows])
        for key, fill in (("nominal", "none"), ("built", f"C{k}")):
            points = [
                (m, v / m) for m, f in zip(measured, computed[name], strict=True) for v in f[key]
            ]
            title = source["source"]["name"] if key == "built" else None
            axes.plot(*zip(*points, strict=True), "o", mfc=fill, color=f"C{k}", ms=5, label=title)
    axes.set(xscale="log", yscale="log", xlabel="measured modulus over that of the solid",
             ylabel="predicted over measured")  # fmt: skip
    ticks = (0.4, 0.5, 0.7, 1, 1.5, 2, 3, 4, 5)
    axes.set_yticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Write what the arguments ask for."""
    store = FOLDER / "computed.json"
    if "--compute" in sys.argv:
        sys.path.insert(0, str(ROOT / "tests" / "verification"))
        known = json.loads(store.read_text(encoding="utf-8")) if store.exists() else {}
        asked = sys.argv[sys.argv.index("--compute") + 1 :] or list(sources())
        for name in asked:
            known[name] = []
            for row in sources()[name]["row"]:
                known[name].append(compute(row))
                sys.stdout.write(f"{name} {label(row)} {known[name][-1]}\n")
                sys.stdout.flush()
            words = json.dumps(dict(sorted(known.items())), indent=1) + "\n"
            store.write_text(words, encoding="utf-8")
    (ROOT / "docs" / "published.md").write_text(text(), encoding="utf-8")
    draw(ROOT / "docs" / "pictures" / "published.png")


if __name__ == "__main__":
    main()

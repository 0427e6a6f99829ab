"""Draw the figures of the documentation: ``python docs/make_figures.py``.

The rooms from the order of imports that ``tests/test_architecture.py`` holds, levels and laws from
the installed cells, walls and iterations from the numbers that stand here.
"""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"

#: Wings from the lowest, which are the bands of the picture.
WINGS = ("common", "geometry", "mechanics", "design", "program")

#: Simple cubic wall, one cell thick, over the periodic lattice: docs/validation.md.
WALL = {
    "relative density": (0.12, 0.2, 0.3, 0.45, 0.6),
    "membrane": (1.31, 1.21, 1.14, 1.08, 1.05),
    "bending": (2.93, 2.51, 2.20, 1.87, 1.63),
    "transverse shear": (0.95, 0.86, 0.81, 0.79, 0.81),
}

#: `gradedesign run cases/bracket`: discrepancy of displacement and of stress, utilisation.
ITERATIONS = ((-0.079, -0.046, 0.906), (0.024, 0.016, 1.008), (0.015, 0.0, 1.0))


def import_order() -> list[str]:
    """Rooms of the wings in the order in which they may import each other."""
    tree = ast.parse((ROOT / "tests" / "test_architecture.py").read_text(encoding="utf-8"))
    (order,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ROOMS"
    )
    return [room for room in order if "/" in room]


def rooms_svg() -> str:
    """The rooms in bands; each may import from those before it."""
    order = [room.split("/") for room in import_order()]
    bands = [(wing, [room for of, room in order if of == wing]) for wing in WINGS]
    width, step, left = 106, 58, 190
    most = max(len(rooms) for _, rooms in bands)
    size = f"{left + most * width + 10} {len(bands) * step + 30}"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" '
        'font-family="system-ui,sans-serif" font-size="14" fill="#1b1f24">',
        '<defs><marker id="a" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" '
        'markerHeight="8" orient="auto"><path d="M0 0L8 4L0 8z" fill="#57606a"/></marker></defs>',
        f'<path d="M14 {len(bands) * step}V24" stroke="#57606a" stroke-width="1.5" '
        'marker-end="url(#a)"/>',
        f'<text x="8" y="{len(bands) * step + 20}" fill="#57606a">may import</text>',
    ]
    for row, (title, rooms) in enumerate(bands):
        y = 12 + row * step
        lines.append(f'<text x="30" y="{y + 25}" fill="#57606a">{title}</text>')
        for column, room in enumerate(rooms):
            x = left + column * width
            lines.append(
                f'<rect x="{x}" y="{y}" width="{width - 8}" height="40" rx="6" fill="#eef1ff" '
                f'stroke="#3f51b5" stroke-width="1.5"/><text x="{x + (width - 8) // 2}" '
                f'y="{y + 25}" text-anchor="middle">{room}</text>'
            )
    return "\n".join([*lines, "</svg>\n"])


def draw_level(path: Path) -> None:
    """Slices of a gyroid sheet at three levels, and density against level."""
    import matplotlib.pyplot as plt

    axis = (np.arange(160) + 0.5) / 160 * 2.0 * np.pi
    x, y, z = np.meshgrid(axis, axis, axis[::4], indexing="ij")
    g = np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))
    figure, axes = plt.subplots(1, 4, figsize=(10, 2.6), width_ratios=(1, 1, 1, 1.4))
    for ax, rho in zip(axes, (0.15, 0.3, 0.5), strict=False):
        level = np.quantile(g, rho)
        ax.imshow(level >= g[:, :, 0].T, origin="lower", cmap="Blues", vmax=1.4)
        ax.set_title(f"g ≤ {level:.2f}: density {rho}", fontsize=9)
        ax.set_xticks([]), ax.set_yticks([])
    levels = np.sort(g.ravel())[::200]
    axes[3].plot(levels, np.linspace(0, 1, len(levels)))
    axes[3].set_xlabel("level"), axes[3].set_ylabel("relative density")
    axes[3].grid(alpha=0.3)
    _save(figure, path)


def draw_law(path: Path) -> None:
    """Young's modulus along a cell axis by density, of three cells and of Hashin and Shtrikman."""
    import matplotlib.pyplot as plt

    from gradedesign.mechanics.homogenise.constants import youngs_along
    from gradedesign.program.host.registry import build_registry

    registry = build_registry()
    figure, ax = plt.subplots(figsize=(6, 3.6))
    for cell in ("gyroid-sheet", "gyroid-network", "octet", "bcc"):
        law = registry.scaling_laws[f"{cell}-computed"]
        rho = np.geomspace(*law.window, 60)
        stiffness = np.moveaxis(law.stiffness(rho), -1, 0)
        ax.plot(rho, [youngs_along(c, np.array([1.0, 0, 0])) for c in stiffness], label=cell)
    rho = np.geomspace(0.05, 0.9, 60)
    # Hashin and Shtrikman's upper bound with empty pores, nu 0.3: E = 1 / (1 / 3 G + 1 / 9 K).
    bulk, shear = 1 / 1.2, 1 / 2.6
    k = 4 * shear * bulk * rho / (4 * shear + 3 * bulk * (1 - rho))
    eta = shear * (9 * bulk + 8 * shear) / (6 * (bulk + 2 * shear))
    m = shear * rho * eta / (eta + shear * (1 - rho))
    ax.plot(rho, 9 * k * m / (3 * k + m), "k--", label="upper bound, isotropic")
    ax.set(xscale="log", yscale="log", xlabel="relative density", ylabel="E100 over the solid's E")
    ax.legend(fontsize=8), ax.grid(alpha=0.3, which="both")
    _save(figure, path)


def draw_wall(path: Path) -> None:
    """Stiffness of a thin wall over that of the periodic lattice."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(6, 3.2))
    rho, *rest = WALL.items()
    for name, values in rest:
        ax.plot(rho[1], values, "o-", label=name)
    ax.axhline(1.0, color="k", lw=0.8)
    ax.set(xlabel=rho[0], ylabel="wall over periodic lattice")
    ax.legend(fontsize=8), ax.grid(alpha=0.3)
    _save(figure, path)


def draw_iterations(path: Path) -> None:
    """Discrepancy and utilisation, iteration by iteration."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 2.8))
    numbers = np.arange(1, len(ITERATIONS) + 1)
    displacement, stress, use = (100 * np.array(v) for v in zip(*ITERATIONS, strict=True))
    left.axhline(0, color="k", lw=0.8)
    left.plot(numbers, displacement, "o-", label="displacement")
    left.plot(numbers, stress, "s-", label="stress")
    left.set(xlabel="iteration", ylabel="discrepancy, %", xticks=numbers), left.legend(fontsize=8)
    right.axhline(100, color="k", lw=0.8)
    right.plot(numbers, use, "o-", color="C2")
    right.set(xlabel="iteration", ylabel="utilisation, %", xticks=numbers)
    _save(figure, path)


def scale_rows() -> np.ndarray:
    """Cells, processor seconds and peak memory, GB, of the table of docs/scale.md, ``(n, 3)``.

    Only blocks of one density, 0.3.
    """
    text = (ROOT / "docs" / "scale.md").read_text(encoding="utf-8")
    table = text[text.index("| cells |") :].split("\n\n")[0].splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    return np.array(
        [[float(row[k].split()[0]) for k in (0, 4, 5)] for row in rows if "density" not in row[0]]
    )


def draw_scale(path: Path) -> None:
    """Processor time and memory of finite cells by the number of cells."""
    import matplotlib.pyplot as plt

    cells, seconds, memory = scale_rows().T
    figure, ax = plt.subplots(figsize=(6, 3.2))
    program = 0.25
    for name, values in (("processor seconds", seconds), ("GB above 0.25", memory - program)):
        power = np.polyfit(np.log(cells), np.log(values), 1)[0]
        ax.loglog(cells, values, "o-", label=f"{name}: power {power:.2f} of the cells")
    ax.set_xlabel("gyroid sheet cells of density 0.3, 8 bricks along an edge")
    ax.grid(visible=True, which="both", alpha=0.3)
    ax.legend()
    _save(figure, path)


def _save(figure: object, path: Path) -> None:
    figure.tight_layout()  # type: ignore[attr-defined]
    figure.savefig(path, dpi=90)  # type: ignore[attr-defined]


def main() -> None:
    """Write all of them below docs/pictures."""
    import matplotlib as mpl

    mpl.use("Agg")
    (PICTURES / "rooms.svg").write_text(rooms_svg(), encoding="utf-8")
    draw_level(PICTURES / "level.png")
    draw_scale(PICTURES / "scale.png")
    draw_wall(PICTURES / "wall.png")
    draw_iterations(PICTURES / "iterations.png")
    draw_law(PICTURES / "law.png")


if __name__ == "__main__":
    main()

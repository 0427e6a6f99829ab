"""Figures of matplotlib that need no screen, written whole or not at all."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gradedesign.common.system.atomic import write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = ("#1b6ca8", "#c8553d", "#588157", "#7b5ea7", "#b08900", "#444444")
GREY = "#888888"


def empty_figure(width: float, height: float, title: str) -> Figure:
    """Empty figure, inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(figsize=(width, height), dpi=100, facecolor="white")
    figure.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, 0.05, 1.0, 0.93)))
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=13)
    return figure


def save_figure(path: Path, figure: Figure) -> None:
    """Write a figure as PNG, atomically."""
    write_bytes(path, figure_png(figure))


def figure_png(figure: Figure) -> bytes:
    """A figure as PNG."""
    picture = BytesIO()
    figure.savefig(picture, format="png")
    return picture.getvalue()

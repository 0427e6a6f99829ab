"""The trade-off of a study: mass against the utilisation of each limit, a point for each design."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gradedesign.commands import (
    COLOURS,
    GREY,
    empty_figure,
)

#: Panels beside each other, their edges in inches, and the width of the list of designs.
_ACROSS, _WIDE, _HIGH, _LIST = 2, 5.6, 4.6, 3.6
#: Points whose numbers are all shown; of more only the marked ones.
_MOST_NUMBERED = 40
#: Lines of the list that fit a panel, and letters of a line.
_LINES_PER_PANEL, _LETTERS = 22, 42
_MARKERS = "osD^v<>ph*"
#: Groups that colours and markers tell apart; of more, only non-dominated designs have a colour.
_MOST_GROUPS = 20
#: Masses above are in kg.
_HEAVY_G = 10_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TradeoffPoint:
    """One design in the plot.

    Attributes
    ----------
    label : str
        Values of the design.
    group : str
        Designs of one group share colour and marker, and an entry of the legend.
    utilisation : mapping of limit to float
    marked : bool
        Non-dominated.
    """

    number: int
    label: str
    group: str
    mass_g: float
    utilisation: Mapping[str, float]
    marked: bool


def tradeoff_figure(
    points: Sequence[TradeoffPoint], limits: Sequence[str], *, title: str, note: str
) -> Any:
    """Draw mass against the utilisation of each limit.

    Parameters
    ----------
    limits : sequence of str
        A panel for each.
    note : str
        Line below the panels.

    Returns
    -------
    matplotlib figure
    """
    across = min(_ACROSS, max(1, len(limits)))
    down = max(1, -(-len(limits) // across))
    figure = empty_figure(across * _WIDE + _LIST, down * _HIGH + 0.6, title)
    grid = figure.add_gridspec(down, across + 1, width_ratios=[_WIDE] * across + [_LIST])
    groups = list(dict.fromkeys(point.group for point in points))
    if len(groups) > _MOST_GROUPS:
        groups = []
    for k, limit in enumerate(limits):
        axes: Any = figure.add_subplot(grid[k // across, k % across])
        _draw_panel(axes, points, groups, limit)
    _draw_list(figure.add_subplot(grid[:, across]), points, groups, down)
    figure.text(0.02, 0.01, note, fontsize=9, color="#333333")
    return figure


def _draw_panel(
    axes: Any, points: Sequence[TradeoffPoint], groups: Sequence[str], limit: str
) -> None:
    """Points of one limit; those that are marked have a ring and a bold number."""
    shown = [point for point in points if limit in point.utilisation]
    unit, scale = mass_unit(points)
    axes.axhline(100.0, color="black", linewidth=1.0)
    for point in sorted(shown, key=lambda p: p.marked):
        colour, marker = _style(point, groups)
        x, y = scale * point.mass_g, 100 * point.utilisation[limit]
        broken = max(point.utilisation.values()) > 1.0
        face = "white" if broken else colour
        axes.plot([x], [y], marker, color=colour, markerfacecolor=face, markersize=6)
        if point.marked:
            axes.plot([x], [y], "o", color="black", markerfacecolor="none", markersize=12)
    _number(axes, shown, limit, scale)
    axes.locator_params(axis="x", nbins=6)
    axes.set(xlabel=f"mass [{unit}]", ylabel="utilisation of the limit [%]")
    axes.set_title(textwrap.fill(limit, 52), fontsize=10)
    axes.margins(0.12, 0.14)
    axes.grid(visible=True, color="#e5e5e5", linewidth=0.6)
    axes.set_axisbelow(True)


def mass_unit(points: Sequence[TradeoffPoint]) -> tuple[str, float]:
    """Unit of the masses, and what a gram is in it."""
    heaviest = max((point.mass_g for point in points), default=0.0)
    return ("kg", 1e-3) if heaviest > _HEAVY_G else ("g", 1.0)


def _number(axes: Any, points: Sequence[TradeoffPoint], limit: str, scale: float) -> None:
    """Write the numbers of the designs beside their points, those of near points in one text."""
    numbered = [p for p in points if p.marked or len(points) <= _MOST_NUMBERED]
    if not numbered:
        return
    ordered = sorted(numbered, key=lambda p: (p.mass_g, p.utilisation[limit], p.number))
    wide = max(p.mass_g for p in points) - min(p.mass_g for p in points) or 1.0
    utilisations = [p.utilisation[limit] for p in points]
    high = max(utilisations) - min(utilisations) or 1.0
    clusters: list[list[TradeoffPoint]] = []
    for point in ordered:
        near = (
            c
            for c in clusters
            if c[0].marked == point.marked
            and abs(c[0].mass_g - point.mass_g) < 0.05 * wide
            and abs(c[0].utilisation[limit] - point.utilisation[limit]) < 0.05 * high
        )
        group = next(near, None)
        if group is None:
            clusters.append([point])
        else:
            group.append(point)
    for cluster in clusters:
        marked = cluster[0].marked
        axes.annotate(
            ", ".join(str(point.number) for point in sorted(cluster, key=lambda p: p.number)),
            (scale * cluster[0].mass_g, 100 * cluster[0].utilisation[limit]),
            xytext=(7, 7 if marked else -12),
            textcoords="offset points",
            fontsize=9 if marked else 8,
            fontweight="bold" if marked else "normal",
            color="black" if marked else GREY,
        )


def _draw_list(
    axes: Any, points: Sequence[TradeoffPoint], groups: Sequence[str], down: int
) -> None:
    """Groups by colour, and the marked designs by number, lightest first."""
    from matplotlib.lines import Line2D

    axes.axis("off")
    handles = []
    for group in groups:
        colour, marker = _style(next(p for p in points if p.group == group), groups)
        label = textwrap.fill(group, _LETTERS - 6)
        handles.append(Line2D([], [], color=colour, marker=marker, linestyle="", label=label))
    ring: dict[str, Any] = {
        "color": "black",
        "marker": "o",
        "linestyle": "",
        "markerfacecolor": "none",
    }
    any_marked = any(point.marked for point in points)
    if any_marked:
        handles.append(Line2D([], [], markersize=11, label="non-dominated", **ring))
    if any(max(p.utilisation.values(), default=0.0) > 1.0 for p in points):
        handles.append(Line2D([], [], markersize=6, label="hollow: breaks a limit", **ring))
    legend = axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.0, 1.0), fontsize=9, frameon=False
    )
    lines = ["Non-dominated designs"] if any_marked else []
    unit, scale = mass_unit(points)
    for point in sorted((p for p in points if p.marked), key=lambda p: p.mass_g):
        text = f"{point.number}: {point.label}, {scale * point.mass_g:.4g} {unit}"
        lines += textwrap.wrap(text, _LETTERS, subsequent_indent="    ")
    room = _LINES_PER_PANEL * down - sum(str(h.get_label()).count("\n") + 1 for h in handles)
    if len(lines) > max(room, 3):
        lines = [*lines[: max(room, 3) - 1], "... (the table has all)"]
    axes.figure.draw_without_rendering()
    box = legend.get_window_extent().transformed(axes.transAxes.inverted())
    axes.text(0.02, box.y0 - 0.03, "\n".join(lines), fontsize=9, va="top", transform=axes.transAxes)


def _style(point: TradeoffPoint, groups: Sequence[str]) -> tuple[str, str]:
    """Colour and marker of a design: its group's, or, without groups, whether it is marked."""
    if not groups:
        return (COLOURS[0] if point.marked else GREY), _MARKERS[0]
    k = groups.index(point.group)
    return COLOURS[k % len(COLOURS)], _MARKERS[(k // len(COLOURS) + k) % len(_MARKERS)]

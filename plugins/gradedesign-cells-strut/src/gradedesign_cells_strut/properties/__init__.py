"""Computed property tables of the cells, as plain data with provenance, and their laws."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources

from gradedesign import (
    FiniteSizeTable,
    ScalingLaw,
    read_finite_size_table,
    read_property_table,
    tabulated_law,
)


def computed_laws() -> Iterator[ScalingLaw]:
    """Law of every table in this folder, by name."""
    folder = resources.files(__name__)
    for entry in sorted(folder.iterdir(), key=lambda item: item.name):
        if entry.name.endswith(".json"):
            yield tabulated_law(read_property_table(entry.read_text(encoding="utf-8")))


def finite_size_tables() -> Iterator[FiniteSizeTable]:
    """Every table in the folder ``finite_size``, by name."""
    folder = resources.files(__name__) / "finite_size"
    for entry in sorted(folder.iterdir(), key=lambda item: item.name):
        if entry.name.endswith(".json"):
            yield read_finite_size_table(entry.read_text(encoding="utf-8"))

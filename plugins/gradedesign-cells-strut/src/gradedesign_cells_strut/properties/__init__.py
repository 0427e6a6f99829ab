"""Computed property tables of the cells, as plain data with provenance, and their laws."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources

from gradedesign import ScalingLaw, read_property_table, tabulated_law


def computed_laws() -> Iterator[ScalingLaw]:
    """Law of every table in this folder, by name."""
    folder = resources.files(__name__)
    for entry in sorted(folder.iterdir(), key=lambda item: item.name):
        if entry.name.endswith(".json"):
            yield tabulated_law(read_property_table(entry.read_text(encoding="utf-8")))

"""Identifier of a resource of a 3MF file, which may have several models."""

from __future__ import annotations

from typing import NamedTuple


class ResourceId(NamedTuple):
    """Number of an object or a group of colours, which is unique within its model only.

    Attributes
    ----------
    model : str
        Entry of the package with the model; empty for the root model.
    """

    number: str
    model: str = ""

    def __str__(self) -> str:
        return f"{self.number} of {self.model}" if self.model else self.number

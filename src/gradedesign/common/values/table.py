"""Base of every table of the case file: frozen, and no key beyond those it names."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict
from pydantic_core import PydanticCustomError


class Table(BaseModel):
    """A frozen pydantic model that refuses unknown keys; attribute values are in internal units."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        validate_default=False,
        allow_inf_nan=False,
        hide_input_in_errors=True,
        use_attribute_docstrings=True,
    )

    #: Keys that other commands or programs have here, with what to write instead.
    replaced: ClassVar[Mapping[str, str]] = {}
    #: What its keys are called elsewhere, in small letters, with the key that is meant.
    called: ClassVar[Mapping[str, str]] = {}
    #: How it may be written in one line; empty where the examples of its keys tell.
    example: ClassVar[str] = ""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> dict[str, Any]:
        """The table with its example."""
        body: dict[str, Any] = handler.resolve_ref_schema(reference := handler(schema))
        if cls.example:
            body["examples"] = [tomllib.loads(f"table = {cls.example}")["table"]]
        return reference


def key_error(key: str, message: str) -> PydanticCustomError:
    """Make the error of a check across keys, placed at one key of the table.

    ``key``: key of the table the message belongs to; its line is shown. ``message``: the value and
    the expected one. Returns PydanticCustomError: to be raised inside a model validator.
    """
    return PydanticCustomError("at_key", "{message}", {"key": key, "message": message})

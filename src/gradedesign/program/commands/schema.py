"""``gradedesign schema``: the JSON schemas of case and study files, for editors."""

from __future__ import annotations

import json
from pathlib import Path

from gradedesign.common.system.atomic import write_text
from gradedesign.design.case.schema import CaseFile, schema_json
from gradedesign.errors import PluginError
from gradedesign.program.commands.show import print_json, print_text
from gradedesign.program.host.command import load_command
from gradedesign.program.host.read_case import brought_by


def schema(output: Path | None, *, study: bool) -> None:
    """Print the schema, or write it to a file.

    Raises CaseError if the file cannot be written.
    """
    if study:
        layout = load_command("sweep").layout
        if layout is None:
            raise PluginError("the command 'sweep' does not tell the layout of its study")
        data = schema_json(layout())
    else:
        data = schema_json(CaseFile, brought_by(None))
    if output is None:
        print_json(data)
        return
    write_text(output, json.dumps(data, indent=2, allow_nan=False) + "\n")
    print_text(f"wrote {output}")

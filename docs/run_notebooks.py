"""Execute the notebooks of ``docs/notebooks`` and keep their outputs, scenes as stills.

python docs/run_notebooks.py

Code cells are Python alone, so no kernel is needed: each runs in one namespace, the value of its
last expression is shown as Jupyter shows it. A test executes them again.
"""

from __future__ import annotations

import ast
import io
import json
import re
import tempfile
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any

NOTEBOOKS = Path(__file__).parent / "notebooks"
#: Characters of HTML that are kept; of more, which is a scene, the still.
MOST_HTML = 300_000
#: Of a function: another in every run.
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")
_STILL = re.compile(r"data:image/png;base64,([A-Za-z0-9+/=]+)")


def executed(notebook: dict[str, Any]) -> dict[str, Any]:
    """The notebook with the outputs of a new run, in a folder that is removed."""
    scope: dict[str, Any] = {"__name__": "__main__"}
    cells, count = [], 0
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("cases").symlink_to(NOTEBOOKS.parents[1] / "cases")  # as in the root of the repository
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                count += 1
                outputs = list(_outputs("".join(cell["source"]), scope, count))
                cell = {**cell, "execution_count": count, "outputs": outputs}
            cells.append(cell)
    return {**notebook, "cells": cells}


def _outputs(source: str, scope: dict[str, Any], count: int) -> Iterator[dict[str, Any]]:
    """Run a cell: what it prints, then the value of its last expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with redirect_stdout(printed):
        exec(compile(tree, "<cell>", "exec"), scope)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), scope)
    if text := printed.getvalue():
        yield {"output_type": "stream", "name": "stdout", "text": _lines(text)}
    if value is not None:
        data = {"text/plain": _lines(_ADDRESS.sub("", repr(value)).replace(f"{Path.cwd()}/", ""))}
        draw = getattr(value, "_repr_html_", None)
        html = None if draw is None else draw()
        if html is not None and len(html) <= MOST_HTML:
            data["text/html"] = _lines(html)
        elif html is not None:
            # The page is escaped in its frame; base64 has nothing to escape.
            data["image/png"] = _STILL.search(html)[1]
        yield {
            "output_type": "execute_result",
            "execution_count": count,
            "metadata": {},
            "data": data,
        }


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


if __name__ == "__main__":
    for each in sorted(NOTEBOOKS.glob("*.ipynb")):
        done = executed(json.loads(each.read_text(encoding="utf-8")))
        each.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")

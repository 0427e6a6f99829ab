"""CalculiX (ccx) as an outside peer: a deck in, fields at its nodes out."""

import shutil
import subprocess

import numpy as np
import pytest

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


def run_calculix(deck):
    """Run a deck; its fields as its result file has them, to six digits.

    Returns
    -------
    dict of str to (steps, nodes, 3) array
        ``DISP`` in mm and ``FORC``, the forces of supports and loads on the nodes, in N.
    """
    name = deck.with_suffix("")
    done = subprocess.run(
        ["ccx", "-i", name.name], cwd=deck.parent, capture_output=True, text=True, check=False
    )
    assert "Job finished" in done.stdout, done.stdout[-2000:]
    fields, block = {"DISP": [], "FORC": []}, None
    for line in name.with_suffix(".frd").read_text().splitlines():
        if line.startswith(" -4"):
            block = fields.get(line.split()[1])
            if block is not None:
                block.append([])
        elif block is not None and line.startswith(" -1"):
            block[-1].append([float(line[13 + 12 * k : 25 + 12 * k]) for k in range(3)])
        elif line.startswith(" -3"):
            block = None
    return {field: np.array(steps) for field, steps in fields.items()}

"""STEP files altered by chance: a named refusal, or a closed surface whose volume repair keeps.

Text of the file is altered, so that most files are still read: numbers change, references go
astray, entities vanish. A file whose numbers say another solid gives that one: the reader itself
refuses triangles that enclose another volume than the exact faces (0.2 % and the chords); the
repair that follows must keep it.
"""

import random
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OCP", reason="cadquery-ocp-novtk is not installed")

from gradedesign import GradeDesignError, PartError
from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign_step import cad_reader
from gradedesign_step.cad_reader import read_step

LEVER = Path(__file__).parents[3] / "cases" / "step-part" / "lever.step"
#: Files of a round; each takes a process of its own.
ROUND = 10


def altered_step(rng: random.Random, data: bytes) -> bytes:
    """A number, a reference or a whole entity altered, or bytes wherever they stand."""
    kind = rng.randrange(4)
    if kind == 0:
        a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
        return rng.choice([data[:a], data[:a] + data[a + 20 :], data[:b] + data[a:]])
    pattern = {1: rb"#\d+", 2: rb"-?\d+\.\d*(E-?\d+)?", 3: rb"#\d+ *=[^;]*;"}[kind]
    place = rng.choice(list(re.finditer(pattern, data)))
    new = {
        1: b"#%d" % rng.randrange(2000),
        2: rng.choice([b"0.", b"-1.", b"1.E300", b"1.E-300", b"NAN", b"%.3f" % rng.gauss(0, 30)]),
        3: b"",
    }[kind]
    return data[: place.start()] + new + data[place.end() :]


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("number", range(20))
def test_altered_step_files_are_refused_by_name_or_close(tmp_path, monkeypatch, number):
    monkeypatch.setattr(cad_reader, "TIME_LIMIT_S", 60)
    rng = random.Random(number)
    data, file = LEVER.read_bytes(), tmp_path / "altered.step"
    for turn in range(ROUND):
        file.write_bytes(altered_step(rng, data))
        try:
            raw = read_step(file)
        except PartError as error:
            named = str(error).startswith("altered.step")
            assert named, (number, turn)
            continue
        assert np.isfinite(raw.corners).all(), (number, turn)
        a, b, c = np.moveaxis(raw.corners, 1, 0)
        written = float((a * np.cross(b, c)).sum()) / 6.0
        try:
            surface, _ = build_surface(raw.corners, bodies="all", source="altered.step")
        except GradeDesignError:
            continue
        # The reader has held the triangles to the exact faces; repair keeps what they enclose.
        assert enclosed_volume(surface) == pytest.approx(abs(written), rel=0.01), (number, turn)

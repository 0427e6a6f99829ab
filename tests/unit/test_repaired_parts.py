"""Damaged files through the commands: the true volume or a refusal, and every change counted."""

from __future__ import annotations

import json
from typing import NamedTuple

import numpy as np
import pytest
from damaged_shapes import ANNULUS, CUBE, binary, box, corners_of, cube, ring, rod, swept, text
from small_parts import held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.geometry.formats.read_stl import read_stl


class File(NamedTuple):
    """A file, its true volume in mm^3 (None: to be refused) and words of the refusal or changes."""

    data: bytes
    volume: float | None
    words: str | dict[str, int]
    part: str = ""


def bow_tie():
    outline = np.array([[0.0, 0.0], [30.0, 20.0], [30.0, 0.0], [0.0, 12.0]])
    return swept(np.array([np.column_stack([outline, np.full(4, z)]) for z in (0.0, 10.0)]))


def crumbs():
    """392 cubes of 9.9 mm, each under 0.1 % of a cube of 100 mm, 28 % of the volume together."""
    one = corners_of(cube(9.9, 9.9, 9.9))
    loose = [one + np.array([150.0 + 11.0 * (k % 20), 11.0 * (k // 20), 0.0]) for k in range(392)]
    return np.concatenate([corners_of(cube(100, 100, 100)), *loose])


def far_from(corners):
    stray = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]) + np.array([9e6, 0.0, 0.0])
    return binary(np.concatenate([corners, stray]))


VOID = box((5, 5, 5), (15, 15, 15), reverse=True)
PIN = corners_of(rod(30, 3.5, 64).translate((10, 10, -5)))[:, ::-1]
CRUMB = box((30, 0, 0), (30.3, 0.3, 0.3))
#: Half the product of two neighbouring radii and the sine between them, 64 times.
PIN_AREA = 32.0 * 3.5**2 * np.sin(2.0 * np.pi / 64.0)

FILES = {
    "ring of 1.13 turns": File(binary(ring(1.13)), ANNULUS, {"shells_united": 1}),
    "ring of 1.55 turns": File(binary(ring(1.55)), ANNULUS, {"shells_united": 1}),
    "bow tie": File(binary(bow_tie()), None, "inside out"),
    "reversed cylinder through": File(
        binary(np.concatenate([CUBE, PIN])), 8000.0 - 20.0 * PIN_AREA, {"shells_united": 2}
    ),
    "reversed bar through": File(
        binary(np.concatenate([CUBE, box((8, 8, -5), (12, 12, 25), reverse=True)])),
        7680.0,
        {"shells_united": 2},
    ),
    "void behind the count": File(binary(np.concatenate([CUBE, VOID]), 12), None, "12 more"),
    "body behind the count": File(
        binary(np.concatenate([CUBE, CUBE + 40.0]), 12), None, "12 more", 'bodies = "all"'
    ),
    "text cut between shells": File(
        text(CUBE, VOID).split("endsolid")[0].encode(), None, "'endsolid' is missing"
    ),
    "crumbs of a loose part": File(binary(crumbs()), 1e6 + 392 * 9.9**3, {}, 'bodies = "all"'),
    "crumbs": File(binary(crumbs()), None, "393 separate solids"),
    "spike without sides": File(binary(CUBE[1:]), None, "too large to fill", 'repair = "auto"'),
    "stray facet": File(far_from(CUBE), None, "1 holes"),
    "stray facet, auto": File(far_from(CUBE), 8000.0, {"holes_filled": 1}, 'repair = "auto"'),
    "overlapping crumbs": File(
        binary(np.concatenate([CUBE, CRUMB, CRUMB + 0.1])), 8000.0, {"fragments_dropped": 2}
    ),
}


def generated(folder, file):
    """Write the case of a lattice in a damaged file."""
    (folder / "part.stl").write_bytes(file.data)
    (folder / "case.toml").write_text(
        f'[case]\nname = "damaged"\n[part]\nfile = "part.stl"\nunits = "mm"\n{file.part}\n'
        '[material]\nname = "PA12"\n[lattice]\ncell = "gyroid-sheet"\nsize = "8 mm"\n'
        'density = 0.4\n[output]\nformats = ["stl"]\n'
    )
    return folder / "case.toml"


@pytest.mark.parametrize("name", [name for name, file in FILES.items() if file.volume is None])
def test_generate_refuses(name, tmp_path, cli):
    ended = cli("run", generated(tmp_path, FILES[name]), "-o", tmp_path / "out")
    assert ended.code == 3
    assert FILES[name].words in ended.err


@pytest.mark.parametrize("name", [name for name, file in FILES.items() if file.volume])
def test_the_part_of_a_case_has_the_true_volume(name, tmp_path):
    file = FILES[name]
    part = part_of(load_case(generated(tmp_path, file)), {".stl": read_stl})
    # The ring's chords lose 0.2 %, single precision 1e-6.
    assert part.volume == pytest.approx(file.volume, rel=2e-3 if "ring" in name else 1e-5)
    assert part.report.changes == file.words


def test_generate_prints_no_overlap_twice_and_counts_what_it_changed(tmp_path, cli):
    file = File(binary(ring(1.5137)), ANNULUS, "")
    ended = cli("run", generated(tmp_path, file), "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["repairs"] == {"shells_united": 1}
    # PA12 of the library: 0.93 g/cm^3.
    assert result["solid_mass_g"] == pytest.approx(ANNULUS * 0.93e-3, rel=2e-3)
    assert result["mass_g"] == pytest.approx(0.4 * ANNULUS * 0.93e-3, rel=0.03)


def test_a_run_counts_what_it_changed_in_result_and_report(tmp_path, cli):
    turned = CUBE.copy()
    turned[[3, 7]] = turned[[3, 7], ::-1]
    data = binary(np.concatenate([turned, CUBE[:2], CRUMB, CUBE[:1, [0, 0, 1]]]))
    run = '[run]\nstop_after = "solid"\n[output]\nformats = ["report"]\n'
    (tmp_path / "part.stl").write_bytes(data)
    part = 'file = "part.stl"\nunits = "mm"\nmesh_size = "8 mm"'
    (tmp_path / "case.toml").write_text(
        held_bar(part, name="damaged", force="0 N, 0 N, -1 N")
        + '[limits]\ndisplacement = [{region = "tip", magnitude = "9 mm"}]\n'
        + '[lattice]\ncell = "gyroid-sheet"\nsize = "20 mm"\ndensity = [0.2, 0.5]\n'
        + run
    )
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    changes = {
        "degenerate_removed": 1,
        "duplicates_removed": 2,
        "facets_flipped": 2,
        "fragments_dropped": 1,
    }
    assert result["repairs"] == changes
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    table = report.split("<h2>Input repair</h2>")[1].split("</table>")[0]
    for change, count in changes.items():
        assert f'<td>{change.replace("_", " ")}</td><td class="n">{count}</td>' in table

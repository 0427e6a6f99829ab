"""Bands of displacements against an independent mesh of the printed file, feature by feature."""

import pytest
from oracles.printed_tetrahedra import values_on_tetrahedra
from ten_parts import PARTS

import gradedesign
from gradedesign.design.loop.accepted import NO_SUBMODELS

#: Edge of the larger tetrahedra of the independent mesh, mm; walls are 0.8 mm thick or more.
EDGE = 1.2


@pytest.fixture
def without_bodies_of_its_own(monkeypatch):
    """Leave out the run's own tetrahedra, whose values a band is widened to hold."""
    monkeypatch.setattr("gradedesign.design.loop.accepted.body_fitted", lambda *_: NO_SUBMODELS)


def rows_of(case, tmp_path):
    """Rows of limits of a run on a case, by key, and the case."""
    (tmp_path / "case.toml").write_text(case, encoding="utf-8")
    read = gradedesign.load_case(tmp_path)
    result = gradedesign.run(read, folder=tmp_path / "run")
    assert result.status == "met"
    return {row.key: row for row in result.limits}, read


@pytest.mark.usefixtures("without_bodies_of_its_own")
def test_a_plate_under_pressure_lies_in_its_band(tmp_path):
    """Of 1.5 mm on one cell: by pytetwild 0.01323 mm, see the slow test for it and nine others."""
    (row,) = rows_of(PARTS["pressure on a face"], tmp_path)[0].values()
    assert row.band.low < 0.01317 < 0.01328 < row.band.high
    assert row.value == pytest.approx(0.01323, rel=0.01)
    assert row.band.half_width < 0.07


#: On cut rims of open lattice slivers of solid fill hundredths of an element and move too much: the
#: band of 16 to 20 % to both sides began at 0.0820 mm once, where tetrahedra said 0.0801.
OPEN = pytest.mark.xfail(strict=False, reason="slivers at cut rims: the low end is too high")
FEATURES = [
    pytest.param(feature, marks=OPEN if feature == "pressure on lattice" else [])
    for feature in PARTS
]


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("feature", FEATURES)
@pytest.mark.usefixtures("without_bodies_of_its_own")
def test_the_printed_file_solved_apart_lies_in_the_band(tmp_path, feature):
    """Each displacement, from the tetrahedra of two sizes that its own band extrapolates."""
    rows, case = rows_of(PARTS[feature], tmp_path)
    apart = values_on_tetrahedra(case, tmp_path / "run" / "lattice.stl", EDGE)
    assert apart.keys() <= rows.keys()
    for key, known in apart.items():
        band = rows[key].band
        assert band.low <= known.value <= band.high, (feature, key, known, band)
        # Tetrahedra that do not know it themselves would say nothing.
        assert known.half_width < 0.03

"""The file that is judged is the file that was written, and the one that stays."""

from functools import partial
from types import SimpleNamespace

import pytest

from gradedesign import pipeline
from gradedesign.common.system.progress import ignore
from gradedesign.design.loop import exported_surface as exporting
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.resolve.lattice_files import STL_NAME
from gradedesign.errors import ResourceError
from gradedesign.geometry.contour.islands import Islands
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.program.outputs import printed_files
from gradedesign.program.outputs.printed_files import written_back
from gradedesign.program.store.run_folder import open_run_folder

BOX = box_surface((4.0, 2.0, 1.0))


@pytest.fixture
def out(tmp_path):
    with open_run_folder(tmp_path / "run", "a" * 64, resume=False, overwrite=False) as folder:
        yield folder


def alter(path):
    """Move one corner of the file by about a micrometre."""
    data = bytearray(path.read_bytes())
    data[100] ^= 1
    path.write_bytes(bytes(data))


def test_an_altered_file_is_neither_adopted_nor_read(out):
    path = out.path_of(STL_NAME)
    digest = write_stl(path, BOX)
    out.adopt(STL_NAME, digest)
    assert out.read_bytes(STL_NAME) == path.read_bytes()
    alter(path)
    with pytest.raises(ResourceError, match=r"lattice.stl changed after it was written.*judged"):
        out.read_bytes(STL_NAME)
    with pytest.raises(ResourceError, match=f"expected {digest[:12]}"):
        out.adopt(STL_NAME, digest)
    path.unlink()
    with pytest.raises(ResourceError, match="cannot be read back"):
        out.read_bytes(STL_NAME)


@pytest.fixture
def exported(monkeypatch, out):
    """What `export_surface` returns for a box in the place of a lattice."""
    none = Islands(
        dropped=0,
        dropped_volume=0,
        dropped_share=0,
        pockets=0,
        pocket_volume=0,
        filled=0,
        filled_volume=0,
        filled_share=0,
    )
    monkeypatch.setattr(exporting, "printed_surface", lambda *_, **__: (BOX, none, 1.0))
    plan = SimpleNamespace(
        part=SimpleNamespace(surface=BOX),
        case=SimpleNamespace(
            part=SimpleNamespace(file=None),
            print=None,
            run=SimpleNamespace(memory=8e9),
            lattice=SimpleNamespace(cells=True),
        ),
    )
    solved = SimpleNamespace(division=SimpleNamespace(surface_size=0.5))
    analysed = SimpleNamespace(design=None, result=SimpleNamespace(volume=8.0, solved=solved))
    return lambda: exporting.export_surface(plan, partial(written_back, out), analysed)


def test_a_file_changed_between_writing_and_judging_is_an_error(monkeypatch, exported, out):
    surface, _, digest = exported()
    assert len(surface.faces) == 12
    assert out.artefacts()[STL_NAME].sha256 == digest

    def disturbed(path, written, records):
        digest = write_stl(path, written, records)
        alter(path)
        return digest

    monkeypatch.setattr(printed_files, "write_stl", disturbed)
    with pytest.raises(ResourceError, match="changed after it was written"):
        exported()


def shown(monkeypatch, out, accepted):
    monkeypatch.setattr(pipeline, "shown_of", lambda *given: given[3])
    case = SimpleNamespace(print=None, part=SimpleNamespace(file=None))
    part = SimpleNamespace(surface=BOX)
    setup = SimpleNamespace(plan=SimpleNamespace(case=case, part=part, process=None))
    return pipeline.shown_design(setup, out, Announcer(ignore), (), accepted)


def test_a_file_changed_while_it_is_judged_is_an_error(monkeypatch, exported, out):
    surface, _, digest = exported()
    accepted = SimpleNamespace(
        surface=surface, sha256=digest, analysed=None, iteration=SimpleNamespace(rho=None),
        acceptance=SimpleNamespace(whole=None), bodies=SimpleNamespace(built=None),
    )  # fmt: skip
    assert shown(monkeypatch, out, accepted) is surface
    alter(out.path_of(STL_NAME))
    with pytest.raises(ResourceError, match="changed after it was written"):
        shown(monkeypatch, out, accepted)


def test_the_accepted_design_stays_though_a_later_one_was_written_and_refused(
    monkeypatch, exported, out
):
    surface, _, digest = exported()
    kept = out.read_bytes(STL_NAME)
    out.adopt(STL_NAME, write_stl(out.path_of(STL_NAME), box_surface((4.0, 2.0, 0.5))))
    accepted = SimpleNamespace(
        surface=surface, sha256=digest, analysed=None, iteration=SimpleNamespace(rho=None),
        acceptance=SimpleNamespace(whole=None), bodies=SimpleNamespace(built=None),
    )  # fmt: skip
    assert shown(monkeypatch, out, accepted) is surface
    # The same triangles, perhaps in another order.
    assert len(out.read_bytes(STL_NAME)) == len(kept)
    assert sorted(facets(out.read_bytes(STL_NAME))) == sorted(facets(kept))


def facets(data):
    """Records of a binary STL file, from the least corner of each triangle on."""
    for start in range(84, len(data), 50):
        corners = [data[start + 12 * k : start + 12 * (k + 1)] for k in (1, 2, 3)]
        first = corners.index(min(corners))
        yield tuple(corners[first:] + corners[:first])

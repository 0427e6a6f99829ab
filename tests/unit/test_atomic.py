"""Atomic files: whole or absent, whatever happens while writing."""

import os
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gradedesign.common.system import atomic
from gradedesign.common.system.sealed import read_sealed, write_sealed
from gradedesign.errors import CaseError, ResourceError


def names(folder):
    return sorted(child.name for child in folder.iterdir())


def test_text_is_utf8_and_replaces(tmp_path):
    path = tmp_path / "Näme with space.txt"
    atomic.write_text(path, "alt")
    atomic.write_text(path, "µm ≤ 5 °C")
    assert path.read_bytes() == "µm ≤ 5 °C".encode()
    assert names(tmp_path) == [path.name]


def test_failure_while_writing_keeps_the_old_file(tmp_path):
    path = tmp_path / "result.json"
    atomic.write_bytes(path, b"old")

    def fail_half_way():
        with atomic.replacing(path) as handle:
            handle.write(b"half of the ne")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["result.json"]


def test_missing_folder_and_file_as_folder_are_case_errors(tmp_path):
    with pytest.raises(CaseError, match="missing"):
        atomic.write_bytes(tmp_path / "missing" / "a.txt", b"x")
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(CaseError):
        atomic.write_bytes(tmp_path / "file" / "a.txt", b"x")


def test_full_disk_is_a_resource_error_and_leaves_the_old_file(tmp_path):
    # RLIMIT_FSIZE makes the kernel refuse what exceeds 4 KiB with EFBIG, as a full disk does.
    path = tmp_path / "field.npz"
    atomic.write_bytes(path, b"old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with pytest.raises(ResourceError, match="free disk space"):
            atomic.write_npz(path, field=np.zeros(10_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["field.npz"]


def test_a_killed_writer_leaves_old_content_and_a_recognisable_leftover(tmp_path):
    path = tmp_path / "state.bin"
    atomic.write_bytes(path, b"old")
    program = (
        "import os, signal, sys, pathlib\n"
        "from gradedesign.common.system.atomic import replacing\n"
        "with replacing(pathlib.Path(sys.argv[1])) as handle:\n"
        "    handle.write(b'new'); handle.flush(); os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program, str(path)], check=False)
    assert ended.returncode == -signal.SIGKILL
    assert path.read_bytes() == b"old"
    (leftover,) = (name for name in names(tmp_path) if name != path.name)
    assert atomic.UNFINISHED.fullmatch(leftover)


def test_files_get_the_mode_the_user_asked_for(tmp_path):
    before = os.umask(0o027)
    try:
        atomic.write_text(tmp_path / "a.txt", "a")
    finally:
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o640


def test_objects_are_neither_written_nor_read(tmp_path):
    objects = np.array([{"a": 5}], dtype=object)
    with pytest.raises(ValueError, match="allow_pickle"):
        atomic.write_npz(tmp_path / "a.npz", values=objects)
    assert names(tmp_path) == []
    np.savez(tmp_path / "crafted.npz", values=objects)
    with pytest.raises(ValueError, match="allow_pickle"):
        atomic.read_npz(tmp_path / "crafted.npz")


@pytest.mark.parametrize("content", [b"", b"<html>", b"PK\x03\x04 but no more"])
def test_what_is_no_archive_is_refused(tmp_path, content):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(ValueError, match=r"not an \.npz"):
        atomic.read_npz(tmp_path / "a.npz")


ARRAYS = hnp.arrays(
    dtype=st.sampled_from(["f8", "i4", "u1", "?", "c16", "<U3", ">f4"]),
    shape=hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)


@settings(max_examples=50, deadline=None)
@given(value=ARRAYS, fortran=st.booleans())
def test_arrays_come_back_unchanged(tmp_path_factory, value, fortran):
    path = tmp_path_factory.mktemp("trip") / "a.npz"
    value = np.asarray(value, order="F" if fortran else "C")
    atomic.write_npz(path, file=value, path=np.arange(3))
    read = atomic.read_npz(path)
    assert read.keys() == {"file", "path"}
    assert read["file"].dtype == value.dtype
    assert read["file"].shape == value.shape
    assert read["file"].tobytes() == value.tobytes()


def test_equal_content_has_equal_bytes(tmp_path):
    for name in "ab":
        atomic.write_npz(tmp_path / name, x=np.arange(7.0))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_sealed_file_round_trip_is_a_plain_npz(tmp_path):
    path = tmp_path / "a.npz"
    write_sealed(path, {"stage": "größe", "n": 3}, {"x": np.arange(5)})
    sealed = read_sealed(path)
    assert sealed.header == {"stage": "größe", "n": 3}
    np.testing.assert_array_equal(sealed.arrays["x"], np.arange(5))
    with np.load(path) as archive:  # readable without us
        np.testing.assert_array_equal(archive["x"], np.arange(5))


def test_every_flipped_byte_and_every_cut_of_a_sealed_file_is_noticed(tmp_path):
    path = tmp_path / "a.npz"
    write_sealed(path, {"n": 3}, {"x": np.arange(5)})
    whole = path.read_bytes()
    for place in range(0, len(whole), 3):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        with pytest.raises(ValueError, match="truncated or altered"):
            read_sealed(path)
        path.write_bytes(whole[:place])
        with pytest.raises(ValueError, match="truncated or altered"):
            read_sealed(path)


def test_clock_before_1980_does_no_harm(tmp_path, monkeypatch):
    monkeypatch.setattr("time.time", lambda: 0.0)
    write_sealed(tmp_path / "a.npz", {}, {"x": np.arange(5)})
    assert read_sealed(tmp_path / "a.npz").arrays.keys() == {"x"}


def test_a_writer_of_paths_replaces_whole_files_only(tmp_path):
    path = tmp_path / "lattice.ply"
    path.write_text("old")
    with atomic.replacing_path(path) as unfinished:
        assert unfinished.name == path.name
        unfinished.write_text("new")
        assert path.read_text() == "old"
    assert (path.read_text(), names(tmp_path)) == ("new", ["lattice.ply"])

    def fail_half_way():
        with atomic.replacing_path(path) as unfinished:
            unfinished.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    with pytest.raises(CaseError, match=r"lattice\.ply"), atomic.replacing_path(path):
        pass  # a writer that leaves nothing
    assert (path.read_text(), names(tmp_path)) == ("new", ["lattice.ply"])

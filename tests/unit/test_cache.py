"""The user's cache: found by content, verified, never trusted."""

import logging
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import gradedesign
from gradedesign.common.system import cache
from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.common.system.program_key import program_key
from gradedesign.errors import CaseError

KEY = content_key("some question")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "gradedesign"


def test_folder_follows_xdg(monkeypatch, folder):
    assert cache.cache_folder() == folder
    monkeypatch.setenv("HOME", "/home/someone")
    for ignored in ("", "relative/path"):
        monkeypatch.setenv("XDG_CACHE_HOME", ignored)
        assert cache.cache_folder() == Path("/home/someone/.cache/gradedesign")


def test_no_home_is_a_case_error(monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr("os.path.expanduser", lambda path: path)  # what it does without a home
    with pytest.raises(CaseError, match="XDG_CACHE_HOME"):
        cache.cache_folder()


def test_round_trip_and_absence(folder):
    assert load_arrays("mesh", KEY) is None
    assert not folder.exists()  # looking writes nothing
    store_arrays("mesh", KEY, points=np.arange(6.0).reshape(3, 2), kind=np.array([5]))
    found = load_arrays("mesh", KEY)
    assert found is not None
    np.testing.assert_array_equal(found["points"], [[0, 1], [2, 3], [4, 5]])
    np.testing.assert_array_equal(found["kind"], [5])
    assert load_arrays("other", KEY) is None


def test_what_a_killed_process_was_writing_goes_after_a_day(folder):
    store_arrays("kind", KEY, x=[1.0])
    (entry,) = folder.rglob("*.npz")
    old, young, other = (
        entry.with_name(name)
        for name in (f".a.{'0' * 16}.unfinished", f".b.{'0' * 16}.unfinished", ".c.unfinished")
    )
    for file in (old, young, other):
        file.touch()
    for file in (old, other):
        os.utime(file, (0, 0))
    store_arrays("kind", KEY, x=[1.0])
    assert sorted(entry.parent.iterdir()) == sorted([entry, young, other])


@pytest.mark.parametrize("damage", ["flip", "cut", "empty"])
def test_damaged_entry_is_absent_removed_and_logged(damage, caplog):
    store_arrays("mesh", KEY, points=np.arange(100.0))
    path = cache.entry_path("mesh", KEY)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes({"flip": bytes(data), "cut": bytes(data[:300]), "empty": b""}[damage])
    with caplog.at_level(logging.WARNING):
        assert load_arrays("mesh", KEY) is None
    assert "damaged" in caplog.text
    assert not path.exists()


def test_an_entry_under_the_wrong_name_is_not_used(caplog):
    store_arrays("mesh", KEY, points=np.arange(100.0))
    other = content_key("another question")
    cache.entry_path("mesh", other).parent.mkdir(parents=True)
    cache.entry_path("mesh", KEY).rename(cache.entry_path("mesh", other))
    assert load_arrays("mesh", other) is None
    assert "belongs to" in caplog.text


def test_a_cache_that_cannot_be_written_is_a_warning(tmp_path, monkeypatch, caplog):
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    store_arrays("mesh", KEY, points=np.arange(3))
    assert "nothing cached" in caplog.text


@pytest.mark.parametrize(("kind", "key"), [("../x", KEY), ("mesh", "../" + KEY), ("mesh", "")])
def test_names_cannot_leave_the_cache(kind, key):
    with pytest.raises(ValueError):
        cache.entry_path(kind, key)


def test_different_values_have_different_keys():
    x = np.arange(6.0)
    values = [
        (), (1,), (1.0,), (True,), ("1",), (b"1",), (1, 1), ("11",), ("1", "1"), (np.array(1),),
        (np.array([1]),), (np.array([1.0]),), (np.array([[1.0]]),), (0.0,), (-0.0,),
        (x,), (x.reshape(2, 3),), (x.reshape(3, 2),), (x.astype("f4"),), (x.astype("i8"),),
        (x.astype(">f8"),), (x[:3], x[3:]), (np.zeros((0, 3)),), (np.zeros((3, 0)),),
        ("ab", "c"), ("a", "bc"), ("a", "b", "c"), ("",), ("", ""), (b"",),
    ]  # fmt: skip
    keys = [content_key(*value) for value in values]
    assert len(set(keys)) == len(keys)


def test_any_file_of_the_package_is_in_the_key_of_the_program(tmp_path, monkeypatch):
    """However deep it lies: answers of other code are not used again."""
    deep = tmp_path / "package" / "wing" / "room" / "concept.py"
    deep.parent.mkdir(parents=True)
    monkeypatch.setattr(gradedesign, "__file__", str(tmp_path / "package" / "__init__.py"))
    keys = []
    for text in ("A = 1", "A = 2", "A = 1"):
        deep.write_text(text)
        keys.append(program_key.__wrapped__())
    assert keys[0] == keys[2] != keys[1]


def test_equal_values_have_equal_keys_across_versions():
    # Origin: SHA-256 of the documented encoding "tag:length:bytes", by sha256sum.
    assert content_key() == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    x = np.arange(12.0).reshape(3, 4)
    assert content_key(x) == content_key(np.asfortranarray(x)) == content_key(x[:, ::1].copy())
    assert content_key(x.T) == content_key(x.T.copy())
    assert content_key(np.float64(2.5), np.int32(3)) == content_key(2.5, 3)


@pytest.mark.parametrize("part", [None, [1, 2], {"a": 5}, np.array([None]), np.zeros(2, "i4,f8")])
def test_what_has_no_bytes_of_its_own_is_refused(part):
    with pytest.raises(TypeError):
        content_key(part)


PART = (
    st.binary(max_size=8)
    | st.text(max_size=8)
    | st.integers()
    | st.floats(allow_nan=False)
    | hnp.arrays(
        st.sampled_from(["f8", "f4", "i8", "i4"]),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3),
    )
)


def frozen(part):
    """What makes two parts the same: an independent statement of the rule."""
    if isinstance(part, np.ndarray):
        return ("array", part.dtype.str, part.shape, part.tobytes())
    return (type(part).__name__, repr(part))


@settings(max_examples=100, deadline=None)
@given(a=st.lists(PART, max_size=3), b=st.lists(PART, max_size=3))
def test_keys_are_equal_only_for_equal_sequences(a, b):
    same = [frozen(part) for part in a] == [frozen(part) for part in b]
    assert (content_key(*a) == content_key(*b)) == same

"""The run folder: one owner, every file accounted for, resumable after any kill."""

import json
import logging
import os
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest
from oracles.peak_memory import peak_memory_bytes

from gradedesign.common.system.limits import Deadline, available_memory_bytes
from gradedesign.common.system.progress import Event, ignore
from gradedesign.errors import CaseError
from gradedesign.program.store.run_folder import open_run_folder

HASH = "a" * 64
OTHER = "b" * 64


def opened(path, case_hash=HASH, *, resume=False, overwrite=False):
    return open_run_folder(path, case_hash, resume=resume, overwrite=overwrite)


def files(path):
    return sorted(str(f.relative_to(path)) for f in path.rglob("*") if f.is_file())


def test_artefacts_are_in_the_manifest_with_their_checksum(tmp_path):
    with opened(tmp_path / "run") as run:
        run.write_text("result.json", "{}")
        run.path_of("fields/density.npz").write_bytes(b"rho")
        run.adopt("fields/density.npz")
        run.path_of("print/lattice.stl").write_bytes(b"solid")
        assert set(run.artefacts()) == {"result.json", "fields/density.npz"}
        run.adopt("print/lattice.stl")
    manifest = json.loads((tmp_path / "run" / "run.json").read_text())
    assert manifest["case_hash"] == HASH
    # Origin: `printf '{}' | sha256sum` and `printf solid | sha256sum`.
    digests = {name: entry["sha256"] for name, entry in manifest["artefacts"].items()}
    assert digests["result.json"] == (
        "44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a"
    )
    assert manifest["artefacts"]["print/lattice.stl"]["bytes"] == 5
    assert files(tmp_path / "run") == [
        "fields/density.npz",
        "print/lattice.stl",
        "result.json",
        "run.json",
    ]


def test_damaged_artefacts_are_found(tmp_path):
    with opened(tmp_path / "run") as run:
        for name in ("kept.txt", "altered.txt", "removed.txt"):
            run.write_text(name, "content")
        (run.path / "altered.txt").write_text("contenT")
        (run.path / "removed.txt").unlink()
        assert set(run.damaged_artefacts()) == {"altered.txt", "removed.txt"}


@pytest.mark.parametrize(
    "name",
    ["../x", "/etc/x", "a/../../x", "a//b", "", ".", "..\\x", "a\0b", "run.json", "stages/s.npz",
     ".lock", ".owner"],
)  # fmt: skip
def test_names_stay_below_the_folder(tmp_path, name):
    with opened(tmp_path / "run") as run:
        with pytest.raises(CaseError, match="cannot be the name"):
            run.write_text(name, "x")
        assert files(tmp_path) == ["run/.lock", "run/.owner", "run/run.json"]


def test_links_do_not_lead_outside(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    with opened(tmp_path / "run") as run:
        (run.path / "link").symlink_to(outside)
        with pytest.raises(CaseError, match="link"):
            run.write_text("link/sub/x.txt", "x")
        (run.path / "a.txt").symlink_to(outside / "a.txt")
        with pytest.raises(CaseError, match="link"):
            run.write_text("a.txt", "x")
    assert files(outside) == []


def test_what_was_not_written_cannot_be_adopted(tmp_path):
    with opened(tmp_path / "run") as run, pytest.raises(CaseError, match="not written"):
        run.adopt("lattice.stl")


@pytest.mark.parametrize("where", ["missing/run", "file", "file/run"])
def test_impossible_places_are_case_errors_at_once(tmp_path, where):
    (tmp_path / "file").write_text("x")
    with pytest.raises(CaseError):
        opened(tmp_path / where)
    assert files(tmp_path) == ["file"]


def test_a_read_only_folder_is_a_case_error_at_once(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o555)
    if os.access(folder, os.W_OK):  # a superuser writes anyway; the kernel's own folder is refused
        with pytest.raises(CaseError):
            opened("/proc/gradedesign-run")
    else:
        with pytest.raises(CaseError, match="may write"):
            opened(folder)


def test_results_are_kept_unless_told_otherwise(tmp_path):
    folder = tmp_path / "run"
    with opened(folder) as run:
        run.write_text("result.json", "first")
        run.save_stage("sizing-3", "k", {"rho": np.arange(3.0)}, {})
    (folder / "notes.txt").write_text("of the user")
    with pytest.raises(CaseError, match="resume=True"):
        opened(folder)
    with pytest.raises(CaseError, match="exclude"):
        opened(folder, resume=True, overwrite=True)
    with opened(folder, resume=True) as run:
        assert (run.path / "result.json").read_text() == "first"
        assert "result.json" in run.artefacts()
    with opened(folder, overwrite=True) as run:
        assert run.artefacts() == {}
        assert files(folder) == [".lock", ".owner", "notes.txt", "run.json"]


def test_a_run_that_wrote_nothing_is_no_obstacle(tmp_path):
    opened(tmp_path / "run").close()
    opened(tmp_path / "run").close()


@pytest.mark.parametrize("resume", [True, False])
def test_the_folder_of_another_case_is_refused(tmp_path, resume):
    with opened(tmp_path / "run", OTHER) as run:
        run.write_text("result.json", "theirs")
    with pytest.raises(CaseError, match="another case"):
        opened(tmp_path / "run", resume=resume)
    assert (tmp_path / "run" / "result.json").read_text() == "theirs"
    assert not (tmp_path / "run" / ".lock").exists()
    with opened(tmp_path / "run", overwrite=True) as run:
        assert run.artefacts() == {}


def test_a_folder_of_other_files_is_refused_and_never_emptied(tmp_path):
    (tmp_path / "thesis.txt").write_text("x")
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages" / "mine.npz").write_bytes(b"x")
    with pytest.raises(CaseError, match="not the folder of a run"):
        opened(tmp_path)
    opened(tmp_path, overwrite=True).close()
    assert files(tmp_path) == ["run.json", "stages/mine.npz", "thesis.txt"]


@pytest.mark.parametrize("content", ["{", "[]", '{"schema": 99, "case_hash": "", "artefacts": {}}'])
def test_a_damaged_manifest_is_refused_until_overwritten(tmp_path, content):
    with opened(tmp_path / "run") as run:
        run.write_text("a.txt", "a")
    (tmp_path / "run" / "run.json").write_text(content)
    with pytest.raises(CaseError, match="overwrite=True"):
        opened(tmp_path / "run", resume=True)
    opened(tmp_path / "run", overwrite=True).close()


def test_a_crafted_manifest_cannot_remove_files_elsewhere(tmp_path):
    (tmp_path / "precious.txt").write_text("x")
    opened(tmp_path / "run").close()
    content = json.loads((tmp_path / "run" / "run.json").read_text())
    for name in ("../precious.txt", str(tmp_path / "precious.txt")):
        content["artefacts"] = {name: {"sha256": "", "bytes": 1}}
        (tmp_path / "run" / "run.json").write_text(json.dumps(content))
        with pytest.raises(CaseError, match="outside"):
            opened(tmp_path / "run", overwrite=True)
    assert (tmp_path / "precious.txt").exists()


def test_stages_come_back_for_the_same_key_only(tmp_path, caplog):
    with opened(tmp_path / "run") as run:
        assert run.load_stage("sizing-3", "key") is None
        run.save_stage("sizing-3", "key", {"rho": np.arange(3.0)}, {"mass_g": 12.5, "ok": True})
    with opened(tmp_path / "run", resume=True) as run, caplog.at_level(logging.INFO):
        arrays, meta = run.load_stage("sizing-3", "key")
        np.testing.assert_array_equal(arrays["rho"], [0, 1, 2])
        assert meta == {"mass_g": 12.5, "ok": True}
        assert run.load_stage("sizing-3", "other key") is None
        assert "other input" in caplog.text
        with pytest.raises(ValueError, match="stage name"):
            run.save_stage("../x", "key", {}, {})


@pytest.mark.parametrize("damage", ["flip", "cut", "renamed", "schema"])
def test_a_damaged_stage_is_absent_and_said_so(tmp_path, damage, caplog, monkeypatch):
    if damage == "schema":
        monkeypatch.setattr("gradedesign.program.store.run_folder._SCHEMA", 0)
    with opened(tmp_path / "run") as run:
        run.save_stage("sizing-2", "key", {"rho": np.arange(5.0)}, {})
        run.save_stage("sizing-3", "key", {"rho": np.arange(3.0)}, {})
    monkeypatch.undo()
    path = tmp_path / "run" / "stages" / "sizing-3.npz"
    data = bytearray(path.read_bytes())
    if damage == "flip":
        data[len(data) // 2] ^= 1
        path.write_bytes(data)
    elif damage == "cut":
        path.write_bytes(data[:-1])
    elif damage == "renamed":
        path.with_name("sizing-2.npz").replace(path)
    with opened(tmp_path / "run", resume=True) as run:
        assert run.load_stage("sizing-3", "key") is None
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert "computing it again" in caplog.text


def test_two_runs_in_one_folder(tmp_path):
    with opened(tmp_path / "run"):
        with pytest.raises(CaseError, match=f"in use by process {os.getpid()} on"):
            opened(tmp_path / "run", resume=True)
        program = (
            "import sys, pathlib\n"
            "from gradedesign.program.store.run_folder import open_run_folder\n"
            "open_run_folder(pathlib.Path(sys.argv[1]), 'a' * 64, resume=True, overwrite=False)\n"
        )
        second = subprocess.run(
            [sys.executable, "-c", program, str(tmp_path / "run")], capture_output=True, check=False
        )
        assert f"CaseError: {tmp_path}/run is in use by process {os.getpid()}" in (
            second.stderr.decode()
        )
    opened(tmp_path / "run").close()


HOLDS = """
import pathlib, sys, time
from gradedesign.program.store.run_folder import open_run_folder
run = open_run_folder(pathlib.Path(sys.argv[1]), 'a' * 64, resume=True, overwrite=False)
print('held', flush=True)
time.sleep(60)
"""


def test_the_lock_of_a_killed_run_is_taken_over(tmp_path, caplog):
    run = tmp_path / "run"
    holder = subprocess.Popen([sys.executable, "-c", HOLDS, str(run)], stdout=subprocess.PIPE)
    assert holder.stdout.readline() == b"held\n"
    with pytest.raises(CaseError, match=rf"by process {holder.pid} on {socket.gethostname()}"):
        opened(run, resume=True)
    holder.kill()
    holder.communicate()
    opened(run, resume=True).close()
    assert f"its run (process {holder.pid}) ended without releasing it" in caplog.text
    assert files(run) == ["run.json"]


@pytest.mark.parametrize("content", ["", '{"pid', "[1]"])
def test_an_owner_cut_off_while_written_is_no_obstacle(tmp_path, content):
    (tmp_path / ".lock").touch()
    (tmp_path / ".owner").write_text(content)
    opened(tmp_path).close()
    assert files(tmp_path) == ["run.json"]


def test_the_owner_on_another_machine_is_respected(tmp_path):
    # As where the file system's locks end at the machine.
    owner = {"host": "another-machine", "pid": 1234}
    (tmp_path / ".owner").write_text(json.dumps(owner))
    with pytest.raises(CaseError, match="process 1234 on another-machine"):
        opened(tmp_path)
    assert json.loads((tmp_path / ".owner").read_text()) == owner


CHAOS = """
import itertools, pathlib, sys
import numpy as np
from gradedesign.program.store.run_folder import open_run_folder
with open_run_folder(pathlib.Path(sys.argv[1]), 'a' * 64, resume=True, overwrite=False) as run:
    print('started', flush=True)
    for n in itertools.count(1):
        run.save_stage(f'stage-{n % 5}', 'key', {'x': np.full(20_000, float(n))}, {'n': n})
        run.write_text(f'report-{n % 5}.txt', f'{n} ' * 5_000)
"""


def test_after_a_kill_at_any_moment_everything_found_is_whole(tmp_path):
    folder = tmp_path / "run"
    rng = np.random.default_rng(20260317)
    found = 0
    for _ in range(5):
        writer = subprocess.Popen(
            [sys.executable, "-c", CHAOS, str(folder)], stdout=subprocess.PIPE
        )
        assert writer.stdout.readline() == b"started\n"
        time.sleep(rng.uniform(0.0, 0.2))
        writer.kill()
        writer.communicate()
        assert writer.returncode == -signal.SIGKILL
        with opened(folder, resume=True) as run:
            for k in range(5):
                stage = run.load_stage(f"stage-{k}", "key")
                if stage is not None:
                    np.testing.assert_array_equal(stage[0]["x"], np.full(20_000, stage[1]["n"]))
                    found += 1
            # At most the one file between its own rename and that of the manifest.
            assert len(run.damaged_artefacts()) <= 1
            assert all(".unfinished" not in name for name in files(folder))
    assert found > 0


def test_what_a_killed_exporter_left_is_removed(tmp_path):
    folder = tmp_path / "run"
    open_run_folder(folder, "hash", resume=False, overwrite=False).close()
    left = folder / ".lattice.ply.0123456789abcdef.unfinished"
    left.mkdir()
    (left / "lattice.ply").write_text("half")
    open_run_folder(folder, "hash", resume=True, overwrite=False).close()
    assert not left.exists()


def test_memory_and_deadline():
    # Origin: psutil's own counts for this process and machine.
    resident = psutil.Process().memory_info().rss
    assert resident * 0.5 < peak_memory_bytes() < 100 * resident
    assert 0 < available_memory_bytes() <= psutil.virtual_memory().total
    assert Deadline(1e6).remaining() == pytest.approx(1e6, rel=1e-3)
    assert Deadline(float("inf")).remaining() == float("inf")
    past = Deadline(5.0, start=time.monotonic() - 6.0)
    assert past.remaining() == 0.0
    assert past.expired()
    with pytest.raises(ValueError, match="positive"):
        Deadline(0.0)


@pytest.mark.parametrize("version", [1, 2])
def test_a_container_limit_counts(tmp_path, version):
    # Origin: 4000 limit - 3000 used + 500 of file cache that the kernel gives back = 1500 bytes.
    from gradedesign.common.system.limits import _control_group_rooms

    membership = tmp_path / "cgroup"
    root = tmp_path / "sys"
    if version == 2:
        membership.write_text("0::/job/step\n")
        group, limit, usage, cache = root / "job", "memory.max", "memory.current", "inactive_file"
    else:
        membership.write_text("4:cpu:/\n3:memory:/job/step\n0::/\n")
        group, limit, usage = root / "memory/job", "memory.limit_in_bytes", "memory.usage_in_bytes"
        cache = "total_inactive_file"
    group.mkdir(parents=True)
    (group / limit).write_text("4000\n")
    (group / usage).write_text("3000\n")
    (group / "memory.stat").write_text(f"anon 2500\n{cache} 500\n")
    assert _control_group_rooms(root, membership) == [1500]
    if version == 2:
        (group / limit).write_text("max\n")
        assert _control_group_rooms(root, membership) == []


def test_events_cannot_be_changed():
    values = {"mass_g": 5.0}
    event = Event(stage="sizing", message="iteration 3", values=values)
    values["mass_g"] = 6.0
    assert event.values["mass_g"] == 5.0
    with pytest.raises(TypeError):
        event.values["mass_g"] = 7.0
    ignore(event)

"""`gradedesign mcp` by the package's own client: over standard input and output, and in process."""

import json
import os
import re
import sys
import time
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import psutil
import pytest
import trimesh
from small_parts import SHORT_BAR

pytest.importorskip("mcp", reason="needs the package mcp of gradedesign-mcp")
import anyio
from mcp import Client, StdioServerParameters

from gradedesign_mcp import tools as module
from gradedesign_mcp.bounds import Bounds
from gradedesign_mcp.runs import Runs
from gradedesign_mcp.server import make_server
from gradedesign_mcp.tools import Tools

ROOT = Path(__file__).parents[3]

CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "push"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.5 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.45, 0.60]
"""
)


class Caller:
    """A client whose answers are read, and which a test asks for what is refused."""

    def __init__(self, client):
        self.client = client

    async def call(self, tool, **arguments):
        """The answer to a call that must succeed."""
        answer = await self.client.call_tool(tool, arguments)
        assert not answer.is_error, answer.content[0].text
        if answer.structured_content is None:
            return answer.content[0]
        return answer.structured_content.get("result", answer.structured_content)

    async def refused(self, tool, **arguments):
        """The sentence with which a call is refused."""
        answer = await self.client.call_tool(tool, arguments)
        assert answer.is_error, answer.content
        return answer.content[0].text.removeprefix(f"Error executing tool {tool}: ")


@asynccontextmanager
async def over_pipes(folder, *options):
    """A server as an assistant starts it."""
    command = ["-m", "gradedesign", "mcp", str(folder), *options]
    server = StdioServerParameters(command=sys.executable, args=command, env=dict(os.environ))
    async with Client(server) as client:
        yield Caller(client)


@asynccontextmanager
async def in_process(folder):
    """The same server without a process of its own."""
    bounds = Bounds(root=folder.resolve())
    async with Client(make_server(Tools(bounds=bounds), Runs(bounds=bounds, most=1))) as client:
        yield Caller(client)


@pytest.fixture
def folder(tmp_path):
    """A folder with a case and a part, beside files that are none of the server's business."""
    root = tmp_path / "parts"
    (root / "bar").mkdir(parents=True)
    (root / "bar" / "case.toml").write_text(CASE, encoding="utf-8")
    trimesh.creation.box((16.0, 8.0, 8.0)).export(root / "plate.stl")
    (tmp_path / "outside.toml").write_text(CASE, encoding="utf-8")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "case.toml").write_text(CASE, encoding="utf-8")
    return root


def processes_on(folder):
    """Commands of gradedesign that work on a case or run in a folder; the server is none."""
    found = []
    for process in psutil.process_iter(["cmdline"]):
        words = process.info["cmdline"] or []
        started = "gradedesign" in words and "mcp" not in words
        if started and any(str(folder) in word for word in words):
            found.append(process)
    return found


@pytest.mark.slow
def test_a_run_is_started_over_pipes_and_ends_with_the_server(folder):
    async def go():
        async with over_pipes(folder) as server:
            assert server.client.server_info.name == "gradedesign"
            assert "Never invent loads" in server.client.instructions
            started = await server.call("start_run", case="bar")
            assert (started["run"], started["state"]) == ("runs/bar", "running")
            assert processes_on(folder)
            words = await server.refused("start_run", case="bar", run="runs/other")
            assert words.startswith("runs/bar is running, and 1 may run at a time")
            assert "is running; follow_run" in await server.refused("start_run", case="bar")
            assert "goes on" in await server.refused("read_verdict", run="runs/bar")

    anyio.run(go)
    deadline = time.monotonic() + 10.0
    while processes_on(folder) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert processes_on(folder) == []


def test_paths_that_leave_the_folder_are_refused(folder):
    """By each tool that takes one, without a command being started."""
    (folder / "link.toml").symlink_to(folder.parent / "outside.toml")
    (folder / "door").symlink_to(folder.parent / "outside")
    (folder / "cases").mkdir()
    (folder / "cases" / "case.toml").symlink_to(folder.parent / "outside.toml")
    (folder / "round").symlink_to(folder / "round")
    before = sorted(folder.parent.rglob("*"))

    async def go():
        async with in_process(folder) as server:
            for tool, key, more in (
                ("inspect_part", "part", {}),
                ("propose_case", "part", {"folder": "new"}),
                ("propose_case", "folder", {"part": "plate.stl"}),
                ("read_case", "case", {}),
                ("write_case", "folder", {"text": CASE}),
                ("check_case", "case", {}),
                ("estimate_masses", "case", {}),
                ("judge_body", "case", {"body": "plate.stl"}),
                ("judge_body", "body", {"case": "bar"}),
                ("start_run", "case", {}),
                ("start_run", "run", {"case": "bar"}),
                ("follow_run", "run", {}),
                ("stop_run", "run", {}),
                ("read_verdict", "run", {}),
                ("show_scene", "what", {}),
                ("show_picture", "file", {}),
            ):
                for path, word in (
                    (str(folder / "bar"), "absolute"),
                    ("C:\\parts\\bar", "absolute"),
                    ("C:bar", "absolute"),
                    ("\\\\host\\parts", "absolute"),
                    ("../outside", "'..'"),
                    ("bar/../../outside", "'..'"),
                    ("bar\\..\\..\\outside", "'..'"),
                    ("door", "by a link"),
                    ("door/case.toml", "by a link"),
                    ("link.toml", "by a link"),
                    ("", "below the server's folder"),
                    ("bar\0", "below the server's folder"),
                ):
                    words = await server.refused(tool, **{key: path}, **more)
                    assert word in words, (tool, path, words)
                    assert words.startswith(f"{key}: ")
            # A folder that is none of a link's, with a file that is.
            for tool in ("read_case", "check_case", "start_run"):
                assert "by a link" in await server.refused(tool, case="cases")
            assert "by a link" in await server.refused("write_case", folder="cases", text=CASE)
            assert await server.refused("read_case", case="round")

    anyio.run(go)
    assert sorted(folder.parent.rglob("*")) == before
    assert (folder.parent / "outside.toml").read_text(encoding="utf-8") == CASE


def test_a_case_is_written_whole_or_not_at_all(folder):
    async def go():
        async with in_process(folder) as server:
            said = await server.call("write_case", folder="bar", text=CASE + "# mine\n")
            assert said == "written: bar/case.toml"
            assert await server.call("read_case", case="bar") == CASE + "# mine\n"
            for text, word in (
                ("import os", "no TOML"),
                ("[tool]\nname = 1\n", "no table [case]"),
                (CASE + "#" * 200_000, "has at most 200000"),
            ):
                assert word in await server.refused("write_case", folder="bar", text=text)
                assert await server.call("read_case", case="bar/case.toml") == CASE + "# mine\n"
            assert "there is no 'new'" in await server.refused(
                "write_case", folder="new", text=CASE
            )
            # A mistake is told as the command line tells it, with its line, and without our folder.
            await server.call("write_case", folder="bar", text=CASE.replace("tip", "top", 1))
            words = await server.refused("check_case", case="bar")
            assert words.startswith("bar/case.toml: ")
            assert "case.toml:" in words.split("\n")[1]
            # A case names files of its own folder only, as without --allow-outside.
            outside = CASE.replace('box = ["16 mm", "8 mm", "8 mm"]', 'file = "../plate.stl"')
            assert outside != CASE
            await server.call("write_case", folder="bar", text=outside)
            assert "outside" in await server.refused("check_case", case="bar")

    anyio.run(go)


def test_pictures_are_png_files_of_bounded_size(folder, monkeypatch):
    (folder / "dot.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(8))
    monkeypatch.setattr(module, "_MOST_BYTES", 20)
    (folder / "large.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(30))

    async def go():
        async with in_process(folder) as server:
            shown = await server.call("show_picture", file="dot.png")
            assert (shown.type, shown.mime_type) == ("image", "image/png")
            assert "38 bytes" in await server.refused("show_picture", file="large.png")
            (folder / "case.png").write_text("secret", encoding="utf-8")
            assert "is no PNG" in await server.refused("show_picture", file="case.png")
            assert "cannot be read" in await server.refused("show_picture", file="missing.png")

    anyio.run(go)


def test_what_is_told_is_relative_to_the_folder(tmp_path):
    bounds = Bounds(root=tmp_path)
    told = bounds.told({"a": [str(tmp_path / "x"), 3, None], "b": str(tmp_path)})
    assert told == {"a": ["x", 3, None], "b": "."}
    other = f"{tmp_path}-other/x"
    assert bounds.told(other) == other
    assert Bounds(root=Path(tmp_path.anchor)).told("3 N/mm, 1/K") == "3 N/mm, 1/K"


@pytest.mark.slow
def test_a_case_is_proposed_checked_run_stopped_resumed_and_judged(folder):
    """The whole way on a bar, with the notes of progress that a client gets meanwhile."""
    notes = []

    async def note(progress, _total, message):
        notes.append((progress, message))

    async def to_the_end(server, run):
        told, at = {"state": "running"}, 0
        while told["state"] == "running":
            answer = await server.client.call_tool(
                "follow_run", {"run": run, "after": at, "wait_s": 10.0},
                progress_callback=note,
            )  # fmt: skip
            told = answer.structured_content
            assert told["next"] == at + len(told["lines"])
            at = told["next"]
        return told

    async def go():
        async with over_pipes(folder, "--runs", "2") as server:
            looked = await server.call("inspect_part", part="plate.stl", units="mm")
            assert looked["part"]["volume_mm3"] == pytest.approx(1024.0)
            assert {region["name"] for region in looked["regions"]} == {
                f"{axis}_{side}" for axis in "xyz" for side in ("min", "max")
            }
            assert sorted(path.name for path in folder.iterdir()) == ["bar", "plate.stl"]
            drawn = await server.call(
                "propose_case", part="plate.stl", folder="new", units="mm", repair="auto"
            )
            assert drawn["case"] == "new/case.toml"
            assert (folder / "new" / "plate.stl").is_file()
            assert (await server.call("show_picture", file=drawn["picture"])).type == "image"
            text = drawn["text"]
            for asked, known in (
                ('name = "?"', 'name = "Ti-6Al-4V"'),
                ('fix = [{region = "?"}]', 'fix = [{region = "x_min"}]'),
                ('load = [{region = "?", force = ["? N", "? N", "? N"]}]',
                 'load = [{region = "x_max", force = ["0 N", "0 N", "-100 N"]}]'),
                ('safety_factor = "?"', "safety_factor = 2"),
                ('cell = "?"', 'cell = "gyroid-sheet"\ndensity = [0.45, 0.6]'),
            ):  # fmt: skip
                assert text.count(f"\n{asked}") == 1
                text = text.replace(f"\n{asked}", f"\n{known}")
            # Few unknowns, of whole cells.
            text = re.sub(r'\nsize = "[\d.]+ mm"', '\nsize = "8 mm"\nsize_effects = false', text)
            text = text.replace("\nunits", '\nmesh_size = "4 mm"\nunits')
            await server.call("write_case", folder="new", text=text)
            checked = await server.call("check_case", case="new")
            assert checked["picture"] == "runs/new-check/loads.png"
            assert (folder / checked["picture"]).is_file()
            assert checked["part"]["source"] == "plate.stl"
            estimated = await server.call("estimate_masses", case="new")
            assert estimated["first_answer"]["feasible"]
            judged = await server.call("judge_body", case="new", body="plate.stl", units="mm")
            assert (judged["status"], judged["ended_by"]) == ("met", "judged")
            assert {row["key"]["kind"] for row in judged["limits"]} == {"stress"}
            assert "available: mm" in await server.refused(
                "judge_body", case="new", body="plate.stl", units="furlong"
            )
            page = await server.call("show_scene", what="new")
            assert (folder / page["page"]).read_text(encoding="utf-8").startswith("<!doctype html>")
            # Two at a time; one of them is stopped, and goes on where it was.
            await server.call(
                "write_case", folder="new", text=text + '[run]\nstop_after = "solid"\n'
            )
            await server.call("start_run", case="bar")
            await server.call("start_run", case="new")
            told = await server.call("follow_run", run="runs/bar", wait_s=1.0)
            while not told["lines"]:
                told = await server.call("follow_run", run="runs/bar", wait_s=1.0)
            stopped = await server.call("stop_run", run="runs/bar")
            assert stopped["state"] == "stopped"
            assert len(processes_on(folder / "bar")) == 0
            assert not (folder / "runs" / "bar" / ".owner").exists()
            assert "has ended already" in await server.refused("stop_run", run="runs/bar")
            assert "holds no result.json" in await server.refused("read_verdict", run="runs/bar")
            assert (await to_the_end(server, "runs/new"))["state"] == "ended"
            # Refused at once, or on a busy machine a moment later.
            answer = await server.client.call_tool("start_run", {"case": "new"})
            if not answer.is_error:
                failed = await to_the_end(server, "runs/new")
                assert failed["state"] == "failed"
                assert "holds results already" in failed["error"]
            else:
                assert "holds results already" in answer.content[0].text
            await server.call("start_run", case="bar", resume=True)
            assert processes_on(folder / "bar")
            verdict = await server.call("read_verdict", run="runs/new")
            stored = json.loads((folder / "runs/new/result.json").read_text(encoding="utf-8"))
            assert verdict["status"] == stored["status"] == "partial"
            assert verdict["limits"] == stored["limits"]
            assert verdict["folder"] == "runs/new"
            assert "iterations" not in verdict
            assert (await server.call("show_picture", file="runs/new/loads.png")).type == "image"
            page = await server.call("show_scene", what="runs/new")
            assert page["page"] == "runs/new-scene.html"
            listed = await server.call("list_installed", kind="cells", name="gyroid-sheet")
            assert [cell["name"] for cell in listed["cells"]] == ["gyroid-sheet"]

    anyio.run(go)
    assert notes
    assert all(b[0] > a[0] or a[0] > 2.0 for a, b in pairwise(notes))


@pytest.mark.slow
def test_a_call_that_is_cancelled_ends_its_command(folder):
    async def go():
        async with in_process(folder) as server:
            with anyio.move_on_after(3.0) as scope:
                await server.call("estimate_masses", case="bar")
            assert scope.cancelled_caught
            with anyio.fail_after(10.0):
                while processes_on(folder):
                    await anyio.sleep(0.1)
            # The next command has its turn.
            await server.call("inspect_part", part="plate.stl", units="mm")

    anyio.run(go)


@pytest.mark.slow
def test_a_run_ends_with_a_server_that_is_killed(folder):
    command = [sys.executable, "-m", "gradedesign", "mcp", str(folder)]
    ask = {"jsonrpc": "2.0", "id": 1, "method": "tools/call"}
    ask["params"] = {"name": "start_run", "arguments": {"case": "bar"}}
    hello = {"jsonrpc": "2.0", "id": 0, "method": "initialize"}
    hello["params"] = {"protocolVersion": "2025-06-18", "capabilities": {},
                       "clientInfo": {"name": "test", "version": "1"}}  # fmt: skip
    ready = {"jsonrpc": "2.0", "method": "notifications/initialized"}
    with psutil.Popen(command, stdin=-1, stdout=-1, stderr=-3) as server:
        for message in (hello, ready, ask):
            server.stdin.write(json.dumps(message).encode() + b"\n")
            server.stdin.flush()
            if message is hello:
                assert json.loads(server.stdout.readline())["id"] == 0
        assert '"running"' in server.stdout.readline().decode()
        assert processes_on(folder)
        server.kill()
    deadline = time.monotonic() + 10.0
    while processes_on(folder) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert processes_on(folder) == []

"""Ctrl-C and SIGTERM end a command with 130 and one line, wherever they arrive."""

import ctypes
import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest
from small_parts import box_part, held_bar

from gradedesign.program.commands import lists as list_commands
from gradedesign.program.commands import run as run_module


def kill_self(number):
    os.kill(os.getpid(), number)


def in_a_callback(number):
    """As in libraries that call back from C, which cannot pass an exception on."""
    ctypes.CFUNCTYPE(None, ctypes.c_int)(kill_self)(int(number))
    for _ in range(1000):
        time.sleep(0.01)


class Dying:
    def __init__(self, number):
        self.number = number

    def __del__(self):
        kill_self(self.number)
        time.sleep(0.01)


def in_a_finaliser(number):
    Dying(number)
    for _ in range(1000):
        time.sleep(0.01)


def turned_into_another_exception(number):
    try:
        kill_self(number)
        time.sleep(10)
    except BaseException as cause:
        message = "compilation failed"
        raise RuntimeError(message) from cause


def swallowed_twice(number):
    for _ in range(2):
        try:
            kill_self(number)
            time.sleep(10)
        except BaseException:  # noqa: BLE001 - what is tested
            pass
    time.sleep(10)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    "work", [in_a_callback, in_a_finaliser, turned_into_another_exception, swallowed_twice]
)
def test_a_signal_arrives_though_code_swallows_it(cli, monkeypatch, tmp_path, work, number):
    def command(*args, **options):
        work(number)

    monkeypatch.setattr(run_module, "run", command)
    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    # The command reads the text of the case before it loads anything.
    lattice = '[limits]\nstress = "20 MPa"\n[lattice]\ncell = "bcc"\nsize = "5 mm"\n'
    text = held_bar(box_part(30, 10, 10, 5), name="block") + lattice
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", tmp_path)
    assert ended.code == 130
    assert ended.err == "interrupted; go on with the same command and --resume\n"
    assert {n: signal.getsignal(n) for n in before} == before


def test_cleaning_up_is_not_cut_short(cli, monkeypatch):
    done = []

    def command(*args, **options):
        try:
            kill_self(signal.SIGTERM)
            time.sleep(10)
        finally:
            time.sleep(1.0)  # longer than what repeats the signal
            done.append("cleaned")

    monkeypatch.setattr(list_commands, "materials", command)
    ended = cli("materials")
    assert (ended.code, ended.err, done) == (130, "interrupted\n", ["cleaned"])


COMPILES = """
    import sys, time
    from gradedesign.program.commands import main
    import gradedesign.program.commands.lists as lists

    def compile_kernels(*args, **options):
        import numba
        print("compiling", flush=True)
        for number in range(500):
            @numba.njit(cache=False)
            def kernel(x):
                total = 0.0
                for i in range(x.shape[0]):
                    for j in range(x.shape[1]):
                        total += (x[i, j] - x[j, i]) ** 2 / (1.0 + abs(x[i, j]))
                return total
            import numpy
            kernel(numpy.zeros((2, 2)))

    lists.materials = compile_kernels
    main(["materials"])
"""


@pytest.mark.parametrize(
    "number",
    [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)],
    ids=["int", "term"],
)
@pytest.mark.parametrize("wait", [0.01, pytest.param(0.4, marks=pytest.mark.slow)])
def test_a_signal_while_kernels_compile(tmp_path, number, wait):
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(COMPILES)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        start_new_session=True,
    )
    assert process.stdout.readline() == "compiling\n"
    time.sleep(wait)
    process.send_signal(number)
    _, words = process.communicate(timeout=60)
    assert (process.returncode, words) == (130, "interrupted\n")


def test_a_signal_while_the_commands_are_imported():
    # What is imported first has put its handler in place by then: commands take seconds to load.
    code = (
        "import os, signal, sys, threading\n"
        "from gradedesign.program.commands import main\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'gradedesign.program.commands.app':\n"
        "            os.kill(os.getpid(), signal.SIGTERM)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "main(['materials'])\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120
    )
    assert (ended.returncode, ended.stderr) == (130, "interrupted\n")

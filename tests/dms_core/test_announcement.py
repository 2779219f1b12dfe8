"""Compilation is announced when it happens, once, and not when everything comes from disk."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from dms_core.compiled.compilation import _Announcer
from dms_core.files.config_files import configs

KERNELS = """
from numba import njit

@njit(cache={cache})
def one(x):
    return x + 1

@njit(cache={cache})
def two(x):
    return one(x) + 1
"""
CALL = (
    "from dms_core.compiled.compilation import announce; "
    "announce(); announce(); import kernels; assert kernels.two(1) == 3"
)


@pytest.fixture
def said(tmp_path):
    """Function that calls two kernels in a new process and gives what it says on stderr."""

    def run(cache: bool) -> str:
        (tmp_path / "kernels.py").write_text(KERNELS.format(cache=cache))
        env = os.environ | {"PYTHONPATH": os.pathsep.join([str(configs().parent), str(tmp_path)])}
        return subprocess.run([sys.executable, "-c", CALL], env=env, capture_output=True, text=True, check=True).stderr

    return run


def test_said_once_when_code_is_missing_and_never_when_it_is_there(said):
    assert said(cache=True).count("compiling what is new") == 1
    assert said(cache=True) == ""


def test_said_again_for_what_is_compiled_after_a_pause(tmp_path):
    (tmp_path / "kernels.py").write_text(KERNELS.format(cache=True))
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(configs().parent), str(tmp_path)])}
    call = CALL + "; import time; time.sleep(1.2); assert kernels.two(1.0) == 3.0; assert kernels.two(1.5) == 3.5"
    done = subprocess.run([sys.executable, "-c", call], env=env, capture_output=True, text=True, check=True)
    assert done.stderr.count("compiling what is new") == 2


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def _event(name: str) -> Any:
    """numba's event of one function that is kept on disk."""
    function = SimpleNamespace(__module__="package.file", __name__=name)
    return SimpleNamespace(data={"dispatcher": SimpleNamespace(_cache=object(), py_func=function)})


def test_a_terminal_shows_the_function_and_how_far_it_is_in_one_line():
    stream = _Terminal()
    announcer = _Announcer(stream)
    for name in ("one", "two"):
        announcer.on_start(_event(name))
        announcer.on_end(_event(name))
    begin, *lines = stream.getvalue().split("\r")
    assert begin.count("\n") == 1 and not any("\n" in line for line in lines)
    shown = [line.strip() for line in lines if line.strip()]
    assert [line.rpartition(": ")[2] for line in shown] == ["file.one", "file.two"]
    assert shown[0].startswith("dms_core: 0 of at most ") and shown[1].startswith("dms_core: 1 of at most ")
    # The line is wiped, so that what is printed next does not stand behind it.
    assert lines[-1] == "" and not lines[-2].strip()


def test_elsewhere_there_is_a_line_now_and_then(monkeypatch):
    now, stream = [100.0], io.StringIO()
    monkeypatch.setattr("dms_core.compiled.compilation.time.monotonic", lambda: now[0])
    announcer = _Announcer(stream)
    # Each function needs the next one, which is compiled within it.
    for name, at in (("one", 100.0), ("two", 105.0), ("three", 110.5), ("four", 111.0)):
        now[0] = at
        announcer.on_start(_event(name))
    begin, *lines = stream.getvalue().splitlines()
    assert "compiling what is new" in begin
    assert len(lines) == 1 and lines[0].endswith("10 s: file.three")


def test_functions_that_are_not_kept_are_not_announced(said):
    assert said(cache=False) == ""


def test_words_go_to_what_stderr_is_now(monkeypatch):
    first, second = io.StringIO(), io.StringIO()
    monkeypatch.setattr("sys.stderr", first)
    announcer = _Announcer()
    first.close()
    monkeypatch.setattr("sys.stderr", second)
    announcer.on_start(_event("one"))
    assert "compiling what is new" in second.getvalue()

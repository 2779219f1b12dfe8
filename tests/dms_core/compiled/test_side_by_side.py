"""Compiling in two processes: when the second one begins, and what it leaves."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from dms_core.compiled import side_by_side
from dms_core.files.config_files import configs

WORK = """
from pathlib import Path

def first():
    Path(__file__).with_name("first").touch()

def second():
    raise SystemExit("the second piece of work fails")
"""


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """No second process has begun, and none of the code of a function is on disk; gives that function."""
    monkeypatch.setattr(side_by_side, "_process", None)
    monkeypatch.setattr(side_by_side, "_done", set())
    monkeypatch.setattr(side_by_side, "processors", lambda: 2)
    monkeypatch.setattr(side_by_side.atexit, "register", lambda *function: None)
    (tmp_path / "pieces.py").write_text(WORK)
    monkeypatch.syspath_prepend(str(tmp_path))
    return SimpleNamespace(_cache=SimpleNamespace(cache_path=str(tmp_path), fits=False))


def test_the_first_process_waits_for_what_it_names(fresh, tmp_path):
    side_by_side.begin(["pieces:first", "pieces:second"], fresh)
    side_by_side.wait_for("pieces:first")
    assert (tmp_path / "first").exists()
    # Work that fails is no reason to wait for ever: the first process then compiles what it finds missing.
    side_by_side.wait_for("pieces:second")
    assert side_by_side._process is not None and side_by_side._process.wait(10) != 0
    assert side_by_side._done == {"pieces:first"}


def test_nothing_begins_where_the_code_is_on_disk(fresh):
    fresh._cache.fits = True
    side_by_side.begin(["pieces:first"], fresh)
    assert side_by_side._process is None


def test_nothing_begins_on_one_processor(fresh, monkeypatch):
    monkeypatch.setattr(side_by_side, "processors", lambda: 1)
    side_by_side.begin(["pieces:first"], fresh)
    assert side_by_side._process is None
    side_by_side.wait_for("pieces:first")


def test_the_code_of_an_order_is_compiled_ahead(tmp_path):
    """In a process of its own, against an empty folder: what is compiled there is found on disk."""
    call = (
        "from dms_core.assembly import order_code, residual; order_code.compile_order_code(); "
        "print(len(residual.evaluate_newton.signatures), len(residual.evaluate_rates.signatures))"
    )
    env = os.environ | {"PYTHONPATH": str(configs().parent)}
    done = subprocess.run([sys.executable, "-c", call], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "1"]

"""Compilation is announced when it happens, once, and not when everything comes from disk."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from dms_core.config_files import configs

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


def test_functions_that_are_not_kept_are_not_announced(said):
    assert said(cache=False) == ""

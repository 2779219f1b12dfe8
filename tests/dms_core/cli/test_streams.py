"""Standard output and error that are closed, full, or of another encoding: a command does its work all the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dms_core.files.config_files import configs

ROOT = configs().parent
MODEL = """
name: Knochenbr\u00fcche \u2192 \u00b0
bodies:
- {kind: rigid_body, name: b\u00e4r, mass: 1.0, inertia: [1.0, 1.0, 1.0]}
"""
pytestmark = pytest.mark.skipif(os.name == "nt", reason="redirects as a POSIX shell does")


def shell(line: str, folder: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """Run a line in which PYTHON stands for the interpreter."""
    return subprocess.run(
        ["sh", "-c", line.replace("PYTHON", f"'{sys.executable}'")],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)} | env, capture_output=True, text=True,
        errors="replace", check=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    "closed",
    [pytest.param(">&-", marks=pytest.mark.slow), pytest.param("2>&-", marks=pytest.mark.slow), ">&- 2>&- <&-"],
)
def test_closed_streams(tmp_path, closed):
    done = shell(f"PYTHON -m dms_core schema --out page.md {closed}", tmp_path)
    assert done.returncode == 0 and done.stderr == ""
    assert (tmp_path / "page.md").read_text().startswith("# Model files")


def test_a_full_standard_output_is_one_sentence(tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    done = shell("PYTHON -m dms_core schema > /dev/full", tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("error: standard output: No space left on device; ") and done.stderr.count("\n") == 1


@pytest.mark.parametrize("encoding", ["ascii:strict", pytest.param("latin-1", marks=pytest.mark.slow)])
def test_signs_that_an_encoding_does_not_have_are_replaced(tmp_path, encoding):
    (tmp_path / "model.yaml").write_text(MODEL, encoding="utf-8")
    done = shell("PYTHON -m dms_core check model.yaml", tmp_path, PYTHONIOENCODING=encoding, LC_ALL="C", PYTHONUTF8="0")
    assert done.returncode == 0 and done.stderr == "" and "?" in done.stdout


@pytest.mark.parametrize("columns", ["1", pytest.param("9", marks=pytest.mark.slow)])
def test_help_comes_to_an_end_in_a_narrow_terminal(tmp_path, columns):
    done = shell("timeout 60 PYTHON -m dms_core run --help", tmp_path, COLUMNS=columns)
    assert done.returncode == 0 and "--t-end" in done.stdout


def test_a_deleted_folder_is_named(tmp_path):
    done = shell("mkdir gone && cd gone && rmdir ../gone && PYTHON -m dms_core schema --out page.md", tmp_path)
    assert done.returncode == 2 and done.stderr == "error: the current folder was deleted; change to another one.\n"


def test_a_dash_is_no_file(tmp_path):
    done = shell("PYTHON -m dms_core schema --out -", tmp_path)
    assert done.returncode == 2 and "standard output is /dev/stdout" in done.stderr and not list(tmp_path.iterdir())

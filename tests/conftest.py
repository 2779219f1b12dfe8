"""Ctrl-C as in a terminal, and the built wheel in an environment of its own, for the tests of what is shipped."""

from __future__ import annotations

import signal
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from dms_core.files.config_files import configs

ROOT = configs().parent


def pytest_configure() -> None:
    """A shell's background job ignores Ctrl-C, and so would every process that the tests send it to."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def installed(tmp_path_factory) -> tuple[Path, Path]:
    """Interpreter of a new environment with the wheel in it, and its site-packages."""
    pytest.importorskip("hatchling", reason="the build backend is not installed; `make test` installs it")
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, ROOT]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = folder.glob("exo_env-*.whl")
    # Dependencies come from this environment by path, behind the wheel's own packages; the network is not needed.
    venv.create(folder / "empty", with_pip=False)
    python = folder / "empty" / "bin" / "python"
    (site,) = (folder / "empty" / "lib").glob("python*/site-packages")
    unpack = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", site, wheel]
    subprocess.run(unpack, check=True, capture_output=True)
    shared = [p for p in sys.path if p.endswith("site-packages")]
    (site / "dependencies.pth").write_text("\n".join(shared) + "\n")
    return python, site

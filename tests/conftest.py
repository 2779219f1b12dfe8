"""What processes of the tests have in common, and the wheel in an environment of its own, as it is shipped."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from dms_core.files.config_files import configs

ROOT = configs().parent


FIRST = (
    "from exo_env.envs.elbow_lift import ElbowLiftVectorEnv; worlds = ElbowLiftVectorEnv(1); worlds.reset(seed=0); "
    "worlds.step(worlds.action_space.sample())"
)
"""Code that most tests need, those of the installed wheel among them."""


def pytest_configure(config: pytest.Config) -> None:
    """Set what all processes of the tests have in common, and compile once what several would compile side by side."""
    # A shell's background job ignores Ctrl-C, and so would every process that the tests send it to.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Tests run side by side, and threads of OpenMP that wait for a core spin: a training took five times its work.
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    # Hundreds of modules of tests are rewritten and compiled again in each session where nothing is kept.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    # Collections of garbage were a tenth of the time, as often as they come by default.
    gc.set_threshold(20_000)
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        subprocess.run([sys.executable, "-c", FIRST], cwd=ROOT, capture_output=True, check=False)


def pytest_collection_finish() -> None:
    """What thousands of collected tests are made of stays: garbage collections need not go through it each time."""
    gc.freeze()


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

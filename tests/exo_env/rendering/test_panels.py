"""Figures are drawn with matplotlib's own settings, whatever the user's say."""

from __future__ import annotations

import os
import subprocess
import sys

from dms_core.config_files import configs

DRAW = """
import sys
from pathlib import Path
from exo_env.rendering.panels import drawn, panels, save

@drawn
def draw(path):
    figure, axes = panels(1, 1, (2.0, 2.0))
    axes[0, 0].set_title("angle [deg]")
    return save(figure, path)

draw(Path(sys.argv[1]))
"""


def run(folder, name, **env):
    return subprocess.run(
        [sys.executable, "-c", DRAW, name], cwd=folder, env=os.environ | {"PYTHONPATH": str(configs().parent)} | env,
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_settings_of_the_user_do_not_reach_a_figure(tmp_path):
    assert run(tmp_path, "plain.png").returncode == 0
    # TeX is hardly ever there, and would draw another picture if it were.
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\naxes.facecolor: red\n")
    done = run(tmp_path, "other.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "other.png").read_bytes() == (tmp_path / "plain.png").read_bytes()


def test_an_unknown_backend_is_named(tmp_path):
    done = run(tmp_path, "plain.png", MPLBACKEND="nonsense")
    said = done.stderr.splitlines()[-1]
    assert done.returncode == 1 and "nonsense" in said and "MPLBACKEND" in said and said.startswith("dms_core.errors.")

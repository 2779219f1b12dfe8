"""Outside projects (curls/, steady/) use the built wheel, without the checkout and without the optional packages."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from dms_core.files.config_files import configs

CHECKOUT = configs().parent
BLOCKED = ("torch", "stable_baselines3", "sb3_contrib", "tensorboard", "pygame", "matplotlib", "imageio", "moviepy")

BLOCK = f"""
import sys

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {BLOCKED!r}:
            raise ImportError(f"{{name}} is not to be imported here")

sys.meta_path.insert(0, Block())
"""


def _lend_machine_code(site: Path) -> None:
    """Put what was compiled for the checkout beside the same sources in `site`, so that a minute is saved."""
    for package in ("dms_core", "exo_env"):
        for code in [p for end in ("nbi", "nbc") for p in (CHECKOUT / package).rglob(f"__pycache__/*.{end}")]:
            to = site / code.relative_to(CHECKOUT)
            to.parent.mkdir(exist_ok=True)
            shutil.copyfile(code, to)


@pytest.fixture(scope="module")
def run(installed, tmp_path_factory):
    """Function that runs the installed interpreter in a folder with nothing but the project."""
    python, site = installed
    _lend_machine_code(site)
    folder = tmp_path_factory.mktemp("project")
    for name in ("curls", "steady"):
        shutil.copytree(Path(__file__).with_name(name), folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    # Python imports sitecustomize before anything else, in the processes of a vector environment too.
    (folder / "sitecustomize.py").write_text(BLOCK)
    plain = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def call(*arguments: str, first: Path | None = None) -> subprocess.CompletedProcess[str]:
        """`first`: a folder that is searched for modules before the installed ones."""
        env = plain | {"PYTHONPATH": os.pathsep.join(map(str, [*([first] if first else []), folder]))}
        return subprocess.run([python, *arguments], cwd=folder, env=env, capture_output=True, text=True, check=False)

    return call


def test_the_project_trains_on_its_own_task(run, installed):
    done = run("-m", "curls")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert Path(found["file"]).is_relative_to(installed[1])
    assert str(CHECKOUT) not in found["path"]
    # What the project set is what it got.
    assert 2.5 <= found["load"] <= 3.0 and 0.4 <= found["strength"] <= 0.5 and found["weight_of_tracking"] == 2.0
    # 50 steps at a weight of 2; weak arms under 3 kg lag behind without help.
    assert 100.0 > found["returns"]["full"] > found["returns"]["none"] + 5.0
    assert np.isfinite(found["returns"]["none"])


@pytest.mark.parametrize("package", ["torch", "stable_baselines3", "pygame", "matplotlib"])
def test_the_block_works(run, package):
    done = run("-c", f"import {package}")
    assert done.returncode == 1 and "is not to be imported here" in done.stderr


def test_rendering_without_pygame_says_what_to_install(run):
    done = run("-c", "import gymnasium; gymnasium.make('curls:curls/HeavyCurl-v0', render_mode='rgb_array')")
    said = done.stderr.splitlines()[-1]
    assert done.returncode == 1 and "rendering needs pygame-ce" in said and 'extra "pictures"' in said


@pytest.fixture(scope="module")
def without_the_lift(run, installed, tmp_path_factory) -> Path:
    """A folder with an exo_env from which the lift task is missing, with what numba has compiled of the rest."""
    folder = tmp_path_factory.mktemp("without")
    shutil.copytree(installed[1] / "exo_env", folder / "exo_env")
    (folder / "exo_env" / "tasks" / "lift.py").unlink()
    return folder


def test_tasks_devices_forces_arms_and_patients_of_its_own(run, without_the_lift):
    """Three actions and no reference, then an arm of two muscles: alone as in a batch, with no file of the lift."""
    done = run("-m", "steady", first=without_the_lift)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert Path(found["file"]).is_relative_to(without_the_lift) and not found["lift"]
    still, two = found["HoldStill"], found["TwoMuscles"]
    for each in (still, two):
        assert each["equal"] and each["steps"] == 60 and not each["reference_seen"]
        assert np.isfinite(each["rewards"]).all() and each["rewards"][0] < each["rewards"][1]
        # Nobody lifts anything, so there is no smoothness of a lift.
        assert each["left_out"] == {"smoothness_sparc": ["repetitions"]}
        assert np.isfinite([each["measures"][k] for k in ("return", "reward.stillness", "peak_tension_N")]).all()
    assert still["actions"] == 3 and still["water"] and 0.02 <= still["tremor"] <= 0.05
    assert still["observed"][-1] == "sum.total_tension"
    assert two["actions"] == 2 and two["muscles"] == ["TRIlat", "BRA"] and not two["water"]


def test_an_own_task_costs_no_more_than_the_built_in_one(run):
    done = run("-m", "steady", "--speed")
    assert done.returncode == 0, done.stderr
    # 1.25 was measured: a third rope and its motor are in its equations. A Python call a step would give 2 and more.
    assert json.loads(done.stdout)["ratio"] < 2.0

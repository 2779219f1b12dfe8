"""The wheel carries the agents under the name exo_agents, with the files that they read."""

import json
import os
import subprocess

import pytest

from agents.policies.learned import shipped_policies
from tests.agents.tiny import config_file
from tests.outside.test_outside import _lend_machine_code

OWN = """
import numpy as np
from exo_agents.policies import Policy


class Full(Policy):
    title, action_mode = "full", "pid_setpoint"

    def reset(self, env):
        pass

    def __call__(self, observation, info):
        return np.array([0.0, 1.0])
"""
BY_IMPORT = """
import sys
import exo_agents
from exo_agents.environment import ENVIRONMENT, make
from exo_agents.policies import POLICIES, find_policy, shipped_policies
from exo_agents.training.config import Config
print(exo_agents.__file__)
print(list(POLICIES), shipped_policies(), [m for m in sys.modules if m == "agents" or m.startswith("agents.")])
policy = find_policy("learned")
env = make(ENVIRONMENT, action_mode=policy.action_mode, patient="stroke_mild", episode_duration=0.2)
observation, info = env.reset(seed=0)
policy.reset(env)
print(policy(observation, info).shape)
"""


@pytest.fixture
def run(installed, tmp_path):
    """Function that runs the installed interpreter in a folder with nothing but a policy of one's own."""
    python, site = installed
    _lend_machine_code(site)
    (tmp_path / "own.py").write_text(OWN)
    env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def call(*arguments):
        return subprocess.run(
            [python, *map(str, arguments)], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )

    return call


def test_the_folder_travels_under_a_name_of_its_own(installed):
    _, site = installed
    assert (site / "exo_agents" / "policies" / "__init__.py").is_file() and not (site / "agents").exists()
    assert (site / "dms_core" / "configs" / "policies" / "learned" / "weights.safetensors").is_file()
    assert (site / "dms_core" / "configs" / "baselines" / "baselines.yml").is_file()
    assert (site / "dms_core" / "configs" / "agents" / "ppo.yml").is_file()


def test_shipped_policies_and_baselines_act_by_import(run, installed):
    done = run("-c", BY_IMPORT)
    assert done.returncode == 0, done.stderr
    file, names, shape = done.stdout.splitlines()
    assert file.startswith(str(installed[1])) and shape == "(2,)"
    assert names.endswith(f"{shipped_policies()} []")


@pytest.mark.slow
def test_policies_are_evaluated_and_trained(run, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("sb3_contrib")
    out = tmp_path / "out"
    options = ["--patients", 1, "--repetitions", 1, "--out", out / "evaluation"]
    done = run("-m", "exo_agents", "evaluate", "--policy", "pid", "learned", "own:Full", *options)
    assert done.returncode == 0, done.stderr
    found = json.loads((out / "evaluation" / "evaluation.json").read_text())["policies"]
    assert list(found) == ["pid", "learned", "own:Full"]
    pid, own = (found[name]["episodes"][0]["measures"]["return"] for name in ("pid", "own:Full"))
    assert pid == own
    done = run("-m", "exo_agents", "train", "--config", config_file(tmp_path), "--out", out / "run")
    assert done.returncode == 0, done.stderr
    assert json.loads((out / "run" / "run.json").read_text())["sessions"][0]["git"] is None


@pytest.mark.slow
def test_messages_and_old_names_have_the_installed_name(run):
    done = run("-m", "exo_agents", "evaluate", "--policy", "model.zip", "--out", "out")
    assert done.returncode == 2 and "python -m exo_agents export model.zip --trust" in done.stderr
    done = run("-c", "import exo_agents.learned")
    assert "'exo_agents.learned' is now 'exo_agents.policies.learned'" in done.stderr

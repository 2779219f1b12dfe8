"""Policies that a user brings: a class of one's own, and a model of Stable-Baselines3."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from agents.__main__ import main
from agents.policies import Policy, find_policy
from dms_core.errors import InputError

HERE = "tests.agents.policies.test_own_policy"


class Half(Policy):
    """Half the authority, always."""

    title, action_mode = "half", "pid_setpoint"

    def reset(self, env):
        self.authority = 0.5

    def __call__(self, observation, info):
        return np.array([0.0, 2.0 * self.authority - 1.0])


class Unfinished(Policy):
    title = "unfinished"

    def __call__(self, observation, info):
        return np.zeros(2)


class Stranger:
    pass


def test_a_class_is_evaluated_under_its_name(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    arguments = ["--policy", f"{HERE}:Half", "pid", "--patients", "1", "--out", str(tmp_path)]
    assert main(["evaluate", *arguments]) == 0
    assert f"{HERE}:Half" in capsys.readouterr().out
    assert find_policy(f"{HERE}:Half").title == "half"


@pytest.mark.parametrize(
    "name, said",
    [
        (f"{HERE}:Nobody", "expected module:Class that Python can import"),
        ("nowhere_at_all:Nobody", "No module named 'nowhere_at_all'"),
        (f"{HERE}:Stranger", r"expected a subclass of agents.policies.policy.Policy, got <class .*Stranger"),
        (f"{HERE}:Unfinished", "the class lacks action_mode, reset; see Policy"),
    ],
)
def test_what_is_no_policy_is_named(name, said):
    with pytest.raises(InputError, match=said):
        find_policy(name)


@pytest.mark.slow
def test_a_zip_says_how_it_becomes_a_policy_and_the_command_works(tmp_path, capsys):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3 import PPO

    from agents.environment import ENVIRONMENT, make_sb3_worlds

    path = tmp_path / "model.zip"
    worlds = make_sb3_worlds(ENVIRONMENT, 1)
    PPO("MlpPolicy", worlds, policy_kwargs={"net_arch": [4]}).save(path)
    worlds.close()
    assert main(["evaluate", "--policy", str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "carries pickles" in said and said.count("\n") == 1
    command = said.rpartition("the folder: ")[2].split()
    command[command.index("MODE")] = "rope_tension"  # only who trained it knows
    assert command[:3] == ["python", "-m", "agents"]
    done = subprocess.run([sys.executable, *command[1:]], cwd=Path(__file__).parents[3], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = find_policy(str(tmp_path / "model_policy")).description
    assert (found.algorithm, found.action_mode) == ("ppo", "rope_tension")

"""The command `soak`: any environment, any device, and mistakes."""

import gymnasium
import pytest
import yaml

from dms_core.files.config_files import config_file
from exo_env.__main__ import main
from exo_env.envs import lookup
from exo_env.envs.elbow_lift import ElbowLiftEnv


class ShortEnv(ElbowLiftEnv):
    """An environment of a user's own, of episodes of a tenth of a second."""

    def usual_duration(self, settings):
        return 0.1


@pytest.fixture
def own_env():
    name = "mine/Short-v0"
    gymnasium.register(id=name, entry_point=ShortEnv, disable_env_checker=True)
    yield name
    del gymnasium.registry[name]


def printed(capsys) -> dict[str, str]:
    lines = (line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    return {line[0]: line[1] for line in lines if len(line) == 2}


def test_an_environment_of_ones_own_is_found_by_its_id(own_env, capsys):
    assert main(["soak", "--steps", "20", "--env", own_env]) == 0
    found = printed(capsys)
    # Five control periods an episode: the default environment would do one of 300.
    assert found["episodes"] == "4" and found["ends"] == "{'time': 4}"


def test_an_older_version_is_looked_up_as_everywhere(capsys):
    lookup._say_once.cache_clear()
    assert main(["soak", "--steps", "5", "--env", "exo_env:exo/ElbowLift-v0"]) == 0
    assert "exo/ElbowLift-v0 is now exo/ElbowLift-v2" in capsys.readouterr().err


def test_a_device_of_ones_own_and_another_drive(tmp_path, capsys):
    device = yaml.safe_load(config_file("exoskeletons/elbow.yaml").read_text())
    device["lower_link"]["mass"] *= 1.5
    path = tmp_path / "heavy.yaml"
    path.write_text(yaml.safe_dump(device))
    assert main(["soak", "--steps", "10", "--exoskeleton", str(path), "--action-mode", "pid_setpoint"]) == 0
    assert printed(capsys)["not_finite_or_outside"] == "0"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--steps", "0"], "--steps 0: expected a whole number from 1"),
        (["--seed", "-1"], "--seed -1: expected a whole number from 0"),
        (["--env", "exo/Nothing-v0"], "environment 'exo/Nothing-v0' is not registered. There are: exo/ElbowLift-v2"),
        (["--env", "no_such_module:a/B-v0"], "module 'no_such_module' cannot be imported"),
        (["--env", "CartPole-v1"], "environment 'CartPole-v1' is a CartPoleEnv: expected one built on AssistanceEnv"),
        (["--exoskeleton", "leg"], "exoskeleton = 'leg': expected one of elbow"),
    ],
)
def test_mistakes_are_named(arguments, complaint, capsys):
    assert main(["soak", *arguments]) == 2
    assert complaint in capsys.readouterr().err

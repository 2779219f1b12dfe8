"""Policies that see single channels, and channels of one name in two groups."""

from typing import ClassVar

import numpy as np
import pytest

from agents.__main__ import main
from agents.environment import ENVIRONMENT, make
from agents.evaluation.comparison.evaluate import evaluate
from agents.policies.assist_as_needed import AssistAsNeeded
from agents.policies.learned import Description, LearnedPolicy, find_policy, world_facts
from agents.policies.network import Architecture
from agents.policies.policy import Channels
from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.lift import LiftTask
from exo_env.tasks.observation.channels import Channel
from tests.agents.tiny import config_file

TWO = ("device.angle", "privileged.load")
SHORT = {"episode_duration": 0.2}


class LiftSeenTwice(LiftTask):
    """A second group with an angle: how much the elbow is off the reference. The device's is that of its hinge."""

    def declared_groups(self, parts):
        return super().declared_groups(parts) | {"imu": [Channel("angle", 2.0, -3.0, 3.0, reading="error")]}


class LiftSeenTwiceEnv(ElbowLiftEnv):
    task_type: ClassVar = LiftSeenTwice


@pytest.mark.parametrize("observation", [["device"], ["privileged", "device"], ["emg", "device.angle"], list(TWO)])
def test_a_description_holds_the_observation_that_was_asked_for(observation):
    facts = world_facts(make(ENVIRONMENT, observation=observation))
    assert facts["observation"] == tuple(observation)
    # An environment made after it shows the very same.
    assert world_facts(make(ENVIRONMENT, observation=list(facts["observation"]))) == facts


def test_a_policy_of_single_channels_is_saved_loaded_and_run(tmp_path):
    facts = world_facts(make(ENVIRONMENT, observation=list(TWO)))
    shape = Architecture(inputs=2, hidden=(3,), activation="tanh", output="clip", normalised=False)
    generator = np.random.default_rng(0)
    arrays = {k: generator.uniform(-1.0, 1.0, s) for k, s in shape.shapes().items()}
    description = Description(
        title="made", algorithm="ppo", environment=ENVIRONMENT, exo_env="0", env_kwargs={}, steps=0,
        architecture=shape, **facts,
    )  # fmt: skip
    LearnedPolicy(description, arrays).save(tmp_path / "policy")
    found = find_policy(str(tmp_path / "policy"))
    assert found.observation == TWO and [part["name"] for part in found.description.structure] == ["angle", "load"]
    (episode,) = evaluate([found], "stroke_mild", 1, 0, **SHORT)["policies"][found.name]["episodes"]
    assert episode["measures"]["length_s"] == pytest.approx(0.2)


def test_a_policy_trained_on_single_channels_is_evaluated(tmp_path, capsys):
    pytest.importorskip("sb3_contrib")
    file = config_file(tmp_path, env_kwargs={"observation": list(TWO), **SHORT}, n_timesteps=32)
    assert main(["train", "--config", str(file), "--out", str(tmp_path / "run")]) == 0
    found = find_policy(str(tmp_path / "run"))
    assert found.observation == TWO and found.network.shape.inputs == 2
    assert np.isfinite(
        evaluate([found], "stroke_mild", 1, 0, **SHORT)["policies"][found.name]["summary"]["return"]["value"]
    )


def test_channels_of_one_name_are_told_apart_by_their_groups():
    env = LiftSeenTwiceEnv(observation=["device", "imu"], noise=False)
    env.reset(seed=0)
    for _ in range(25):
        observation, *_ = env.step(np.full(2, -1.0))
    channels, readings = Channels(env), env.readings()
    # Observations are float32.
    assert channels.read(observation, "device.angle") == pytest.approx(readings["exo_angle.angle"], rel=1e-6)
    assert channels.read(observation, "imu.angle") == pytest.approx(readings["tracking_error"], rel=1e-6)
    assert abs(readings["tracking_error"]) > 1e-3
    with pytest.raises(InputError, match="reads 'emg.emg', which is not observed; there are device.angle"):
        channels.read(observation, "emg.emg")


def test_a_baseline_reads_the_device_whatever_stands_beside_it():
    actions = []
    for observation in (["device"], ["device", "imu"]):
        env, acting = LiftSeenTwiceEnv(observation=observation), AssistAsNeeded()
        seen, info = env.reset(seed=1)
        acting.reset(env)
        actions.append([acting(seen, info).tolist()])
        for _ in range(5):
            seen, _, _, _, info = env.step(actions[-1][-1])
            actions[-1].append(acting(seen, info).tolist())
    assert actions[0] == actions[1]

"""Filtered observations, held actions, and a critic that sees more: in the worlds of a training and in its policy."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from agents.__main__ import main
from agents.policies.network import Architecture, Network
from agents.training.settings.config import Config
from dms_core.errors import InputError
from tests.agents.tiny import config_file, content

pytest.importorskip("sb3_contrib")

from stable_baselines3.common.vec_env import DummyVecEnv

from agents.environment import ENVIRONMENT, make_sb3_worlds
from agents.training.learners.critic import actor_size, seen_places
from agents.training.worlds import observed_settings, wrapped
from agents.training.wrappers.action_repeat import ActionRepeat
from agents.training.wrappers.low_pass import LowPassObservations, kept_shares

LENGTH, HOLD, TIMES = 7, 3, (0.1, 1.0)
SLOW = {"traces": list(TIMES), "hold": HOLD, "critic": ["privileged"], "eval_every": 10**6}
PARITY = 1e-6
"""PyTorch computes in single precision, whose round-off is 6e-8 times sums of some ten terms."""


class Numbers(gymnasium.Env):
    """Episodes of seven steps of random numbers, all of which it keeps; a reward is the action."""

    observation_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)

    def __init__(self, seed):
        self.generator, self.shown = np.random.default_rng(seed), []

    def _next(self):
        self.shown[-1].append(self.generator.uniform(-1.0, 1.0, 2).astype(np.float32))
        return self.shown[-1][-1]

    def reset(self, *, seed=None, options=None):
        self.shown.append([])
        return self._next(), {}

    def step(self, action):
        return self._next(), float(action[0]), False, len(self.shown[-1]) > LENGTH, {}


def test_traces_are_low_pass_filters_that_an_episode_begins_anew():
    kept = kept_shares(TIMES, 0.02)
    np.testing.assert_allclose(kept, np.exp([-0.2, -0.02]))
    one, other = Numbers(0), Numbers(1)
    worlds = LowPassObservations(DummyVecEnv([lambda: one, lambda: other]), kept, 1)
    assert worlds.observation_space.shape == (4,)
    seen, last = [worlds.reset()], {}
    for k in range(2 * LENGTH):
        observations, _, over, told = worlds.step(np.zeros((2, 1)))
        seen.append(observations)
        if over.any():
            last[k] = [t["terminal_observation"] for t in told]
    assert sorted(last) == [LENGTH - 1, 2 * LENGTH - 1]
    for i, env in enumerate((one, other)):
        memory, found = np.zeros(2), [o[i] for o in seen[:LENGTH]] + [last[LENGTH - 1][i]]
        for k, (shown, got) in enumerate(zip(env.shown[0], found, strict=True)):
            memory = np.full(2, shown[0]) if k == 0 else memory + (1.0 - np.array(kept)) * (shown[0] - memory)
            np.testing.assert_allclose(got, [*shown, *memory], atol=1e-6)
        first = env.shown[1][0]
        np.testing.assert_allclose(seen[LENGTH][i], [*first, first[0], first[0]], atol=1e-6)


def test_a_network_remembers_and_holds_as_the_worlds_do():
    env, kept = Numbers(3), kept_shares(TIMES, 0.06)
    worlds = LowPassObservations(ActionRepeat(DummyVecEnv([lambda: env]), HOLD), kept, 2)
    wanted = [worlds.reset()[0], worlds.step(np.zeros((1, 1)))[0][0], worlds.step(np.zeros((1, 1)))[0][0]]
    shape = Architecture(
        inputs=6, traces=kept, hold=HOLD, hidden=(), outputs=6, activation="tanh", output="clip", normalised=False
    )
    # An identity shows what the first layer gets.
    network = Network(shape, {"layer.0.weight": np.eye(6), "layer.0.bias": np.zeros(6)})
    for _ in range(2):
        network.reset()
        found = [network(o) for o in env.shown[0][:LENGTH]]
        for k, got in enumerate(found):
            np.testing.assert_allclose(got, wanted[k // HOLD], atol=1e-6)


def test_rewards_of_a_held_action_stop_at_the_end_of_an_episode():
    env = Numbers(0)
    worlds = ActionRepeat(DummyVecEnv([lambda: env]), HOLD)
    worlds.reset()
    rewards, ends = [], []
    for action in (0.1, 0.2, 0.3):
        _, reward, over, told = worlds.step(np.array([[action]]))
        rewards.append(reward[0])
        ends.append(bool(over[0]))
        assert ("terminal_observation" in told[0]) == ends[-1]
    # Seven steps: three, three and one.
    np.testing.assert_allclose(rewards, [0.3, 0.6, 0.3], atol=1e-6)
    assert ends == [False, False, True]


def test_the_policy_acts_as_in_pytorch_whatever_its_critic_saw(tmp_path):
    from agents.evaluation.episodes.episode import judged
    from agents.training.files.run_folder import RunFolder
    from agents.training.run import TrainingRun

    folder, config = RunFolder(tmp_path / "run"), Config.of(content("ppo", SLOW), "ppo")
    folder.begin(config, 0)
    run = TrainingRun(folder, config, 0, lambda steps, evaluation: None, judged)
    run.run()
    policy, statistics, kept = run.policy(), run.model.get_vec_normalize_env(), kept_shares(TIMES, HOLD * 0.02)
    size, everything = run.curve.env.observation_space.shape[0], run.model.observation_space.shape[0]
    assert policy.network.shape.inputs == 3 * size < everything
    generator, memory = np.random.default_rng(5), None
    for k in range(30):
        observation = generator.normal(0.5, 1.0, size).astype(np.float32)
        if k % HOLD == 0:
            memory = np.tile(observation, (2, 1)) if memory is None else memory
            memory = memory + (1.0 - np.array(kept)[:, None]) * (observation - memory)
            of_critic = generator.normal(0.0, 1.0, everything - 3 * size)
            seen = np.concatenate([observation, of_critic, memory.ravel()]).astype(np.float32)
            wanted, _ = run.model.predict(statistics.normalize_obs(seen), deterministic=True)
        assert np.abs(policy.network(observation) - wanted).max() < PARITY


def test_a_critic_of_its_own_is_for_ppo_alone(tmp_path, capsys):
    for algorithm, changes in (("sac", {}), ("ppo", {"frame_stack": 2})):
        file = config_file(tmp_path, algorithm, {"critic": ["privileged"]}, **changes)
        assert main(["train", "--config", str(file), "--out", str(tmp_path / "run")]) == 2
        assert "training.critic" in capsys.readouterr().err
        assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "critic, actor",
    [(("privileged.load",), 12), (("privileged",), 12), (("device.last_action", "privileged"), 10), ((), 13)],
)
def test_a_channel_of_the_critic_is_hidden_from_the_actor(critic, actor):
    # 12 numbers of the device, of which the last two are its last action, and the load.
    worlds = make_sb3_worlds(ENVIRONMENT, 1, observation=["device", "privileged.load"])
    assert actor_size(worlds, critic) == actor and seen_places(worlds, critic, 0) == list(range(actor))
    with pytest.raises(InputError, match=r"'load' is not observed; there are device, device\.angle"):
        actor_size(worlds, ["load"])
    with pytest.raises(InputError, match="expected what only the critic sees behind all else"):
        actor_size(worlds, ["device"])
    worlds.close()


def test_a_critic_of_one_channel_is_trained_with(tmp_path):
    found = content("ppo", {"critic": ["privileged.load"]}, env_kwargs={"observation": ["device.angle", "emg"]})
    worlds = wrapped(Config.of(found, "ppo"), 0)
    # An angle and six activations.
    assert actor_size(worlds, ["privileged.load"]) == 7 and worlds.observation_space.shape == (8,)
    worlds.close()


def test_the_critic_sees_more_than_what_the_environment_shows_by_itself(monkeypatch):
    from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftSettings

    class Narrow(ElbowLiftSettings):
        observation: Any = ("device.angle",)

    monkeypatch.setattr(ElbowLiftEnv, "settings_type", Narrow)
    config = Config.of(content("ppo", {"critic": ["privileged"]}), "ppo")
    assert observed_settings(config)["observation"] == ["device.angle", "privileged"]
    assert "observation" not in observed_settings(Config.of(content("ppo"), "ppo"))


@pytest.mark.parametrize(
    "name, said",
    [("load", "group 'load' is unknown"), ("privileged.wings", "has no channel 'wings'"), ("device.angle", "twice")],
)
def test_a_name_that_the_critic_cannot_see_is_refused_before_a_folder_is_made(name, said, tmp_path, capsys):
    file = config_file(tmp_path, "ppo", {"critic": [name]})
    assert main(["train", "--config", str(file), "--out", str(tmp_path / "run")]) == 2
    errors = capsys.readouterr().err
    assert "training.critic: observation" in errors and said in errors and errors.count("\n") == 1
    assert not (tmp_path / "run").exists()

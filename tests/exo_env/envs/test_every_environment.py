"""What holds for every environment that comes with this package: checker, batches, copies, pages."""

import copy
import inspect
import re
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from exo_env.envs.lookup import environments

IDS = environments()
SHORT = {"episode_duration": 0.16}


def made(name, **settings):
    return gymnasium.make(name, disable_env_checker=True, **settings).unwrapped


def test_they_are_all_known():
    assert {name.rpartition("-")[0] for name in IDS} == {"exo/ElbowLift", "exo/HiddenIntent", "exo/NewPatient"}


@pytest.mark.parametrize("name", IDS)
def test_the_checker_finds_nothing(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(made(name, **SHORT), skip_render_check=True)


@pytest.mark.parametrize("name", IDS)
def test_a_batch_is_single_environments(name):
    groups = list(made(name).task.groups)
    settings = {**SHORT, "observation": groups}
    worlds, alone = gymnasium.make_vec(name, num_envs=3, **settings), made(name, **settings)
    worlds.reset(seed=[3, 4, 5])
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (8, 3, *alone.action_space.shape)).astype(np.float32)
    seen = [worlds.step(a) for a in actions]
    for i, seed in enumerate((3, 4, 5)):
        alone.reset(seed=seed)
        for k in range(8):
            observation, reward, terminated, *_ = alone.step(actions[k, i])
            np.testing.assert_array_equal(seen[k][0][i], observation)
            assert seen[k][1][i] == reward and seen[k][2][i] == terminated
            if terminated:
                break


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("mode", ["rope_tension", "assist_moment", "impedance"])
def test_every_action_mode_goes_on_from_a_copy(name, mode):
    env = made(name, action_mode=mode, episode_duration=1.0)
    env.reset(seed=1)
    actions = np.random.default_rng(1).uniform(-0.6, 0.2, (12, *env.action_space.shape))
    for a in actions[:6]:
        env.step(a)
    other = copy.deepcopy(env)
    for a in actions[6:]:
        found = [e.step(a) for e in (env, other)]
        np.testing.assert_array_equal(found[0][0], found[1][0])
        assert found[0][1] == found[1][1]


@pytest.mark.parametrize("name", [n for n in IDS if "NewPatient" not in n])
def test_the_page_says_what_the_environment_has(name):
    env = made(name)
    page = inspect.getdoc(type(env))
    table = re.findall(r"^\| +\d+ +\| +([^|]+?) +\| +(\S+) +\| +(\S+) +\| +(\S+) +\| +(\S+) +\|$", page, re.MULTILINE)
    parts = [(s, label) for s in env.observation_structure for label in s.labels]
    assert len(table) == len(parts)
    for (channel, low, high, unit, scale), (part, label), least, most in zip(
        table, parts, env.observation_space.low, env.observation_space.high, strict=True
    ):
        assert channel == (f"{part.name}, {label}" if label else part.name)
        assert (float(low), float(high), unit, float(scale)) == (float(least), float(most), part.unit, part.scale)
    weights = dict(re.findall(r"^\| (\w+) +\| .+ \| ([\d.]+) +\|$", page, re.MULTILINE))
    assert {k: float(v) for k, v in weights.items() if k in env.task.terms} == env.weights.model_dump()
    assert f"({env.duration:g} s)" in page

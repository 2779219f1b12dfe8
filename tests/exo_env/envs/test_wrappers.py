"""Every wrapper of Gymnasium that makes sense here works around one environment and around a batch."""

import contextlib
import inspect
import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as vector_wrappers

ID, STEPS = "exo/ElbowLift-v2", 18
SHORT = {"episode_duration": 0.2}
F = np.float32


def _half(x):
    return x * F(0.5)


SINGLE = {
    "DelayObservation": (2,), "DtypeObservation": (np.float64,), "DiscretizeObservation": (3, True),
    "FlattenObservation": (), "FrameStackObservation": (3,), "TransformObservation": (_half, None),
    "MaxAndSkipObservation": (2,), "NormalizeObservation": (), "AddRenderObservation": (),
    "ReshapeObservation": ((3, 4),), "RescaleObservation": (F(-1.0), F(1.0)), "TimeAwareObservation": (),
    "ClipAction": (), "DiscretizeAction": (5, True), "TransformAction": (_half, None),
    "RescaleAction": (F(-2.0), F(2.0)), "StickyAction": (0.5,), "RepeatAction": (2,), "ClipReward": (-1.0, 1.0),
    "TransformReward": (lambda r: 2.0 * r,), "NormalizeReward": (), "TimeLimit": (7,), "Autoreset": (),
    "PassiveEnvChecker": (), "OrderEnforcing": (), "RecordEpisodeStatistics": (), "RenderCollection": (),
    "RecordVideo": ("folder",), "AddWhiteNoise": (0.1,), "ObstructView": (0.1, 8),
}  # fmt: skip
BATCH = {
    "VectorizeTransformObservation": (wrappers.FlattenObservation,), "VectorizeTransformAction": (wrappers.ClipAction,),
    "DictInfoToList": (), "TransformObservation": (_half,), "FlattenObservation": (), "ReshapeObservation": ((3, 4),),
    "RescaleObservation": (F(-1.0), F(1.0)), "DtypeObservation": (np.float64,), "NormalizeObservation": (),
    "TransformAction": (_half,), "ClipAction": (), "RescaleAction": (F(-2.0), F(2.0)),
    "TransformReward": (lambda r: 2.0 * r,), "ClipReward": (-1.0, 1.0), "NormalizeReward": (),
    "RecordEpisodeStatistics": (), "RecordVideo": ("folder",),
}  # fmt: skip
ELSEWHERE = {
    # Pictures or dictionaries as observations, a screen, arrays of other libraries; the last takes a class to call.
    "AtariPreprocessing", "FilterObservation", "GrayscaleObservation", "ResizeObservation", "HumanRendering",
    "ArrayConversion", "JaxToNumpy", "JaxToTorch", "NumpyToTorch", "VectorizeTransformReward",
}  # fmt: skip
DRAWN = ("RenderCollection", "RecordVideo", "AddWhiteNoise", "ObstructView", "AddRenderObservation")
"""Wrappers that need pictures."""


def _names(module):
    """Wrappers that a module offers, but for those that need libraries which are not here."""
    for name in module.__all__:
        with contextlib.suppress(ImportError, AttributeError, gymnasium.error.DependencyNotInstalled):
            if inspect.isclass(getattr(module, name)):
                yield name


@pytest.mark.parametrize(("module", "table"), [(wrappers, SINGLE), (vector_wrappers, BATCH)])
def test_every_wrapper_is_tried(module, table):
    assert set(_names(module)) - ELSEWHERE <= set(table)


def _arguments(name, given, folder):
    if name == "RecordVideo":
        pytest.importorskip("moviepy")
        return (str(folder), *given[1:])
    return given


@pytest.mark.filterwarnings("ignore:.*(Overwriting|overwrite)")
@pytest.mark.parametrize("name", [n for n in SINGLE if hasattr(wrappers, n)])
def test_around_one_environment(name, tmp_path):
    inner = gymnasium.make(ID, max_episode_steps=8, render_mode="rgb_array" if name in DRAWN else None, **SHORT)
    env = getattr(wrappers, name)(inner, *_arguments(name, SINGLE[name], tmp_path))
    env.action_space.seed(0)
    observation, _ = env.reset(seed=0)
    ended, over = 0, False
    for _ in range(STEPS):
        if over and name != "Autoreset":
            observation, _ = env.reset()
        assert observation in env.observation_space or name in ("NormalizeObservation", "DiscretizeObservation")
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        over = terminated or truncated
        ended += over
        assert math.isfinite(float(reward))
    assert ended >= 2
    env.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("name", [n for n in BATCH if hasattr(vector_wrappers, n)])
def test_around_a_batch(name, mode, tmp_path):
    worlds = gymnasium.make_vec(
        ID, num_envs=3, threads=1, autoreset_mode=mode, max_episode_steps=8,
        render_mode="rgb_array" if name in DRAWN else None, **SHORT,
    )  # fmt: skip
    given = _arguments(name, BATCH[name], tmp_path)
    try:
        made = getattr(vector_wrappers, name)(worlds, *given)
    except ValueError as error:
        # Some of Gymnasium's wrappers take some ways of resetting only, and say so.
        worlds.close()
        assert "autoreset" in str(error).lower()
        return
    made.action_space.seed(0)
    made.reset(seed=0)
    ended = 0
    for _ in range(STEPS):
        observations, rewards, terminated, truncated, _ = made.step(made.action_space.sample())
        assert len(observations) == 3 and np.isfinite(observations).all() and np.isfinite(rewards).all()
        over = np.logical_or(terminated, truncated)
        ended += over.sum()
        if mode is AutoresetMode.DISABLED and over.any():
            made.reset(options={"reset_mask": over})
    assert ended >= 6
    made.close()


@pytest.mark.parametrize(("given", "steps"), [({}, 300), ({"max_episode_steps": 9}, 9), ({"control_rate": 25.0}, 150)])
def test_wrappers_learn_how_long_an_episode_is(given, steps):
    made = gymnasium.make(ID, **given)
    assert made.spec.max_episode_steps == steps
    timed = wrappers.TimeAwareObservation(made, normalize_time=True)
    timed.reset(seed=0)
    assert timed.step(timed.action_space.sample())[0][-1] == F(1.0 / steps)
    again = gymnasium.make(timed.spec)
    again.reset(seed=0)
    assert again.step(timed.action_space.sample())[0].shape == (13,) and again.spec == timed.spec
    assert gymnasium.make_vec(ID, **given).spec.max_episode_steps == steps


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_episode_statistics_of_a_batch_are_those_of_gymnasiums_loop(mode):
    """Rewards and lengths of episodes, across their ends."""
    given = {"autoreset_mode": mode}
    batch = gymnasium.make_vec(ID, num_envs=2, **SHORT, **given)
    loop = gymnasium.make_vec(ID, num_envs=2, vectorization_mode="sync", vector_kwargs=given, **SHORT)
    found = []
    for inner in (batch, loop):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = vector_wrappers.RecordEpisodeStatistics(inner)
        made.reset(seed=0)
        actions = np.random.default_rng(0).uniform(-1.0, 1.0, (40, 2, 2)).astype(F)
        told = [made.step(a)[4].get("episode", {}) for a in actions]
        found.append([(t["r"].tolist(), t["l"].tolist()) for t in told if t])
        made.close()
    assert found[0] == found[1] and len(found[0]) >= 3

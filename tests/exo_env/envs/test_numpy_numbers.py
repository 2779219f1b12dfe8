"""NumPy's numbers, scalars and arrays of no dimension, are taken wherever Python's are."""

from collections import OrderedDict, UserDict
from types import MappingProxyType

import numpy as np
import pytest

from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv

SETTINGS = {
    "load": 1.5, "control_rate": 50.0, "episode_duration": 2.0, "cycle": 3, "rtol": 2.0**-7, "repetitions": 2,
    "patient": {"strength": 0.5}, "reference": {"duration": 1.5}, "noise": {"angle": {"deviation": 0.25}},
    "reward_weights": {"tracking": 2.0}, "limits": {"tension": 500.0}, "drive_settings": {"time_constant": 0.0625},
    "exoskeleton": {"lower_link": {"mass": 1.0}}, "misalignment": {"shift": [0.0078125, 0.0, 0.0]},
}  # fmt: skip
DISTRIBUTIONS = {
    "load": {"uniform": [1.0, 2.0]},
    "patient": {"base": "healthy", "fields": {"strength": {"choice": [0.5, 0.75], "weights": [1, 2]}}},
}
OPTIONS = {"load": 1.5, "initial_angle_deg": 40, "patient": {"strength": 0.5}, "reference": {"start_deg": 30.0}}
KINDS = {
    "float32": (np.float32, np.int32), "float64": (np.float64, np.int64), "small": (np.float16, np.uint8),
    "no dimension": (lambda x: np.array(x, np.float32), np.array),
}  # fmt: skip


def as_numpy(value, kind):
    """The value with every number in it as one of NumPy's."""
    if isinstance(value, dict):
        return {name: as_numpy(x, kind) for name, x in value.items()}
    if isinstance(value, list):
        return [as_numpy(x, kind) for x in value]
    if isinstance(value, str):
        return value
    return KINDS[kind][isinstance(value, int)](value)


def shown(made, **reset):
    """First observation, info and observation of a step; numbers are such as every kind holds exactly."""
    observation, info = made.reset(seed=3, **reset)
    return [observation.tobytes(), repr(info), made.step(np.zeros(made.action_space.shape))[0].tobytes()]


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("name", list(SETTINGS))
def test_settings(name, kind):
    given = {name: SETTINGS[name]}
    assert shown(ElbowLiftEnv(**as_numpy(given, kind))) == shown(ElbowLiftEnv(**given))


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("name", list(DISTRIBUTIONS))
def test_distributions(name, kind):
    given = {name: DISTRIBUTIONS[name]}
    assert shown(ElbowLiftEnv(**as_numpy(given, kind))) == shown(ElbowLiftEnv(**given))


@pytest.mark.parametrize("kind", [OrderedDict, MappingProxyType, UserDict])
@pytest.mark.parametrize("name", [name for name, value in SETTINGS.items() if isinstance(value, dict)])
def test_other_mappings(name, kind):
    def mapped(value):
        return kind({k: mapped(x) for k, x in value.items()}) if isinstance(value, dict) else value

    given = mapped(as_numpy(SETTINGS[name], "float32"))
    assert shown(ElbowLiftEnv(**{name: given})) == shown(ElbowLiftEnv(**{name: SETTINGS[name]}))
    if name in OPTIONS:
        env = ElbowLiftEnv()
        assert shown(env, options=kind({name: given})) == shown(env, options={name: SETTINGS[name]})


def test_arrays_in_place_of_lists():
    given = ElbowLiftEnv(
        load={"uniform": np.array([1.0, 2.0])}, misalignment={"shift": np.array([0.0078125, 0.0, 0.0])}
    )
    wanted = ElbowLiftEnv(load={"uniform": [1.0, 2.0]}, misalignment={"shift": [0.0078125, 0.0, 0.0]})
    assert shown(given) == shown(wanted)


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("name", list(OPTIONS))
def test_options(name, kind):
    given, env = {name: OPTIONS[name]}, ElbowLiftEnv()
    number = as_numpy(given, kind)
    assert shown(env, options=number) == shown(env, options=given)
    env.set_reset_options(number)
    assert shown(env) == shown(env, options=given)
    worlds = ElbowLiftVectorEnv(2, threads=1)
    assert shown(worlds, options=number) == shown(worlds, options=given)


@pytest.mark.parametrize("kind", list(KINDS))
def test_arguments_of_a_vector_environment(kind):
    given = {"num_envs": 4, "threads": 2, "max_episode_steps": 3}
    known, made = ElbowLiftVectorEnv(**given), ElbowLiftVectorEnv(**as_numpy(given, kind))
    assert (made.num_envs, made.steps) == (4, 3) and type(made.num_envs) is int
    assert shown(made) == shown(known)
    for seed in (as_numpy(7, kind), [as_numpy(7 + k, kind) for k in range(4)], np.arange(7, 11)):
        np.testing.assert_array_equal(made.reset(seed=seed)[0], known.reset(seed=7)[0])
    made.close()
    known.close()


@pytest.mark.parametrize("kind", list(KINDS))
def test_arguments_for_stable_baselines(kind):
    pytest.importorskip("stable_baselines3")
    from exo_env.envs.elbow_lift_sb3 import ElbowLiftVecEnv

    made = ElbowLiftVecEnv(**as_numpy({"num_envs": 2, "threads": 1, "load": 1.5}, kind))
    made.seed(int(as_numpy(3, kind)))
    made.set_options(as_numpy({"initial_angle_deg": 40}, kind))
    np.testing.assert_array_equal(
        made.reset()[0], ElbowLiftEnv(load=1.5).reset(seed=3, options={"initial_angle_deg": 40})[0]
    )
    made.close()

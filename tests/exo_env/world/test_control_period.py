"""A control period: readings, a solver that fails, effort, and long runs of random actions."""

import math

import gymnasium
import numpy as np
import pytest

from dms_core.kernels import Options
from dms_core.results import Result
from exo_env.envs import base_env
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.envs.soak import soak

HOLD = np.array([-1.0, -1.0])


def test_a_failed_solver_ends_the_episode_with_its_sentence():
    env = ElbowLiftEnv(patient={}, load=1.0)
    env.reset(seed=0)
    before, *_ = env.step(HOLD)
    env.world.tables.dynamics.options[Options._fields.index("max_steps")] = 1
    observation, reward, terminated, _, info = env.step(HOLD)
    assert terminated and info["solver_failed"] and Result.TOO_MANY_STEPS.value in info["event"]
    np.testing.assert_array_equal(observation, before)
    assert math.isfinite(reward)


def test_effort_is_forgotten_where_the_device_leaves_no_error():
    slack = {"slacking_rate": 0.5, "effort_recovery": 10.0, "maximum_activation_flexors": 0.1}
    env = ElbowLiftEnv(action_mode="pid_setpoint", patient=slack, load=1.0)
    efforts = {}
    for authority in (-0.9, 1.0):
        env.reset(seed=0)
        for _ in range(150):
            *_, info = env.step(np.array([0.0, authority]))
        efforts[authority] = info["effort"]
    # Without any error, exp(-0.5 x 3) = 0.22 of it would be left.
    assert efforts[1.0] < 0.6 < 0.7 < efforts[-0.9], efforts


def test_compiled_readings_are_those_of_the_world(env):
    """A control period reads its sensors in compiled code, which recovers no reactions of welded joints."""
    env.reset(seed=4)
    for _ in range(3):
        env.step(np.array([0.2, -0.5]))
    found, wanted = env.readings(), env.episode.world.read()
    for (name, _), value in zip(env.episode.model.layout.outputs, wanted, strict=True):
        assert found[name] == value, name


@pytest.mark.parametrize(
    ("mode", "steps"), [(mode, 1500 if mode == "rope_tension" else 500) for mode in ElbowLiftEnv.drives]
)
def test_random_actions_over_the_evaluation_population(mode, steps):
    found = soak(steps, action_mode=mode)
    assert found["not_finite_or_outside"] == 0 and found["failed_solves"] == 0
    assert found["largest_phi"] < 1e-8
    assert sum(found["ends"].values()) == found["episodes"]


@pytest.mark.parametrize("mode", ["rope_tension", "assist_moment", "impedance"])
def test_the_arm_rests_at_the_start(mode):
    """Muscles and agonist hold it, whoever the patient is; the handle, which the estimate takes as a point, swings."""
    env = ElbowLiftEnv(action_mode=mode)
    for seed in range(5):
        env.reset(seed=seed)
        # 0.03 to 0.09 rad/s^2 were measured; without the rope a limp arm falls with 10.
        assert abs(env.readings()["elbow_angle.acceleration"]) < 0.3


def test_a_step_that_is_interrupted_ends_the_episode(monkeypatch):
    env = ElbowLiftEnv()
    env.reset(seed=0)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(base_env, "run_period", interrupted)
    with pytest.raises(KeyboardInterrupt):
        env.step(np.zeros(2))
    monkeypatch.undo()
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(2))
    env.reset(seed=0)
    env.step(np.zeros(2))

"""A weight that changes within an episode."""

import copy

import numpy as np
import pytest

from exo_env.ecosystem.gym_machine import WEIGHT
from exo_env.envs.hidden_intent import HiddenIntentEnv, HiddenIntentVectorEnv

PLAN = {
    "rest": 0.5, "targets": 1, "amplitude_deg": 20.0, "duration": 0.8, "pause": 4.0, "changes_of_mind": 0.0,
    "load_changes": 1.0, "picked_up": 0.8,
}  # fmt: skip
NOTHING = np.array([0.0, -1.0])


def changed_at(env):
    """Number of the period in which the load changes."""
    loads = env.world.tables.plan.loads
    (k,) = np.flatnonzero(np.diff(loads))
    return k + 1, loads[k], loads[k + 1]


def test_the_rope_carries_the_new_weight():
    env = HiddenIntentEnv(patient="healthy", reference=PLAN, load=1.0, noise=False)
    env.reset(seed=1)
    k, before, after = changed_at(env)
    assert (before, after) == (1.0, 1.8) and k == pytest.approx((0.5 + 0.8 + 2.0) / 0.02, abs=1)
    tension, rate, place = [], [], env.world.model.layout.index[f"{WEIGHT}.y"]
    for _ in range(env.steps):
        env.step(NOTHING)
        tension.append(env.readings()["gym_rope_tension"])
        rate.append(env.world.dynamics.state.v[place])
    acceleration = np.gradient(rate, env.period)
    mass = np.array(tension) / (9.80665 + acceleration)
    # T = m (g + a); central differences of rates over 40 ms err by some 0.1 m/s^2, more beside the jump.
    np.testing.assert_allclose(mass[5 : k - 2], before, rtol=0.03)
    np.testing.assert_allclose(mass[k + 2 : -2], after, rtol=0.03)


def test_numbers_of_the_model_are_those_of_a_world_with_that_weight():
    stepped, fresh = (HiddenIntentEnv(patient="healthy", reference=PLAN, noise=False) for _ in range(2))
    stepped.reset(seed=1, options={"load": 1.0})
    fresh.reset(seed=1, options={"load": 1.8})
    k, *_ = changed_at(stepped)
    for _ in range(k + 1):
        stepped.step(NOTHING)
    # The rope is as long as before, and longer where an episode begins with another weight on a handle that hangs.
    ropes = [e.world.tables.rest.rope[0] for e in (stepped, fresh)]
    for place, (one, other) in enumerate(zip(stepped.world.model.numbers, fresh.world.model.numbers, strict=True)):
        one, other = one.copy(), other.copy()
        if place == 1:
            one[ropes[0]] = other[ropes[1]] = 0.0
        np.testing.assert_array_equal(one, other)


def test_accelerations_jump_and_rates_do_not():
    env = HiddenIntentEnv(patient="healthy", reference=PLAN, load=1.0, noise=False)
    env.reset(seed=1)
    k, *_ = changed_at(env)
    for _ in range(k):
        env.step(NOTHING)
    other = copy.deepcopy(env)
    loads = other.world.tables.plan.loads
    loads[:] = loads[0]
    for e in (env, other):
        e.step(NOTHING)
    one, unchanged = (e.readings() for e in (env, other))
    # 0.8 kg weigh some 2 Nm about the elbow, whose inertia with the weight is some 0.2 kg m^2: 0.2 rad/s and 2 mrad
    # after 20 ms, while a jump of the rate at the begin would give ten times the angle.
    assert 0.05 < unchanged["elbow_angle.rate"] - one["elbow_angle.rate"] < 0.4
    assert 0.5e-3 < unchanged["elbow_angle.angle"] - one["elbow_angle.angle"] < 4e-3


def test_a_batch_changes_the_same_weights():
    settings = {"patient": "mixed", "reference": PLAN | {"rest": 0.2, "pause": 0.4}, "episode_duration": 2.0}
    worlds, alone = HiddenIntentVectorEnv(3, **settings), HiddenIntentEnv(**settings)
    worlds.reset(seed=[5, 6, 7])
    seen = [worlds.step(np.tile(NOTHING, (3, 1)))[0] for _ in range(90)]
    for i, seed in enumerate((5, 6, 7)):
        alone.reset(seed=seed)
        for k in range(90):
            observation, _, terminated, *_ = alone.step(NOTHING)
            if terminated:
                break
            np.testing.assert_array_equal(seen[k][i], observation)


def test_a_copy_amid_a_changed_load_goes_on():
    env = HiddenIntentEnv(patient="healthy", reference=PLAN, noise=False)
    env.reset(seed=1)
    for _ in range(changed_at(env)[0] + 3):
        env.step(NOTHING)
    other = copy.deepcopy(env)
    for _ in range(20):
        np.testing.assert_array_equal(env.step(NOTHING)[0], other.step(NOTHING)[0])

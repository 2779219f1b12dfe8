"""The group `estimated`: the same bits everywhere, of what the device shows, and honest about what it does not know."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv

from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv
from exo_env.envs.hidden_intent import HiddenIntentEnv, HiddenIntentVectorEnv, NewPatientEnv, NewPatientVectorEnv
from exo_env.estimation.reduced_filter import ESTIMATE, LEARNT
from exo_env.tasks.lift import LiftTask
from exo_env.tasks.observation.channels import Reading
from exo_env.tasks.observation.estimates import estimated_channels, estimated_readings

ENVS = {"ElbowLift": (ElbowLiftEnv, ElbowLiftVectorEnv), "HiddenIntent": (HiddenIntentEnv, HiddenIntentVectorEnv),
        "NewPatient": (NewPatientEnv, NewPatientVectorEnv)}  # fmt: skip


def seen(env, seed, steps=40, **options):
    """Observations, rewards and readings of an episode under drawn actions."""
    actions, rows = np.random.default_rng(7), [env.reset(seed=seed, options=options)[0]]
    rewards = []
    for _ in range(steps):
        observation, reward, ended, *_ = env.step(actions.uniform(-0.5, 0.1, 2))
        rows.append(observation)
        rewards.append(reward)
        if ended:
            break
    return np.array(rows), np.array(rewards)


@pytest.mark.parametrize("name", ENVS)
def test_the_group_changes_nothing_else_and_needs_nothing_else(name):
    make, _ = ENVS[name]
    (alone, rewards), (both, same) = (seen(make(observation=o), 5) for o in (["device"], ["device", "estimated"]))
    n = alone.shape[1]
    assert both.shape[1] == n + len(ESTIMATE)
    np.testing.assert_array_equal(alone, both[:, :n])
    np.testing.assert_array_equal(rewards, same)
    # Whether or not the device's channels are shown, the filter sees them with the same noise.
    np.testing.assert_array_equal(seen(make(observation=["estimated"]), 5)[0], both[:, n:])


@pytest.mark.parametrize("name", ENVS)
def test_a_batch_has_the_bits_of_single_environments(name):
    single, many = ENVS[name]
    settings = {"observation": ["device", "estimated"], "episode_duration": 0.5, "repetitions": 1}
    batch, loop = many(3, threads=2, **settings), SyncVectorEnv([lambda: single(**settings)] * 3)
    np.testing.assert_array_equal(batch.reset(seed=2)[0], loop.reset(seed=2)[0])
    actions = np.random.default_rng(1)
    for _ in range(30):
        action = actions.uniform(-1.0, 1.0, batch.action_space.shape).astype(np.float32)
        one, other = batch.step(action), loop.step(action)
        np.testing.assert_array_equal(one[0], other[0])
        np.testing.assert_array_equal(one[1], other[1])
    batch.close()


def test_a_reset_forgets_the_last_patient():
    env, fresh = (HiddenIntentEnv(observation=["estimated"]) for _ in range(2))
    seen(env, 11)
    np.testing.assert_array_equal(seen(env, 3)[0], seen(fresh, 3)[0])
    np.testing.assert_array_equal(seen(env, 3)[0], seen(env, 3)[0])


def test_a_filter_that_is_lost_in_an_episode_shows_finite_numbers():
    env = HiddenIntentEnv(observation=["estimated"])
    env.reset(seed=1)
    env.step(np.zeros(2))
    tables = env.world.tables.estimator
    tables.fast[:] = np.nan
    observation, *_ = env.step(np.zeros(2))
    assert np.isfinite(observation).all() and tables.learnt[LEARNT.lost] == 1.0
    env.reset(seed=1)
    assert tables.learnt[LEARNT.lost] == 0.0


def test_the_filter_sees_the_noise_that_the_settings_give():
    usual, noisy, by_group = (
        seen(HiddenIntentEnv(observation=["estimated"], noise=noise), 5)[0]
        for noise in (True, {"guide_force": {"deviation": 20.0}}, {"device.guide_force": {"deviation": 20.0}})
    )
    at = ESTIMATE.others_moment
    # A cuff with the noise of 3.2 Nm is not what the maker's sheet says.
    assert np.std(np.diff(noisy[:, at])) > 2.0 * np.std(np.diff(usual[:, at]))
    np.testing.assert_array_equal(noisy, by_group)
    with pytest.raises(InputError, match=r"channel 'guide_force' is not observed"):
        HiddenIntentEnv(observation=["privileged"], noise={"guide_force": {"deviation": 20.0}})


def test_readings_have_estimates_only_where_the_filter_runs():
    names = {r.name for r in estimated_readings()}
    for observation, found in ((["device"], set()), (["device", "estimated.load"], names)):
        env = HiddenIntentEnv(observation=observation)
        env.reset(seed=1)
        assert names & set(env.readings()) == names & set(env.reading_units()) == found
    assert "estimated.load" in env.summary()


def test_intervals_hold_the_truth_as_often_as_they_say():
    """Fifteen patients of `mixed`, most with a body that is not the filter's, under drawn actions."""
    env = HiddenIntentEnv(observation=["device", "estimated"], patient="mixed")
    held = {"muscle_moment": [], "load": []}
    for seed in range(15):
        env.reset(seed=700 + seed)
        actions = np.random.default_rng(seed)
        action = np.array([0.1, -1.0])
        for k in range(200):
            action[0] += actions.normal(0.0, 0.05) - 0.05 * action[0]
            ended = env.step(action)[2]
            if k > 25:
                for name, rows in held.items():
                    estimate, deviation = (env.readout.number(f"estimated_{name}{x}") for x in ("", "_deviation"))
                    rows.append(abs(estimate - env.readout.number(name)) < 1.96 * deviation)
            if ended:
                break
    # Body and load are constants of a patient: of 15 independent draws 95 % hold with a deviation of 6 %.
    for name, rows in held.items():
        assert 0.83 < np.mean(rows), name


class WithoutForce(LiftTask):
    """A device whose cuff has no sensor."""

    def declared_groups(self, parts):
        groups = super().declared_groups(parts)
        return {**groups, "device": [c for c in groups["device"] if c.name != "guide_force"]}


class Guessing(LiftTask):
    """A reading of an estimate that there is not."""

    def declared_readings(self, parts):
        return [*super().declared_readings(parts), Reading("mood", "-", estimate="mood")]


def test_what_a_task_lacks_of_the_filters_sensors_is_named_where_an_estimate_is_asked_for():
    class OwnEnv(ElbowLiftEnv):
        task_type = WithoutForce

    OwnEnv(observation=["device"])
    complaint = r"'load' shows an estimate, .* device.angle, device.rate, device.guide_force; .*'device.guide_force' is"
    with pytest.raises(InputError, match=complaint):
        OwnEnv(observation=["device", "estimated.load"])


def test_an_estimate_that_there_is_not_is_named():
    class OwnEnv(ElbowLiftEnv):
        task_type = Guessing

    with pytest.raises(InputError, match=r"reading 'mood': estimate 'mood' is unknown; the device's filter estimates"):
        OwnEnv()


def test_estimates_have_no_noise_of_their_own_and_make_knows_the_group():
    assert all(c.imperfection.deviation == 0.0 for c in estimated_channels())
    env = gymnasium.make("exo/HiddenIntent-v0", observation=["estimated"])
    assert env.observation_space.shape == (len(ESTIMATE),)

"""Episodes of whole control periods: what is shorter than one is refused, and what is none says what it becomes."""

import warnings

import gymnasium
import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv
from exo_env.envs.settings import MOST_PERIODS, whole_periods


@pytest.mark.parametrize(
    ("duration", "rate", "steps"),
    [
        (1.0, 30.0, 30),
        (6.0, 7.0, 42),
        (0.1, 50.0, 5),
        (0.2, 5.0, 1),
        (120.0, 1000.0, 120_000),
        (np.float32(0.1), 30, 3),
    ],
)
def test_whole_numbers_of_periods_are_kept_as_given(duration, rate, steps):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert whole_periods(duration, rate) == (steps, duration)


@pytest.mark.parametrize("kind", [ElbowLiftEnv, lambda **given: ElbowLiftVectorEnv(3, **given)])
def test_a_part_of_a_period_is_told_once_and_left_out(kind):
    with pytest.warns(UserWarning, match="would be 7.3 control periods: it takes 7, which are 0.958904 s") as told:
        made = kind(control_rate=7.3, episode_duration=1.0)
    assert len(told) == 1
    env = made if kind is ElbowLiftEnv else made.envs[0]
    assert (env.steps, env.duration) == (7, 7 / 7.3)
    made.reset(seed=0)
    action = np.zeros(made.action_space.shape)
    ends = [np.any(made.step(action)[3]) for _ in range(7)]
    assert ends == [False] * 6 + [True] and env.readings()["time"] == pytest.approx(env.duration, abs=1e-12)
    made.close()


@pytest.mark.parametrize(("duration", "rate", "least"), [(0.1, 5.0, 0.2), (0.19, 5.0, 0.2), (0.1, 7.3, 0.136987)])
@pytest.mark.parametrize("kind", [ElbowLiftEnv, ElbowLiftVectorEnv])
def test_less_than_a_period_is_refused_with_the_least_that_is_allowed(kind, duration, rate, least):
    with pytest.raises(InputError, match=f"less than one control period: .* at least {least:g} s"):
        kind(control_rate=rate, episode_duration=duration)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = kind(control_rate=rate, episode_duration=least)
    made.reset(seed=0)
    *_, truncated, _ = made.step(np.zeros(made.action_space.shape))
    assert np.all(truncated)
    made.close()


class Long(ElbowLiftEnv):
    """A class whose own length of an episode is far too long."""

    def usual_duration(self, settings):
        return 1e12


class Nothing(ElbowLiftEnv):
    """A class whose episodes have no length."""

    def usual_duration(self, settings):
        return 0.0


def test_lengths_of_a_class_are_checked_as_those_of_a_user():
    with pytest.raises(InputError, match=f"expected at most {MOST_PERIODS:,} control periods, 2400 s"):
        Long()
    with pytest.raises(InputError, match="expected a duration above 0"):
        Nothing()
    for wrong in (float("nan"), float("inf")):
        with pytest.raises(InputError, match="expected at most"):
            whole_periods(wrong, 50.0)


@pytest.mark.parametrize("key", ["control_rate", "episode_duration"])
@pytest.mark.parametrize("value", [0, -1.0, 1e-300, 1e12, float("nan"), float("inf"), "50", [50.0], True])
def test_numbers_out_of_range_are_refused(key, value):
    with pytest.raises(InputError, match=f"{key} = .*expected a number from"):
        ElbowLiftEnv(**{key: value})


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_batch_of_single_periods_resets_for_ever(mode):
    worlds = ElbowLiftVectorEnv(2, control_rate=5.0, episode_duration=0.2, autoreset_mode=mode)
    worlds.reset(seed=0)
    for _ in range(20):
        assert np.isfinite(worlds.step(np.zeros((2, 2)))[0]).all()
    worlds.close()


@pytest.mark.parametrize("steps", [0, -2, 1.5, "4", True])
def test_wrong_largest_numbers_of_steps(steps):
    with pytest.raises(InputError, match="max_episode_steps = "):
        gymnasium.make_vec("exo/ElbowLift-v2", max_episode_steps=steps)

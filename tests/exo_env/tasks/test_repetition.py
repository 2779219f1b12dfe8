"""Repetitions of the exercise, alone and in an episode."""

import math

import numpy as np
import pytest

from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.movements.repetition import Repetition


def test_repetition_reaches_its_angles():
    r = Repetition(start_deg=30.0, amplitude_deg=60.0, rest=0.5, duration=2.0, pause=1.0)
    course = r.course(np.array([0.0, 0.5, 1.5, 2.5, 3.5, 5.5, 6.0]))
    np.testing.assert_allclose(np.degrees(course[:, 0]), [30, 30, 60, 90, 90, 30, 30], atol=1e-9)
    # Flash and Hogan 1985: the largest rate of a minimum-jerk move is 1.875 times the mean.
    assert course[2, 1] == pytest.approx(1.875 * math.radians(60.0) / 2.0)
    np.testing.assert_allclose(course[[0, 1, 3, 4, 6], 1:], 0.0, atol=1e-9)


def test_repetitions_follow_each_other():
    once = Repetition(start_deg=30.0, amplitude_deg=60.0, rest=0.5, duration=1.0, pause=0.5)
    times = np.linspace(0.0, 2.99, 300)
    for every, interval in ((0.0, 3.0), (4.0, 4.0)):
        often = once.model_copy(update={"count": 3, "every": every})
        for k in range(3):
            np.testing.assert_allclose(often.course(times + k * interval), once.course(times), atol=1e-9)
        np.testing.assert_allclose(often.course(np.array([50.0])), [[math.radians(30.0), 0.0, 0.0]], atol=1e-9)
    # Without any rest two moves meet in one point of time.
    restless = Repetition(rest=0.0, count=20)
    assert len(restless.signal.times) == 61
    assert restless.course(np.array([20 * 4.5 - 0.5]))[0, 1] < 0.0


def test_an_episode_of_several_repetitions():
    """Each as in an episode of one, six seconds apart; effort goes on."""
    one, three = ElbowLiftEnv(action_mode="pid_setpoint"), ElbowLiftEnv(action_mode="pid_setpoint", repetitions=3)
    told = [env.reset(seed=4)[1] for env in (one, three)]
    assert told[0] == told[1]
    single, course = one.episode.course, three.episode.course
    assert len(course) == 901
    for k in range(3):
        np.testing.assert_allclose(course[300 * k : 300 * k + 300], single[:300], atol=1e-9)
    assert three.episode.need.scale == pytest.approx(one.episode.need.scale, rel=2e-3)
    efforts, truncated = [], False
    while not truncated:
        _, _, terminated, truncated, info = three.step(np.array([0.0, 1.0]))
        assert not terminated
        efforts.append(info["effort"])
    assert len(efforts) == 900 and info["time"] == pytest.approx(18.0)
    # The PID leaves hardly an error, so effort decays towards where forgetting ends, and does not begin anew.
    patient = three.episode.patient
    rate, least = patient.slacking_rate, patient.least_effort
    alone = least + (patient.effort_at_start - least) * np.exp(-18.0 * rate)
    assert rate > 0.1 and efforts[299] > efforts[599] > efforts[-1]
    # Half a degree of error moves effort from that by recovery / rate times it.
    assert abs(efforts[-1] - alone) < math.radians(0.5) * patient.effort_recovery / rate

"""The bound on recruited work: reached by the error in proportion to k, beaten by none, and by no device."""

import numpy as np
import pytest

from agents.recruitment import most_work, powers, recruited
from exo_env.control_period import READING
from exo_env.lift_env import ElbowLiftEnv
from exo_env.patient import Patient
from exo_env.slacking import advance_effort

PERIOD = 0.02
PATIENT = Patient(slacking_rate=0.4, effort_recovery=1.5, least_effort=0.2, effort_at_start=0.7, feedback_gain=0.3)


def work(error, planned, full):
    """Of a patient whose moments are in proportion to what is intended [J]."""
    effort, found = PATIENT.effort_at_start, 0.0
    for e, p, g in zip(error, planned, full, strict=True):
        effort = advance_effort(effort, e, PATIENT.slacking_rate, PATIENT.effort_recovery, PATIENT.least_effort, PERIOD)
        found += (effort * p + PATIENT.feedback_gain * e * g) * PERIOD
    return found


def test_the_best_error_reaches_the_bound_and_no_other_comes_above():
    t = np.arange(0.0, 6.0, PERIOD)
    planned, full = np.maximum(8.0 * np.sin(t), 0.0), np.maximum(30.0 * np.sin(t), 0.0)
    k, rms, none = recruited(PATIENT, planned, full, PERIOD), 0.02, np.zeros_like(t)
    bound = rms * np.sqrt(t.size * PERIOD * (k @ k) * PERIOD)

    def added(shape):
        return work(rms * shape / np.sqrt(np.mean(shape**2)), planned, full) - work(none, planned, full)

    # k takes a period's error as a jump at its beginning, the exact step as constant over it: half a period of decay.
    assert added(k) == pytest.approx(bound, rel=PATIENT.slacking_rate * PERIOD)
    generator = np.random.default_rng(0)
    for _ in range(20):
        shape = np.cumsum(generator.normal(size=t.size))
        assert added(shape) < added(k)
    constant = rms * k.sum() * PERIOD
    assert constant < bound and added(np.ones_like(t)) == pytest.approx(constant, rel=PATIENT.slacking_rate * PERIOD)


@pytest.mark.parametrize("lag_deg", [0.5, 1.0, 2.0])
def test_a_device_recruits_less(lag_deg):
    """Of the work that a lag of the PID's setpoint adds, more than a tenth and less than all of the bound."""
    env = ElbowLiftEnv(action_mode="pid_setpoint", noise=False, patient="healthy")

    def run(lag):
        env.reset(seed=1, options={"patient": PATIENT.model_dump()})
        error, done, over = [], 0.0, False
        while not over:
            *_, over, _ = env.step(np.array([-np.radians(lag) / env.drive.setpoint_range, 1.0]))
            r = env.packed.values.reading
            error.append(-r[READING.error])
            done += max(r[READING.muscle_moment] * r[READING.rate], 0.0) * env.period
        return np.array(error), done

    error, alone = run(0.0)
    later, more = run(lag_deg)
    bound = most_work(env.episode, error, alone, float(np.sqrt(np.mean(later**2)))) - alone
    assert 0.1 * bound < more - alone < bound


def test_who_is_weak_does_no_more_than_can_be_wanted():
    env = ElbowLiftEnv(action_mode="pid_setpoint", patient="healthy")
    weak = {**PATIENT.model_dump(), "maximum_activation_flexors": 0.1}
    env.reset(seed=1, options={"patient": weak})
    n = len(env.episode.course)
    most = powers(env.episode, n)[2].sum() * env.period
    assert most_work(env.episode, np.zeros(n), 0.0, 1.0) == pytest.approx(most)
    assert most_work(env.episode, np.zeros(n), 0.0, 1e-4) < most


def test_powers_are_those_of_the_lift():
    env = ElbowLiftEnv(action_mode="pid_setpoint", patient="healthy")
    env.reset(seed=1)
    rate = env.episode.course[:, 1]
    planned, full, _ = powers(env.episode, len(rate))
    lifting = rate > 0.0
    assert (planned[~lifting] == 0.0).all() and (planned >= 0.0).all()
    assert (full[lifting] > planned[lifting]).all()

"""The linear estimate of recruited work: reached by the error in proportion to k, and above what a device recruits."""

import math

import numpy as np
import pytest

from agents.environment import ENVIRONMENT, make
from agents.evaluation.search.recruitment import most_added, most_recruited, powers, recruited
from exo_env.patient.excitation.slacking import advance_effort
from exo_env.patient.patient import Patient

PERIOD = 0.02
PATIENT = Patient(slacking_rate=0.4, effort_recovery=1.5, least_effort=0.2, effort_at_start=0.7, feedback_gain=0.3)
TIMES = np.arange(0.0, 6.0, PERIOD)
PLANNED, FULL = np.maximum(8.0 * np.sin(TIMES), 0.0), np.maximum(30.0 * np.sin(TIMES), 0.0)


def work(error, patient=PATIENT):
    """Work of a patient whose moments are in proportion to what is intended [J]."""
    effort, found = patient.effort_at_start, 0.0
    for e, p, g in zip(error, PLANNED, FULL, strict=True):
        effort = advance_effort(effort, e, patient.slacking_rate, patient.effort_recovery, patient.least_effort, PERIOD)
        found += (effort * p + patient.feedback_gain * e * g) * PERIOD
    return found


def of_size(shape, rms=0.02):
    return rms * shape / np.sqrt(np.mean(shape**2))


@pytest.mark.parametrize("rate", [0.0, 0.4, 1.3])
def test_k_is_what_an_error_adds(rate):
    """Exact for a patient who is linear, whatever the error; round-off of sums of 300 terms."""
    patient = PATIENT.model_copy(update={"slacking_rate": rate})
    k, generator = recruited(patient, PLANNED, FULL, PERIOD), np.random.default_rng(0)
    for _ in range(3):
        error, other = 0.01 * generator.normal(size=(2, TIMES.size))
        added = work(error, patient) - work(other, patient)
        assert added == pytest.approx(float(k @ (error - other)) * PERIOD, abs=1e-11)


def test_the_best_error_reaches_the_most_and_no_other_comes_above():
    k, base, generator = recruited(PATIENT, PLANNED, FULL, PERIOD), 0.005 * np.cos(TIMES), np.random.default_rng(1)
    most = most_added(k, base, 0.02, PERIOD)
    assert work(of_size(k)) - work(base) == pytest.approx(most, rel=1e-12)
    for _ in range(20):
        assert work(of_size(np.cumsum(generator.normal(size=TIMES.size)))) - work(base) < most


def test_powers_are_those_of_the_lift():
    """The planned one is what lifts the weight expected and the arm: their potential energy, on a slow move."""
    env = make(ENVIRONMENT, action_mode="pid_setpoint", patient="healthy").unwrapped
    for expected in (1.0, 0.5):
        patient = {**PATIENT.model_dump(), "expected_load": expected}
        env.reset(seed=1, options={"patient": patient, "load": 2.0})
        course = env.episode.course
        planned, full = powers(env.episode, len(course))
        rate, times = course[:, 1], env.episode.times
        assert (planned[rate <= 0.0] == 0.0).all() and (full[rate > 1e-6] > planned[rate > 1e-6]).all()
        arm, machine = env.episode.arm, env.episode.ecosystem.machine
        ends = [course[0, 0], course[:, 0].max()]
        grips = [arm.elbow + arm.rotation(x) @ arm.grip for x in ends]
        ropes = [np.linalg.norm(grip - np.array(machine.low_pulley)) for grip in grips]
        forearm = arm.segments["forearm"]
        centres = [(arm.elbow + arm.rotation(x) @ forearm.centre_of_mass)[1] for x in ends]
        g = 9.80665
        energy = expected * 2.0 * g * (ropes[1] - ropes[0]) + machine.handle.mass * g * (grips[1] - grips[0])[1]
        energy += forearm.mass * g * (centres[1] - centres[0])
        # Speeding up takes what slowing down gives back, and the trapezoid is off by less than a thousandth.
        assert np.trapezoid(planned, times) == pytest.approx(energy, rel=5e-3)


@pytest.mark.parametrize("lag_deg", [0.5, 1.0, 2.0])
def test_a_device_recruits_less(lag_deg):
    """The PID's setpoint lags: it adds more than a tenth of the estimate, and less than all of it."""
    env = make(ENVIRONMENT, action_mode="pid_setpoint", noise=False, patient="healthy").unwrapped

    def run(lag):
        env.reset(seed=1, options={"patient": PATIENT.model_dump()})
        error, done, over = [], 0.0, False
        while not over:
            error.append(-env.readings()["tracking_error"])
            *_, over, _ = env.step(np.array([-math.radians(lag) / env.drive.setpoint_range, 1.0]))
            r = env.readings()
            done += max(r["muscle_moment"] * r["elbow_angle.rate"], 0.0) * env.period
        return np.array(error), done

    error, alone = run(0.0)
    later, more = run(lag_deg)
    most = most_recruited(env.episode, error, float(np.sqrt(np.mean(later**2))))
    assert 0.1 * most < more - alone < most

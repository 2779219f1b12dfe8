"""Prediction through the delay: the model against its equations, and the loop with and without it."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.patient.excitation.effort import TICK
from exo_env.patient.excitation.forward_model import FORGETTING, LIMB, advance_limb
from exo_env.patient.patient import MIDDLE, Patient
from tests.exo_env.patient.at_work import SIGN, AtWork

J, B, LAG = 0.2, 2.5, 0.04
ALONE = np.array([-1.0, -1.0])
"""Action of a device that pulls no rope."""


def limb(**fields):
    numbers = np.zeros(len(LIMB))
    numbers[[LIMB.inertia, LIMB.damping, LIMB.lag]] = J, B, LAG
    return numbers


def test_the_model_follows_its_equations():
    """Moment, angle and rate under a moment that is commanded from 0.1 to 0.4 s, against scipy."""

    def commanded(t):
        return 3.0 if 0.1 <= t < 0.4 else 0.0

    def rates(t, y):
        m, x, v = y
        return [(commanded(t) - m) / LAG, v, (m - B * (v + x / FORGETTING)) / J]

    exact = solve_ivp(rates, (0.0, 1.0), [0.0, 0.0, 0.0], rtol=1e-9, atol=1e-12, max_step=0.01).y[:, -1]
    apart = []
    for steps in (500, 1000):
        numbers = limb()
        for k in range(steps):
            advance_limb(numbers, commanded((k + 0.5) / steps), 1.0 / steps)
        apart.append(np.abs(numbers[[LIMB.moment, LIMB.angle, LIMB.rate]] - exact))
    # Implicit Euler is of order 1: half the step, half the error, and little of it.
    assert np.all(apart[1][1:] < 0.6 * apart[0][1:]) and np.all(apart[1] < 0.01 * np.abs(exact).max())


def test_a_steady_moment_is_forgotten():
    numbers = limb()
    for _ in range(round(10.0 * FORGETTING / TICK)):
        advance_limb(numbers, 3.0, TICK)
    assert numbers[LIMB.angle] == pytest.approx(3.0 * FORGETTING / B, rel=1e-3)
    assert abs(numbers[LIMB.rate]) < 1e-3


def test_what_was_corrected_and_is_not_felt_yet_is_taken_off():
    """An error that stays for the whole delay: at full prediction the correction falls as the model moves."""
    fields = {"feedback_gain": 1.0, "feedback_delay": 0.1}
    found = []
    for prediction in (0.0, 0.5, 1.0):
        work = AtWork(Patient(**fields, prediction=prediction), TICK, np.random.default_rng(0))
        work.state.limb[:], work.state.levers[:] = limb(), 15.0 * SIGN
        work.reset(np.full(6, 0.3))
        found.append([work.step(np.full(6, 0.3), error=0.1)[3] for _ in range(10)])
    plain, half, full = np.array(found)
    # Felt from 0.1 s on, at the end of the fifth tick.
    np.testing.assert_allclose(plain, [0.3] * 4 + [0.4] * 6, rtol=1e-12)
    np.testing.assert_array_equal(full[:5], plain[:5])
    assert np.all(np.diff(full[5:]) < 0.0) and np.all(full[6:] < half[6:]) and np.all(half[6:] < plain[6:])


def test_the_model_counts_what_weakness_leaves_of_a_correction():
    """A patient at the ceiling gives no more, and expects no more of it."""
    fields = {"feedback_gain": 1.0, "feedback_delay": 0.04, "prediction": 1.0}
    weak = AtWork(Patient(**fields, maximum_activation_flexors=0.3, maximum_activation_extensors=0.0), TICK,
                  np.random.default_rng(0))  # fmt: skip
    weak.state.limb[:], weak.state.levers[:] = limb(), 15.0 * SIGN
    weak.reset(np.full(6, 0.3))
    for _ in range(10):
        weak.step(np.full(6, 0.3), error=0.2)
    assert np.all(weak.state.copy == 0.0) and np.all(weak.state.expected == 0.0)


def test_rate_feedback_adds_the_rate_of_the_error():
    work = AtWork(Patient(feedback_gain=0.5, feedback_delay=0.02, feedback_lead=0.1), TICK, np.random.default_rng(0))
    work.reset(np.full(6, 0.3))
    assert work.step(np.full(6, 0.3), error=0.1, error_rate=0.4)[3] == pytest.approx(0.3 + 0.5 * (0.1 + 0.04))


def test_what_a_patient_knows_of_its_limb_is_the_limb_of_the_world():
    """Inertia and moments in the middle of the exercise, against the muscles and the load of the simulated arm."""
    env = ElbowLiftEnv(patient={"deactivation_time_scale": 2.0}, load=1.0, noise=False)
    env.reset(seed=0)
    effort = env.world.tables.patient.effort
    known = effort.limb
    arm = env.episode.arm
    defaults = arm.facts["muscle_defaults"]
    rise, fall = (defaults[f"{way}_time_constant"] for way in ("activation", "deactivation"))
    assert known[LIMB.lag] == pytest.approx(0.5 * (rise + 2.0 * fall))
    # Forearm and hand alone, and with handle and weight on the rope at 0.3 m or less.
    assert arm.inertia_about_elbow() < known[LIMB.inertia] < arm.inertia_about_elbow() + 2.0 * 0.3**2
    from exo_env.patient.excitation.motor_command import arm_table
    from exo_env.patient.excitation.static_optimisation import muscle_moment

    both = [muscle_moment(arm_table(arm), MIDDLE, np.where(SIGN > 0.0, a, 0.01)) for a in (1.0, 0.01)]
    assert effort.levers[SIGN > 0.0].sum() == pytest.approx(both[0] - both[1], rel=1e-12)
    assert np.all(effort.levers * SIGN > 0.0)


def unrest(patients, **changed):
    """Share of patients alone who end unsafe, and the median of their third differences of the angle [rad/s^3]."""
    env, ends, jerks = ElbowLiftEnv(patient="mixed", noise=False), [], []
    for seed in range(patients):
        info = env.reset(seed=1000 + seed)[1]
        env.reset(seed=1000 + seed, options={"patient": {**info["patient"], **changed}})
        over, angles = False, []
        while not over:
            *_, terminated, truncated, _ = env.step(ALONE)
            angles.append(env.world.tables.patient.felt[0])
            over = terminated or truncated
        ends.append(terminated)
        jerks.append(math.sqrt(np.mean(np.diff(angles, 3) ** 2)) / TICK**3 if len(angles) > 20 else math.nan)
    return np.mean(ends), np.nanmedian(jerks)


def test_high_gains_are_steady_with_prediction_only():
    """At six times the gain of the strongest healthy person, where third differences were 499 and 102 rad/s^3."""
    (wild, shaky), (calm, steady) = (
        unrest(20, feedback_gain=3.0, feedback_scaling=0.0, feedback_lead=0.05 * share, prediction=share)
        for share in (0.0, 1.0)
    )
    assert calm <= wild and steady < 0.4 * shaky

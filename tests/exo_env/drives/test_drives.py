"""What an action does: rope tensions, setpoints of the PID, and what both cost in accuracy."""

import math

import numpy as np
import pytest

from exo_env.drives.rope_tension import RopeTension
from exo_env.envs.elbow_lift import ElbowLiftEnv

LIMP = {"maximum_activation_flexors": 0.0, "maximum_activation_extensors": 0.0}


def test_tension_follows_with_rate_limit_and_lag():
    env = ElbowLiftEnv(patient={}, limits={"lowest_deg": -10.0})
    env.reset(seed=0, options={"load": 1.0})
    drive, period = RopeTension(), 0.02
    found, held, tau = env.readings()["antagonist_tension"], 0.0, drive.time_constant
    assert found == 0.0
    for _ in range(4):
        env.step(np.array([-0.6, 0.5]))
        before, held = held, min(held + drive.rate_limit * period, 75.0)
        late = tau * (held - before) / period
        found = held - late + (found - before + late) * math.exp(-period / tau)
        # The lag's exact answer to a ramp; rtol 1e-2 of 100 N nominal allows an error of 0.1 N a step or so.
        assert env.readings()["antagonist_tension"] == pytest.approx(found, abs=1.0)


def test_setpoint_goes_through_the_filter():
    env = ElbowLiftEnv(
        action_mode="pid_setpoint", patient=LIMP, rtol=1e-4, load=1.0,
        reference={"rest": 5.0}, episode_duration=12.0,
    )  # fmt: skip
    env.reset(seed=0)
    w, errors = 20.0, []

    def integral(t):
        """Integral of the filter's answer to a unit step, 1 - (1 + w t) exp(-w t)."""
        return t - (2.0 - (2.0 + w * t) * math.exp(-w * t)) / w

    for k in range(1, 31):
        env.step(np.array([1.0, 1.0]))
        # The setpoint rises over the first period.
        wanted = 0.2 * (integral(0.02 * k) - integral(0.02 * (k - 1))) / 0.02
        r = env.readings()
        # The Tracking sensor's error is reference + filtered setpoint - hinge angle.
        assert r["tracking.error"] + r["exo_angle.angle"] - r["reference"] == pytest.approx(wanted, abs=1e-4)
        errors.append(r["tracking.error"])
    # The PID brings a limp arm to the shifted setpoint: 200 N/0.01 rad is in reach of its gain of 8845 N/rad.
    assert abs(errors[-1]) < 0.02


def test_authority_zero_leaves_the_ropes_slack():
    env = ElbowLiftEnv(action_mode="pid_setpoint", patient={}, load=1.0)
    env.reset(seed=0)
    for _ in range(10):
        env.step(np.array([0.0, -1.0]))
    r = env.readings()
    # What is left is the smoothing of the positive part, 3 w / 32 = 0.094 N in each rope.
    assert r["assistance"] == 0.0 and max(r["agonist_tension"], r["antagonist_tension"]) < 0.2


@pytest.mark.parametrize(
    "mode, hold",
    [
        ("rope_tension", [-0.5, -0.9]),
        ("pid_setpoint", [0.0, 0.5]),
        ("assist_moment", [0.3, -0.8]),
        ("impedance", [0.0, 0.0, 0.2]),
    ],
)
def test_default_tolerance_is_finer_than_the_encoder(mode, hold):
    """The default against 1e-5 under the same rough actions, over seven patients: the encoder's step is 1.5e-3 rad.

    What an error of the solver grows to is the patient's own; the median over patients is what is promised.
    """
    errors = []
    for seed in range(7):
        angles = []
        for rtol in (None, 1e-5):
            env, actions = ElbowLiftEnv(rtol=rtol, action_mode=mode), np.random.default_rng(seed)
            env.reset(seed=seed)
            angles.append([])
            for _ in range(100):
                env.step(np.array(hold) + actions.uniform(-0.1, 0.1, len(hold)))
                angles[-1].append(env.readings()["elbow_angle.angle"])
        errors.append(np.abs(np.subtract(*angles)).max())
    assert np.median(errors) < 1e-3, errors


def test_a_slow_iteration_renews_its_matrix():
    """Here fibres stop shortening between guess and solution, and an earlier test of slowness gave up."""
    env = ElbowLiftEnv(action_mode="pid_setpoint", noise=False, rtol=0.1)
    env.reset(seed=0)
    for k in range(20):
        *_, info = env.step(np.array([0.0, 1.0]))
        assert not info["solver_failed"], k

"""Where an episode begins apart from the reference, no drive may pull the arm there at once."""

import math
from typing import ClassVar

import numpy as np
import pytest

from exo_env.drives.drive import RETURN, Command
from exo_env.drives.pid_setpoint import FILTER, SETPOINT, PidSetpoint
from exo_env.ecosystem.ecosystem import ASSISTANCE
from exo_env.envs.elbow_lift import ElbowLiftEnv

AVERAGE = {"patient": {}, "load": 1.0}


def begun(angle=None, **settings):
    """An environment of a healthy patient whose episode begins at an angle [deg]."""
    env = ElbowLiftEnv(**AVERAGE | settings)
    env.reset(seed=0, options={} if angle is None else {"initial_angle_deg": angle})
    return env


@pytest.mark.parametrize("reference", [None, {"rest": 0.0}])
@pytest.mark.parametrize("rate", [5.0, 50.0, 1000.0])
@pytest.mark.parametrize("angle", [0.0, 5.0, 25.0, 60.0, 100.0, 142.0])
def test_the_pid_begins_where_the_arm_is(angle, rate, reference):
    env = begun(angle, action_mode="pid_setpoint", control_rate=rate, reference=reference)
    largest = 0.0
    for _ in range(max(round(0.2 * rate), 1)):
        *_, terminated, _, info = env.step(np.zeros(2))
        assert not terminated, info
        largest = max(largest, env.readings()["agonist_tension"], env.readings()["antagonist_tension"])
    # To hold the arm at the farthest angle takes 60 N; a tenth of the motor's largest tension leaves room to settle.
    assert largest < 150.0


@pytest.mark.parametrize("rate", [5.0, 50.0, 1000.0])
@pytest.mark.parametrize("angle", [0.0, 5.0, 25.0, 60.0, 100.0, 142.0])
def test_ropes_of_commanded_tension_begin_anywhere(angle, rate):
    """An action of zeros flexes the arm; at 142 deg the stop holds it."""
    env = begun(angle, control_rate=rate)
    for _ in range(max(round(0.2 * rate), 1)):
        *_, terminated, _, info = env.step(np.zeros(2))
        assert not terminated, info


@pytest.mark.parametrize("angle", [2.0, 90.0])
def test_the_setpoint_goes_to_the_reference_in_a_stated_time(angle):
    env = begun(angle, action_mode="pid_setpoint")
    apart, found = math.radians(angle) - env.readings()["reference"], []
    assert env.readings()["setpoint"] == pytest.approx(apart, abs=1e-15)
    assert env.readings()["tracking.error"] == pytest.approx(0.0, abs=1e-12)
    for k in range(1, 120):
        env.step(np.zeros(2))
        found.append(env.readings()["setpoint"])
        s = min(k * env.period / RETURN, 1.0)
        assert found[-1] == pytest.approx(apart * (1.0 - 10.0 * s**3 + 15.0 * s**4 - 6.0 * s**5), abs=1e-12)
    assert found[round(RETURN / env.period) - 1 :] == [0.0] * len(found[round(RETURN / env.period) - 1 :])
    # Behind it the action alone shifts the setpoint.
    env.step(np.array([0.5, 0.0]))
    assert env.readings()["setpoint"] == pytest.approx(0.1)


def test_on_the_reference_nothing_is_added():
    env = ElbowLiftEnv(action_mode="pid_setpoint")
    for seed in range(20):
        env.reset(seed=seed)
        assert env.readings()["setpoint"] == 0.0
        env.step(np.zeros(2))
        assert env.readings()["setpoint"] == 0.0


class Shifted(PidSetpoint):
    """A drive of one's own, whose filter begins shifted by 0.1 rad."""

    def commands(self, device):
        shift = Command(SETPOINT, math.inf, start=0.1, apart=1.0, motor=FILTER)
        return shift, Command(ASSISTANCE, self.authority_rate, start=0.5)


class ShiftedEnv(ElbowLiftEnv):
    drives: ClassVar = {"shifted": Shifted}


@pytest.mark.parametrize("angle", [None, 80.0])
def test_a_drive_of_ones_own_begins_in_agreement(angle):
    """The filter rests at its command, and the controller's error is that of the setpoint which it follows."""
    env = ShiftedEnv(action_mode="shifted", **AVERAGE)
    env.reset(seed=0, options={} if angle is None else {"initial_angle_deg": angle})
    state, index = env.world.dynamics.state, env.world.model.layout.index
    assert state.q[index[f"{FILTER}.setpoint"]] == env.readings()["setpoint"]
    assert env.readings()["tracking.error"] == pytest.approx(0.1, abs=1e-12)
    assert state.v[index["pid.error_integral"]] == pytest.approx(0.1, abs=1e-12)

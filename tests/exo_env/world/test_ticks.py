"""The patient acts by its own clock: results do not depend on how often the device does."""

import numpy as np
import pytest

from dms_core.kernels import MATRIX_SINGULAR
from exo_env.envs import base_env
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.patient.excitation.effort import TICK
from exo_env.tables import STATUS
from exo_env.world.kernels.control_period import SAME_TIME, set_commands, set_excitations

HELD = np.array([-0.7, -0.8])
COMMON = 0.2
"""Time of which all control rates here have whole numbers of periods [s]."""
RATES = (5.0, 30.0, 50.0, 200.0, 1000.0)
TOLERANCE = np.array([1e-4, 1e-3, 2e-3, 2e-5])
"""Of angle [rad], rate [rad/s], moment [Nm] and effort [-]."""
SMALL = {"rtol": 1e-5, "noise": False, "limits": {"lowest_deg": -10.0}}


def held(env):
    """The action that keeps the commands of the start: the same at every control rate, without any ramp."""
    drive = env.world.tables.drive
    return (drive.commands - drive.numbers[:, 0]) / drive.numbers[:, 1]


def course(rate, seed, count=8):
    """Angle, rate, moment of the muscles and effort each COMMON seconds under held commands."""
    env = ElbowLiftEnv(patient="evaluation", control_rate=rate, episode_duration=count * COMMON, **SMALL)
    env.reset(seed=seed)
    action, rows = held(env), []
    for k in range(round(count * COMMON * rate)):
        *_, terminated, _, _ = env.step(action)
        assert not terminated
        if (k + 1) % round(COMMON * rate) == 0:
            r, ticks = env.readings(), env.world.tables.patient.ticks[0]
            assert ticks == round((k + 1) / rate / TICK)
            rows.append([r["elbow_angle.angle"], r["elbow_angle.rate"], r["muscle_moment"], r["effort"]])
    return np.array(rows)


@pytest.mark.parametrize("seed", [1, 3, 6])
def test_results_are_those_of_every_control_rate(seed):
    """Periods that the tick divides, that divide it, and that do neither; from 5 to 1000 Hz."""
    exact = course(50.0, seed)
    assert np.ptp(exact[:, 0]) > 0.1
    for rate in set(RATES) - {50.0}:
        apart = np.abs(course(rate, seed) - exact).max(axis=0)
        # The solver's error only, which differs with its steps: TOLERANCE at rtol 1e-5.
        assert np.all(apart <= TOLERANCE), (rate, apart)


def test_events_less_than_a_rounding_apart_are_one():
    """A control rate in single precision: no step of the solver is as short as the difference."""
    rate = 1.0 / (TICK - 0.1 * SAME_TIME)
    with pytest.warns(UserWarning, match="control periods"):
        env = ElbowLiftEnv(control_rate=rate, episode_duration=1.0, noise=False)
    env.reset(seed=0)
    with_ticks = []
    for k in range(9):
        env.step(HELD)
        with_ticks.append(int(env.world.tables.patient.ticks[0]))
        assert env.episode.world.time == (k + 1) * env.period
    assert with_ticks == list(range(1, 10))
    assert env.readings()["solver.steps"] < 60


def test_where_the_solver_is_helped_amid_a_period_the_patient_goes_on(monkeypatch):
    """As where the very first step of a period fails: inputs are set, nothing has moved, and five ticks are to come."""
    env, twin = (ElbowLiftEnv(control_rate=10.0, noise=False) for _ in range(2))
    for one in (env, twin):
        one.reset(seed=3)
        one.step(HELD)

    def gives_up(table, action):
        drive = env.world.tables.drive
        drive.before[:], drive.action[:] = drive.action, action
        set_commands(table)
        set_excitations(table)
        env.world.tables.status[STATUS.code] = MATRIX_SINGULAR
        return MATRIX_SINGULAR

    with monkeypatch.context() as patch:
        patch.setattr(base_env, "run_period", gives_up)
        found = env.step(HELD)
    wanted = twin.step(HELD)
    assert not found[2] and env.episode.world.time == twin.episode.world.time == pytest.approx(0.2, abs=1e-12)
    assert env.world.tables.patient.ticks[0] == twin.world.tables.patient.ticks[0] == 10
    # Steps of the helper are those of the period, but for the last digits of slopes that it computes anew.
    for name in ("elbow_angle.angle", "muscle_moment", "effort"):
        assert env.readings()[name] == pytest.approx(twin.readings()[name], rel=1e-5), name
    assert found[1] == pytest.approx(wanted[1], rel=1e-4)

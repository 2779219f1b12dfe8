"""What cannot be differentiated is refused by name."""

from __future__ import annotations

import subprocess
import sys
from typing import ClassVar

import gymnasium
import pytest

from dms_core.errors import InputError, SimulationError
from dms_core.sensitivity.nodes import Number
from exo_env.drives.assist_moment import AssistMoment
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.gradients.torch_functions import ControlPeriod, WholeEpisode
from exo_env.kernels import DRIVE, WORLD, compiled, floats, inner, readings
from tests.exo_env.gradients.worlds import LIFT, made

torch = pytest.importorskip("torch")


@pytest.fixture(scope="module")
def short():
    return made(action_mode="assist_moment", solver={}, episode_duration=0.1)


@pytest.fixture
def env(short):
    short.reset(seed=1)
    return short


def zeros(*shape):
    return torch.zeros(shape, dtype=torch.float64)


def test_environment_without_an_episode_is_refused():
    with pytest.raises(gymnasium.error.ResetNeeded, match="call reset"):
        ControlPeriod(gymnasium.make(LIFT), ["angle"])


def test_other_environments_are_refused():
    with pytest.raises(InputError, match="Expected one environment of exo_env, got PendulumEnv"):
        ControlPeriod(gymnasium.make("Pendulum-v1"), ["angle"])
    with pytest.raises(InputError, match="Expected one environment of exo_env, got ElbowLiftVectorEnv"):
        ControlPeriod(gymnasium.make_vec(LIFT, 2), ["angle"])


def test_wrong_actions_are_refused(env):
    run = WholeEpisode(env, ["angle"])
    with pytest.raises(InputError, match=r"actions have shape \(3,\); expected \(periods, 2\)"):
        run(zeros(3))
    with pytest.raises(InputError, match=r"actions have shape \(3, 1\); expected \(periods, 2\)"):
        run(zeros(3, 1))
    with pytest.raises(InputError, match="expected finite numbers"):
        run(torch.full((1, 2), torch.nan))
    with pytest.raises(InputError, match=r"action has shape \(3,\): expected 2 numbers"):
        run.period(run.period.start(), zeros(3))
    with pytest.raises(InputError, match="The episode has 5 control periods, and all of them are done"):
        run(zeros(6, 2))


def test_unknown_readings_are_refused(env):
    with pytest.raises(InputError, match="reading 'effort' is no sensor of the model and no copy of one"):
        ControlPeriod(env, ["effort"])
    with pytest.raises(InputError, match="Expected at least one name"):
        ControlPeriod(env, [])


def test_wrong_numbers_are_refused(env):
    with pytest.raises(InputError, match=r"'elbow.point_i.0' places a joint"):
        ControlPeriod(env, ["angle"], [Number("elbow", "point_i.0")])
    with pytest.raises(InputError, match="'masse' does not exist"):
        ControlPeriod(env, ["angle"], [Number("forearm", "masse")])
    period = ControlPeriod(env, ["angle"], [Number("forearm", "mass")])
    for given in (zeros(2), torch.tensor([torch.nan])):
        with pytest.raises(InputError, match=r"Expected 1 finite numbers \(forearm.mass\)"):
            period(period.start(), zeros(2), given)
    with pytest.raises(InputError, match=r"Expected 0 finite numbers \(none\)"):
        ControlPeriod(env, ["angle"])(period.start(), zeros(2), zeros(1))


def test_state_of_another_episode_is_refused():
    env = made(action_mode="assist_moment", solver={})
    period = ControlPeriod(env, ["angle"])
    state = period.start()
    env.reset()
    with pytest.raises(InputError, match="The environment was reset since"):
        period(state, zeros(2))


@compiled
def by_the_error(w):
    """Tensions by the reading `error`, which no drive of this package reads."""
    drive = inner(w, WORLD.drive)
    wanted, action = floats(drive, DRIVE.wanted), floats(drive, DRIVE.action)
    wanted[0], wanted[1] = 20.0 + readings(w)[0] + action[0], 5.0


class ByTheError(AssistMoment):
    kernel: ClassVar = by_the_error


class OtherEnv(ElbowLiftEnv):
    drives: ClassVar = {"rope_tension": ByTheError}


def test_drive_that_reads_more_is_refused():
    env = OtherEnv()
    env.reset(seed=0)
    with pytest.raises(InputError, match="'rope_tension' is not differentiable here: its drive, ByTheError, reads"):
        ControlPeriod(env, ["angle"])


def test_torch_is_imported_where_it_is_needed():
    code = "import sys, exo_env, exo_env.gradients.torch_functions; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_solver_that_gives_up_says_when(env):
    """And the function goes on from an earlier state."""
    broken = made(action_mode="assist_moment", solver={"h_min": 0.05})
    with pytest.raises(SimulationError, match="Stopped at t = "):
        WholeEpisode(broken, ["angle"])(zeros(2, 2))
    assert torch.isfinite(WholeEpisode(env, ["angle"])(zeros(2, 2))).all()

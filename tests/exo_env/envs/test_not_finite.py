"""What the code of a task gives must be finite; an error names what is not, single and in a batch."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import SimulationError
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv


@pytest.fixture
def env():
    """An environment of its own, whose tables a test may spoil."""
    return ElbowLiftEnv(observation=["device"])


def spoil_judge(env):
    """Let the first reward term have a weight that is not finite."""
    env.world.tables.task.weights[0] = np.nan


def spoil_channel(env):
    """Let the second observed component be scaled by a number that is not finite."""
    env.world.tables.observer.imperfections[1] = np.nan


@pytest.mark.parametrize(
    ("spoil", "named"),
    [(spoil_judge, "t = 0.02 s .* the reward"), (spoil_channel, "t = 0.02 s .* observed channel 'device.rate'")],
)
def test_a_step_names_what_is_not_finite(env, spoil, named):
    env.reset(seed=0)
    spoil(env)
    with pytest.raises(SimulationError, match=named):
        env.step(np.zeros(2))


def test_a_reset_names_what_is_not_finite(env):
    _ = env.reset(seed=0)
    spoil_channel(env)
    with pytest.raises(SimulationError, match="t = 0 s .* observed channel 'device.rate'"):
        env.reset()


@pytest.mark.parametrize("spoil", [spoil_judge, spoil_channel])
def test_a_batch_names_the_world(spoil):
    worlds = ElbowLiftVectorEnv(2, observation=["device"])
    try:
        worlds.reset(seed=0)
        spoil(worlds.envs[1])
        with pytest.raises(SimulationError, match="World 1: At t = 0.02 s"):
            worlds.step(np.zeros((2, 2)))
    finally:
        worlds.close()

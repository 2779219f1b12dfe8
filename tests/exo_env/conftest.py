import gymnasium
import pytest

import exo_env  # noqa: F401  registers
from exo_env.envs.elbow_lift import ElbowLiftEnv


@pytest.fixture(scope="module")
def env():
    """One environment with all groups for tests that reset it themselves."""
    return ElbowLiftEnv(observation=["device", "emg", "privileged"])


@pytest.fixture
def make():
    """gymnasium.make of our environment."""
    return lambda **settings: gymnasium.make("exo/ElbowLift-v2", **settings)

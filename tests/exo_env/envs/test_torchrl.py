"""torchrl takes the batch that resets when it is asked to, which is what torchrl prefers.

With same-step resets it cannot read infos that hold mappings, of Gymnasium's own vector environments either.
"""

import numpy as np
import pytest

from exo_env.envs.elbow_lift import ElbowLiftVectorEnv


def test_a_rollout_crosses_the_ends_of_episodes():
    envs = pytest.importorskip("torchrl.envs")
    env = envs.GymWrapper(ElbowLiftVectorEnv(3, autoreset_mode="Disabled", episode_duration=0.2, threads=1))
    env.set_seed(0)
    found = env.rollout(25, break_when_any_done=False)
    assert found["observation"].shape == (3, 25, 12) and int(found["next", "truncated"].sum()) >= 6
    assert np.isfinite(found["next", "reward"].numpy()).all()

"""The scene of an episode."""

import numpy as np
import pytest

HOLD = np.array([-1.0, -1.0])


def test_scene(env):
    env.reset(seed=0)
    env.step(HOLD)
    scene, r = env.scene(), env.readings()
    assert scene.time == pytest.approx(0.02) and scene.elbow_angle == r["elbow_angle.angle"]
    assert len(scene.muscles) == 6 and len(scene.ropes) == 2 and scene.ropes[0][1] == r["agonist_tension"]
    forearm = np.linalg.norm(scene.grip - scene.elbow)
    assert 0.25 < forearm < 0.42
    # The weight hangs under the high pulley.
    assert scene.weight[0] == pytest.approx(scene.pulleys[1][0], abs=1e-9)

"""Settings of the wrong kind: key, value and what is expected, with plain numbers."""

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.judgement.rewards import Weights


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"reward_weights": 3}, "reward_weights = 3: expected a mapping with some of .*tracking"),
        ({"reward_weights": {1: 2.0}}, "reward_weights = {1: 2.0}: expected a mapping"),
        ({"limits": "abc"}, "limits = 'abc': expected a mapping with some of .*highest_deg"),
        ({"noise": {"angle": 3}}, "noise: angle = 3: expected a mapping with some of bias, delay, deviation, quantum"),
        ({"noise": {"angle": {"delay": 9.0}}}, "noise: angle: Imperfection: delay = 9.0"),
        ({"noise": np.float64(2.0)}, r"noise = 2\.0: expected True"),
        ({"observation": [["device"]]}, "observation = .*'device'.*: expected a list of different groups of device"),
        ({"observation": [3]}, r"observation = \[3\]: expected a list"),
        ({"observation": ["device."]}, "group 'device' has no channel ''; it has angle"),
        ({"reference": [np.float64(3.0)]}, r"reference = \[3\.0\]: expected a mapping"),
    ],
)
def test_wrong_kinds(settings, complaint):
    with pytest.raises(InputError, match=complaint):
        ElbowLiftEnv(**settings)


def test_messages_show_plain_numbers():
    with pytest.raises(InputError, match=r"tracking = -23\.0: "):
        Weights(tracking=np.float64(-23.0))

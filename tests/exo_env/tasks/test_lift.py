"""Reward terms and limits of the lift."""

import math

import numpy as np
import pytest

from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.elbow import device_share
from exo_env.tasks.judgement.rewards import TERM, Weights, term_values

LIMP = {"maximum_activation_flexors": 0.0, "maximum_activation_extensors": 0.0}
HOLD = np.array([-1.0, -1.0])


def test_reward_is_the_sum_of_its_terms(env):
    env.reset(seed=1)
    _, reward, _, _, info = env.step(np.array([-0.5, -0.9]))
    weights, found = info["reward_weights"], info["reward_terms"]
    assert reward == pytest.approx(sum(weights[k] * found[k] for k in weights))
    assert found["tracking"] == pytest.approx(math.exp(-((info["tracking_error_deg"] / 5.0) ** 2)))
    assert found["smoothness"] == pytest.approx(-(0.5**2 + 0.9**2) / 8.0)


def _terms(**changed):
    quiet = {"error": 0.0, "width": math.radians(5.0), "moment": 0.0, "lacking": 1.0, "scale": 4.0,
             "reaction": 400.0, "action": HOLD,
             "before": HOLD, "unsafe": False}  # fmt: skip
    out = np.zeros(len(TERM))
    term_values(*(quiet | changed).values(), out)
    return dict(zip(TERM._fields, out, strict=True))


def test_terms():
    assert np.dot(list(Weights().model_dump().values()), list(_terms().values())) == 1.0
    # What is lacking may be given for nothing; what is beyond it, and what pulls down, may not.
    helped = [_terms(moment=m)["assistance"] for m in (1.0, 3.0, -3.0, 1e3, -1e3)]
    assert helped == [0.0, -0.5, -0.75, -2.0, -2.0]
    assert _terms(reaction=750.0)["reaction"] == -0.5
    assert _terms(before=-HOLD)["smoothness"] == -1.0
    assert _terms(unsafe=True)["unsafe"] == -1.0
    assert _terms(error=math.radians(5.0))["tracking"] == pytest.approx(math.exp(-1.0))


def test_share():
    assert device_share(3.0, 1.0) == 0.25 and device_share(-3.0, -1.0) == 0.25
    assert device_share(5.0, -1.0) == 0.0 and device_share(-1.0, 5.0) == 1.0 and device_share(0.0, 0.0) == 0.0


def test_an_arm_below_the_lowest_angle_ends_the_episode():
    env = ElbowLiftEnv(patient=LIMP, load=1.0, limits={"lowest_deg": 15.0})
    env.reset(seed=0)
    for _ in range(100):
        _, reward, terminated, truncated, info = env.step(np.array([-1.0, 1.0]))
        if terminated:
            break
    assert terminated and not truncated and "outside 15 to 147 deg" in info["event"]
    assert info["reward_terms"]["unsafe"] == -1.0 and reward < -99.0 and not info["solver_failed"]


def test_a_limp_arm_without_help_hangs_without_falling_through():
    """The cable of the machine pulls forward: at rest it is bent by 10 degrees, within the limits."""
    env = ElbowLiftEnv(patient=LIMP, load=1.0)
    env.reset(seed=0)
    for _ in range(120):
        *_, terminated, _, _ = env.step(HOLD)
        assert not terminated
    r = env.readings()
    assert math.degrees(r["elbow_angle.angle"]) == pytest.approx(10.3, abs=0.5)
    # Nothing moves, so the weight hangs on its rope: 1 kg of arm26's own gravity.
    assert r["gym_rope_tension"] == pytest.approx(9.8066, abs=1e-3)


@pytest.mark.parametrize(("limits", "word"), [({"tension": 100.0}, "rope"), ({"reaction": 150.0}, "reaction force")])
def test_limits_end_an_episode(limits, word):
    env = ElbowLiftEnv(patient={}, load=1.0, limits=limits)
    env.reset(seed=0)
    for _ in range(30):
        _, _, terminated, _, info = env.step(np.array([0.5, 0.3]))
        if terminated:
            break
    assert terminated and word in info["event"]

"""What the reward prefers, in whole episodes without drawn noise: the order that a therapist would give."""

import numpy as np
import pytest

from agents.evaluation.comparison.evaluate import evaluate
from agents.policies.baselines import NoAssistance, PidControl
from agents.policies.lagging_pid import LaggingPid
from agents.policies.policy import Policy

REPETITION = {"start_deg": 30.0, "amplitude_deg": 60.0, "rest": 0.5, "duration": 2.0, "pause": 0.5}
SLACK = {"slacking_rate": 0.3, "effort_recovery": 4.0, "least_effort": 0.2, "co_contraction": 0.2, "feedback_gain": 0.2}


class Constant(Policy):
    """The same tension of the agonist always; one that holds the arm somewhere."""

    title, action_mode = "constant", "rope_tension"

    def __init__(self, tension):
        self.name, self.tension = f"constant {tension:g} N", tension

    def reset(self, env):
        self.action = np.array([2.0 * self.tension / env.unwrapped.drive.max_tension[0] - 1.0, -1.0])

    def __call__(self, observation, info):
        return self.action


def returns(policies, **patient):
    settings = {"noise": False, "load": 1.0, "reference": REPETITION}
    found = evaluate(policies, {**SLACK, **patient}, 1, 0, **settings)["policies"]
    ability = next(iter(found.values()))["episodes"][0]["ability"]
    return ability, {name: p["episodes"][0]["measures"] for name, p in found.items()}


SOFT = LaggingPid(authority=0.2, lag_deg=0.0)
IDLE = [NoAssistance(), *(Constant(x) for x in (20.0, 60.0, 100.0))]


@pytest.fixture(scope="module")
def weak():
    """A patient who can hold nearly all of it, and does about half of the work."""
    return returns([SOFT, PidControl(), *IDLE], maximum_activation_flexors=0.12, maximum_activation_extensors=0.1)


def test_less_help_and_good_tracking_is_worth_more_than_more_help_and_perfect_tracking(weak):
    ability, found = weak
    assert 0.5 < ability < 1.0
    soft, stiff, none = (found[n] for n in ("pid_yielding", "pid", "none"))
    assert soft["device_work_share"] < 0.95 * stiff["device_work_share"]
    assert stiff["tracking_rms_deg"] < soft["tracking_rms_deg"] < 1.5
    assert soft["return"] > stiff["return"] + 5.0 and stiff["return"] > none["return"] + 100.0


def test_who_can_do_nothing_is_helped_for_nothing():
    ability, found = returns([PidControl(), *IDLE], maximum_activation_flexors=0.0, maximum_activation_extensors=0.0)
    assert ability < 0.05
    # Of 300; what moves the arm and the weight up, and friction, is all that is beyond what statics lack.
    assert found["pid"]["return"] > 250.0
    assert all(m["return"] < 120.0 for name, m in found.items() if name != "pid")


def test_idleness_does_not_win(weak):
    """Nothing, or one tension that holds the arm somewhere, is worth less than what follows, to those who need help."""
    for found in (weak[1], returns([SOFT, *IDLE], maximum_activation_flexors=0.05)[1]):
        idle = [m["return"] for name, m in found.items() if name == "none" or name.startswith("constant")]
        assert len(idle) == len(IDLE) and max(idle) < found["pid_yielding"]["return"] - 30.0


def test_who_can_do_all_had_better_not_be_helped_much():
    ability, found = returns([SOFT, PidControl(), NoAssistance()])
    assert ability == 1.0
    assert found["pid_yielding"]["return"] > found["pid"]["return"]
    assert max(m["return"] for m in found.values()) < 300.0

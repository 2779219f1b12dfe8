"""How good is my policy beside the shipped ones? A policy is a class; `evaluate` runs it on the same patients."""

from typing import ClassVar

import numpy as np

from agents.evaluation.comparison.evaluate import evaluate
from agents.policies import POLICIES, Policy


class HalfAuthority(Policy):
    """The device's PID with half of its authority, always."""

    name: ClassVar = "half"
    title: ClassVar = "half of the PID"
    action_mode: ClassVar = "pid_setpoint"

    def reset(self, env):
        pass

    def __call__(self, observation, info):
        return np.array([0.0, 0.0])


found = evaluate([HalfAuthority(), POLICIES["pid"]()], "stroke_mild", patients=3, seed=0, episode_duration=3.0)
for name, policy in found["policies"].items():
    print(f"{name:5} return {policy['summary']['return']['value']:.1f}")

# From the command line, beside others: python -m agents evaluate --policy pid own_policy:HalfAuthority --out out/mine

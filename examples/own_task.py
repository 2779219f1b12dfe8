"""How do I write a task of my own, single and in a batch? Here: hold the arm at 60 degrees, whatever happens."""

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.vector_env import AssistanceVectorEnv
from exo_env.kernels import compiled, first_of, places, readings, terms_of
from exo_env.settings import Settings
from exo_env.tasks.elbow import ELBOW, action_channel, device_channels, elbow_readings, read_elbow
from exo_env.tasks.movements.movement import Stay
from exo_env.tasks.observation.channels import Parts
from exo_env.tasks.task import Reported, Task

TARGET = math.radians(60.0)


class Weights(Settings):
    near: float = Field(default=1.0, ge=0.0)


class NoLimits(Settings):
    def numbers(self):
        return np.zeros(0)


TERM = places(Weights.model_fields)


@compiled
def judge(w):
    """1 at the target, less with distance."""
    r, at = readings(w), first_of(w)
    terms_of(w)[TERM.near] = math.exp(-(((r[at[ELBOW.angle]] - TARGET) / 0.2) ** 2))


class HoldAtSixty(Task):
    weights_type, limits_type, movement_type = Weights, NoLimits, Stay
    events: ClassVar = ()
    reported: ClassVar = (Reported("angle_deg", "angle", 180.0 / math.pi),)
    read, judge = read_elbow, judge

    def declared_readings(self, parts: Parts):
        return elbow_readings(parts)

    def declared_groups(self, parts: Parts):
        return {"device": [*device_channels(), action_channel()]}

    def sentence(self, event, values):
        return event


class HoldAtSixtyEnv(AssistanceEnv):
    task_type: ClassVar = HoldAtSixty


class HoldAtSixtyVectorEnv(AssistanceVectorEnv):
    env_type: ClassVar = HoldAtSixtyEnv


env = HoldAtSixtyEnv(reference={"start_deg": 50.0})
print(env.summary())
worlds = HoldAtSixtyVectorEnv(4, reference={"start_deg": 50.0})
worlds.reset(seed=0)
for _ in range(50):
    _, rewards, _, _, infos = worlds.step(np.full((4, 2), (-0.3, -1.0)))
print("after a second at", infos["angle_deg"].round(1), "deg, rewards", rewards.round(2))
worlds.close()

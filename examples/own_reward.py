"""How do I weigh the reward, and add a term? Weights are an argument; a term is a field and a line of a kernel."""

from typing import ClassVar

import numpy as np
from pydantic import Field

from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.kernels import compiled, first_of, readings, terms_of
from exo_env.tasks.elbow import ELBOW
from exo_env.tasks.judgement.rewards import TERM, Weights
from exo_env.tasks.lift import LiftTask

gentle = ElbowLiftEnv(reward_weights={"reaction": 2.0, "smoothness": 0.0})
print("weights:", gentle.weights.model_dump())


class WeightsWithQuiet(Weights):
    """The shipped terms, and one more behind them."""

    quiet: float = Field(default=0.01, ge=0.0)


lift_judge = LiftTask.judge


@compiled
def judge(w):
    """The shipped terms, then minus the tension of all ropes [N]."""
    lift_judge(w)
    r, at, total = readings(w), first_of(w), 0.0
    for i in range(at[ELBOW.tension], at[ELBOW.tension + 1]):
        total += r[i]
    terms_of(w)[len(TERM)] = -total


class QuietLift(LiftTask):
    weights_type: ClassVar = WeightsWithQuiet
    judge: ClassVar = judge


class QuietLiftEnv(AssistanceEnv):
    task_type: ClassVar = QuietLift


env = QuietLiftEnv(patient="stroke_mild")
env.reset(seed=0)
_, reward, _, _, info = env.step(np.array([0.0, -1.0]))
print("terms:", {name: round(x, 3) for name, x in info["reward_terms"].items()}, "reward:", round(reward, 3))

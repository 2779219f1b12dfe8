"""What the project gets, as JSON: single and batch, bits and speed. `python -m steady`."""

from __future__ import annotations

import json
import sys
import time

import gymnasium
import numpy as np
from exo_agents.evaluation.evaluate import evaluate
from exo_agents.policies.baselines import policy
from steady import FOLDER

STEPS, WORLDS = 60, 3


def run(name: str) -> dict:
    """A single environment against the batch, with the same seeds and actions."""
    alone, batch = gymnasium.make(f"steady:steady/{name}"), gymnasium.make_vec(f"steady:steady/{name}", num_envs=WORLDS)
    actions = np.random.default_rng(0).uniform(-1.0, -0.5, (STEPS, *alone.action_space.shape))
    seen, _ = alone.reset(seed=1)
    together, _ = batch.reset(seed=0)
    equal, rewards = [bool((seen == together[1]).all())], []
    for action in actions:
        seen, reward, terminated, _, info = alone.step(action)
        together, all_rewards, *_, infos = batch.step(np.tile(action, (WORLDS, 1)))
        equal.append(bool((seen == together[1]).all() and reward == all_rewards[1]))
        equal.append(info["total_tension"] == infos["total_tension"][1])
        rewards.append(reward)
        if terminated:
            break
    env = alone.unwrapped
    found = {
        "actions": int(alone.action_space.shape[0]),
        "observed": [f"{s.group}.{s.name}" for s in env.observation_structure],
        "muscles": list(env.task.parts.muscles),
        "water": "water" in {e.name for e in env.episode.model.system.forces},
        "tremor": info_of(alone)["patient"]["tremor_amplitude"],
        "equal": all(equal),
        "steps": len(rewards),
        "rewards": [min(rewards), max(rewards)],
        "gap": env.readings()["solver.largest_phi"],
        "reference_seen": any("reference" in s.name for s in env.observation_structure),
    }
    batch.close()
    return found


def info_of(env: gymnasium.Env) -> dict:
    """The info of a new episode."""
    return env.reset(seed=4)[1]


def evaluation(name: str) -> dict:
    """One episode without assistance, as the shipped command measures it, and what it leaves out."""
    found = evaluate([policy("none")], str(FOLDER / "tremor.yaml"), 1, 0, environment=f"steady:steady/{name}")
    (episode,) = found["policies"]["none"]["episodes"]
    return {"left_out": found["left_out"], "measures": episode["measures"]}


def cost(name: str, settings: dict) -> float:
    """CPU time of a step in a batch of 8 [s], the best of five rounds."""
    batch = gymnasium.make_vec(name, num_envs=8, threads=1, **settings)
    batch.reset(seed=0)
    action, times = np.full(batch.action_space.shape, -0.7), []
    for _ in range(5):
        begin = time.process_time()
        for _ in range(20):
            batch.step(action)
        times.append(time.process_time() - begin)
    batch.close()
    return min(times) / 160


if __name__ == "__main__":
    found = {name: run(f"{name}-v0") | evaluation(f"{name}-v0") for name in ("HoldStill", "TwoMuscles")}
    if "--speed" in sys.argv:
        shipped = {"observation": ["device"], "patient": "stroke_mild", "episode_duration": 2.0}
        found["ratio"] = cost("steady:steady/HoldStill-v0", {}) / cost("exo_env:exo/ElbowLift-v2", shipped)
    found["file"] = sys.modules["exo_env"].__file__
    found["lift"] = "exo_env.tasks.lift" in sys.modules
    print(json.dumps(found))

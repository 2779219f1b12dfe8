"""How does a policy learn faster: by gradients through patient and device, or by PPO? Both, for as much CPU time.

    python examples/assist_by_gradient.py [seconds]

Both train a network of 32 tanh units, from the same observation to the device's moment and co-tension, on the same four
patients, for the same cost: squared error from the reference, with a little for the device's moment.
"""

import sys
import time

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv

import exo_env  # noqa: F401  registers
from exo_env.gradients.torch_functions import ControlPeriod

if sys.argv[1:] in (["-h"], ["--help"]):
    sys.exit(__doc__)
SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 6.0
TRAINED, OTHERS = range(4), range(100, 104)
SEEN = ["device.angle", "device.rate", "device.reference", "device.reference_rate"]
torch.set_num_threads(1)
torch.manual_seed(0)


def patient(seed):
    """One patient, the same in each episode, who lifts and returns within 2.6 s."""
    env = gymnasium.make(
        "exo/ElbowLift-v2", action_mode="assist_moment", observation=SEEN, noise=False, cycle=1, episode_duration=2.6,
        reference={"rest": 0.2, "duration": 1.0, "pause": 0.3},
    )  # fmt: skip
    env.reset(seed=seed)
    return Cost(env)


def cost(error, moment):
    """Of one control period: 5 deg of error cost as much as 15 Nm of the device."""
    return (error / np.radians(5.0)) ** 2 + (moment / 15.0) ** 2


class Cost(gymnasium.Wrapper):
    """The environment with that cost in place of its reward."""

    def step(self, action):
        observation, _, terminated, truncated, info = self.env.step(action)
        reading = self.unwrapped.readout.number
        return observation, -float(cost(reading("error"), reading("exo_moment"))), terminated, truncated, info


def mean_cost(env, policy):
    """Mean cost of an episode, by gradients of which the policy may be trained."""
    env.reset()
    course, period = env.unwrapped.episode.course, ControlPeriod(env, ["hinge", "hinge_rate", "angle", "exo_moment"])
    state, seen, total = period.start(), period.readings(), 0.0
    for now, then in zip(course[:-1, :2], course[1:, 0], strict=True):
        action = policy(torch.cat([seen[:2], torch.tensor(now)]).float())
        state, seen = period(state, action)
        total = total + cost(seen[2] - then, seen[3])
    return total / (len(course) - 1)


def score(envs, policy):
    with torch.no_grad():
        return np.mean([float(mean_cost(env, policy)) for env in envs])


def by_gradient(envs, others):
    """Adam on one patient after another, at the best of 0.005, 0.01, 0.02; costs at quarters of the time."""
    policy = torch.nn.Sequential(torch.nn.Linear(4, 32), torch.nn.Tanh(), torch.nn.Linear(32, 2))
    with torch.no_grad():
        policy[2].weight *= 0.1
    optimiser, clock, episodes, table = torch.optim.Adam(policy.parameters(), lr=0.02), Quarters(), 0, []
    while len(table) < 4:
        optimiser.zero_grad()
        mean_cost(envs[episodes % len(envs)], policy).backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimiser.step()
        episodes += 1
        if clock.rings():
            table.append((episodes, score(envs, policy), score(others, policy)))
            clock.goes_on()
    return table


def by_ppo(envs, others):
    """PPO of stable-baselines3 with a network of that size, at the best of 3e-4, 1e-3, 3e-3, 1e-2."""
    worlds = DummyVecEnv([lambda seed=seed: patient(seed) for seed in TRAINED])
    model = PPO(
        "MlpPolicy", worlds, n_steps=130, batch_size=130, gamma=0.98, learning_rate=3e-3, seed=0, device="cpu",
        policy_kwargs={"net_arch": [32], "log_std_init": -1.0},
    )  # fmt: skip
    watch = Watch(lambda x: model.policy.get_distribution(x[None]).mode()[0], envs, others)
    model.learn(10**9, callback=watch)
    return watch.table


class Quarters:
    """Rings at each quarter of the CPU time, without what is spent while it stands."""

    def __init__(self):
        self.begin, self.next = time.process_time(), 0.25 * SECONDS

    def rings(self):
        self.stood = time.process_time()
        return self.stood - self.begin >= self.next

    def goes_on(self):
        self.begin += time.process_time() - self.stood
        self.next += 0.25 * SECONDS


class Watch(BaseCallback):
    """Costs of PPO's policy at each quarter of the time; stops it at the last one."""

    def __init__(self, policy, envs, others):
        super().__init__()
        self.policy, self.envs, self.others, self.table, self.clock = policy, envs, others, [], Quarters()

    def _on_step(self):
        if self.clock.rings():
            episodes = self.num_timesteps // 130
            self.table.append((episodes, score(self.envs, self.policy), score(self.others, self.policy)))
            self.clock.goes_on()
        return len(self.table) < 4


envs, others = ([patient(seed) for seed in seeds] for seeds in (TRAINED, OTHERS))
print(f"without assistance: cost {score(envs, lambda _: torch.tensor([0.0, -1.0])):.2f}")
rows = zip(by_gradient(envs, others), by_ppo(envs, others), strict=True)
print("CPU time   by gradients: episodes, cost, of others    by PPO: episodes, cost, of others")
for k, (a, b) in enumerate(rows, 1):
    print(f"{0.25 * k * SECONDS:6.1f} s   {a[0]:22} {a[1]:7.3f} {a[2]:7.3f} {b[0]:22} {b[1]:7.3f} {b[2]:7.3f}")

"""Control periods of exo/ElbowLift-v0 per second at 50 Hz, resets included, as ratios to MyoSuite's exoskeleton elbow.

    OMP_NUM_THREADS=1 python tests/benchmarks/env_speed.py

A single environment in CPU seconds of one thread; a batch in wall seconds, for which the machine has to be quiet. Both
are scaled by calibration.py. MyoSuite's myoElbowPose1D6MExoRandom-v0 (MuJoCo, no constraint loops, no PID, 0.03 rad
from its exact solution in half a second) does 4,598 such steps, and two of them side by side in processes 1,362, with
the same calibration on a shared two-core machine.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from exo_env.lift_env import ElbowLiftEnv
from exo_env.vector_env import ElbowLiftVectorEnv
from tests.benchmarks.calibration import LUMP_MS, lump, normalised

STEPS, WORLDS = 3000, 64
MYOSUITE, MYOSUITE_PAIR = 4598.0, 1362.0
MODES = ("rope_tension", "pid_setpoint")


def actions_of(mode: str, shape: tuple[int, ...], rough: bool) -> np.ndarray:
    """Random actions: `rough` over the whole box, else as a policy in training tries them around its own."""
    generator = np.random.default_rng(0)
    if rough:
        return generator.uniform(-1.0, 1.0, (*shape, 2))
    centre = np.array([-0.5, -0.95]) if mode == "rope_tension" else np.array([0.0, 0.5])
    return np.clip(centre + 0.1 * generator.standard_normal((*shape, 2)), -1.0, 1.0)


def single(mode: str, rough: bool) -> None:
    """One environment."""
    env, resets, times = ElbowLiftEnv(action_mode=mode), [0], np.zeros(STEPS)
    actions = actions_of(mode, (STEPS,), rough)

    def run() -> None:
        resets[0] = 0
        for k, action in enumerate(actions):
            begin = time.thread_time()
            *_, terminated, truncated, _ = env.step(action)
            times[k] = time.thread_time() - begin
            if terminated or truncated:
                env.reset()
                resets[0] += 1

    def reset() -> None:
        for _ in range(20):
            env.reset()

    env.reset(seed=0)
    run()
    seconds, _ = normalised(run, 3)
    reset_seconds, _ = normalised(reset, 3)
    median, tail = np.percentile(times, (50.0, 99.9))
    rate = STEPS / seconds
    print(
        f"{mode:14} {'rough' if rough else 'policy':7} {rate:8.0f} {rate / MYOSUITE:6.2f} {resets[0]:7d} "
        f"{reset_seconds / 20 * 1e3:9.1f} {tail / median:18.1f}"
    )


def batch(mode: str, rough: bool, threads: int) -> None:
    """Many worlds."""
    worlds = ElbowLiftVectorEnv(WORLDS, action_mode=mode, threads=threads)
    rows = actions_of(mode, (300, WORLDS), rough)
    worlds.reset(seed=0)
    for row in rows[:5]:
        worlds.step(row)
    before, begin = lump(), time.perf_counter()
    for row in rows:
        worlds.step(row)
    seconds = (time.perf_counter() - begin) * LUMP_MS / (0.5 * (before + lump()))
    rate = rows.shape[0] * WORLDS / seconds
    print(f"{mode:14} {'rough' if rough else 'policy':7} {threads:7d} {rate:8.0f} {rate / MYOSUITE:6.2f} "
          f"{rate / MYOSUITE_PAIR:6.1f}")  # fmt: skip
    worlds.close()


def main() -> None:
    """Print two tables."""
    print("one environment; ratio to MyoSuite")
    print(
        f"{'mode':14} {'actions':7} {'steps/s':>8} {'ratio':>6} {'resets':>7} {'reset ms':>9} {'99.9 % / median':>18}"
    )
    for mode in MODES:
        for rough in (True, False):
            single(mode, rough)
    print(f"\n{WORLDS} worlds; ratios to MyoSuite, alone and as a pair")
    print(f"{'mode':14} {'actions':7} {'threads':>7} {'steps/s':>8} {'alone':>6} {'pair':>6}")
    for mode in MODES:
        for rough in (True, False):
            for threads in (1, 2):
                batch(mode, rough, threads)


if __name__ == "__main__":
    main()

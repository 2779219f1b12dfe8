"""Control periods of exo/ElbowLift-v0 per second: one environment, random actions at 50 Hz, resets included.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/env_speed.py

CPU seconds of one process, scaled by calibration.py. MyoSuite's exoskeleton elbow (MuJoCo, no constraint loops, no PID)
does 4,598 such steps with the same calibration on a shared two-core machine.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from exo_env.lift_env import ElbowLiftEnv
from tests.benchmarks.calibration import normalised

STEPS = 1500
MYOSUITE = 4598.0


def main() -> None:
    """Print a table."""
    print(f"{'mode':14} {'amplitude':>9} {'steps/s':>8} {'MyoSuite':>9} {'resets':>7} {'reset ms':>9}")
    for mode, amplitude in (("rope_tension", 1.0), ("rope_tension", 0.2), ("pid_setpoint", 1.0)):
        env, resets, generator = ElbowLiftEnv(action_mode=mode), [0], np.random.default_rng(0)
        actions = amplitude * generator.uniform(-1.0, 1.0, (STEPS, 2))

        def run(env: ElbowLiftEnv = env, actions: np.ndarray = actions, resets: list[int] = resets) -> None:
            for action in actions:
                *_, terminated, truncated, _ = env.step(action)
                if terminated or truncated:
                    env.reset()
                    resets[0] += 1

        def reset(env: ElbowLiftEnv = env) -> None:
            for _ in range(20):
                env.reset()

        env.reset(seed=0)
        run()
        resets[0] = 0
        seconds, _ = normalised(run)
        reset_seconds, _ = normalised(reset)
        print(
            f"{mode:14} {amplitude:9.1f} {STEPS / seconds:8.0f} {MYOSUITE:9.0f} {resets[0] / 5:7.1f} "
            f"{reset_seconds / 20 * 1e3:9.1f}"
        )


if __name__ == "__main__":
    main()

"""Control periods a second of MyoSuite's exoskeleton elbow, alone and as two processes side by side.

    .venv-peers/myo/bin/python tests/benchmarks/peers/myosuite_env.py [--steps 3000] [--json FILE]

Random actions over the whole box, resets included, 50 Hz (ten steps of MuJoCo a control period). Alone in CPU seconds;
the pair (Gymnasium's AsyncVectorEnv) in wall seconds, for which the machine has to be quiet.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

import gymnasium
import mujoco
import numpy as np

from tests.benchmarks.calibration import normalised
from tests.benchmarks.peers.record import Row, parser, row, save

ENVIRONMENT, PAIR, RESETS = "myoElbowPose1D6MExoRandom-v0", 2, 50
PROGRAM = f"MyoSuite {version('myosuite')} (MuJoCo {mujoco.__version__})"


def make() -> Any:
    """One environment; MyoSuite prints when it is imported and when one is made."""
    warnings.filterwarnings("ignore")
    with contextlib.redirect_stdout(io.StringIO()):
        import myosuite  # noqa: F401

        return gymnasium.make(ENVIRONMENT)


def alone(steps: int, repeats: int) -> list[Row]:
    """One environment: a control period, and a reset."""
    env = make()
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (steps, *env.action_space.shape)).astype(np.float32)

    def run() -> None:
        env.reset(seed=0)
        for action in actions:
            *_, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    def reset() -> None:
        for k in range(RESETS):
            env.reset(seed=k)

    reset()
    step_seconds, reset_seconds = normalised(run, repeats)[0] / steps, normalised(reset, repeats)[0] / RESETS
    env.close()
    return [row("environment", PROGRAM, "single", step_seconds), row("environment", PROGRAM, "reset", reset_seconds)]


def pair(steps: int, repeats: int) -> Row:
    """Two processes; the time of a control period of one of them."""
    worlds = gymnasium.vector.AsyncVectorEnv([make] * PAIR)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (steps, *worlds.action_space.shape)).astype(np.float32)

    def run() -> None:
        worlds.reset(seed=0)
        for action in actions:
            worlds.step(action)

    worlds.reset(seed=0)
    seconds, _ = normalised(run, repeats, clock=time.perf_counter)
    worlds.close()
    return row("environment", PROGRAM, "pair of processes", seconds / (steps * PAIR))


def main() -> None:
    """Time both."""
    found = parser(__doc__)
    found.add_argument("--steps", type=int, default=3000, help="control periods of a timing")
    given = found.parse_args()
    save(given.json, [*alone(given.steps, given.repeats), pair(max(1, given.steps // PAIR), given.repeats)])


if __name__ == "__main__":
    main()

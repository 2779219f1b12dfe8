"""Importing exo_env costs next to nothing; simulating needs neither a training library nor one for pictures."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("torch", "stable_baselines3", "sb3_contrib", "pygame", "matplotlib", "imageio", "moviepy", "tensorboard")

IMPORT = """
import sys, time
begin = time.perf_counter()
import gymnasium
middle = time.perf_counter()
import exo_env
end = time.perf_counter()
numba = sorted({"numba", "scipy", "dms_core.compiled"} & set(sys.modules))
assert not numba, numba
sys.argv.append(repr((end - middle) / (middle - begin)))
"""

USE = """
import sys
import gymnasium
env = gymnasium.make("exo_env:exo/ElbowLift-v2")
env.reset(seed=0)
env.step(env.action_space.sample())
"""

LOADED = "\nloaded = sorted(set({heavy!r}) & set(sys.modules))\nassert not loaded, loaded\n"


def _run(code: str) -> subprocess.CompletedProcess[str]:
    """A new process in which a warning is an error."""
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done


def test_import_is_silent_and_cheap():
    done = _run(IMPORT + LOADED.format(heavy=HEAVY) + "print(sys.argv[-1])")
    assert done.stderr == "" and len(done.stdout.splitlines()) == 1
    # Measured: 0.002 of what `import gymnasium` took before it (0.15 s). dms_core with numba would be 5 times that.
    assert float(done.stdout) < 0.3


def test_simulating_loads_nothing_heavy_either():
    assert _run(USE + LOADED.format(heavy=HEAVY)).stdout == ""

"""What the solver does in a control period, as counts, and the benchmark that counts it."""

from __future__ import annotations

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv
from tests.benchmarks import env_profile

ACTIONS = env_profile.actions_of("elbow_lift", 200)


def _run(env: ElbowLiftEnv) -> np.ndarray:
    """Positions behind each control period."""
    env.reset(seed=0)
    found = []
    for action in ACTIONS:
        *_, terminated, truncated, _ = env.step(action)
        assert not terminated and not truncated
        found.append(env.world.dynamics.state.q.copy())
    return np.array(found)


def test_counters_count_and_change_nothing():
    plain, counted = ElbowLiftEnv(), ElbowLiftEnv()
    wanted = _run(plain)
    counted.reset(seed=0)
    counters = env_profile.Counters(counted.world.dynamics)
    assert np.array_equal(_run(counted), wanted)
    rows = {row.what: row.calls * len(ACTIONS) for row in counters.parts(len(ACTIONS))}
    stats = counted.world.dynamics.stats()
    attempts = stats.steps + stats.rejected_error
    assert abs(rows["steps, around the stages"] - len(ACTIONS)) < 0.5
    assert abs(rows["Newton's method around these"] - 2 * attempts) <= 0.1 * attempts  # stages that were tried again
    assert rows["solve"] > stats.newton_iterations > rows["residual"] * 0.9 > 0.0


def test_benchmark_prints_rows_that_sum_up(capsys):
    env_profile.main(["--env", "elbow_lift", "--steps", "40", "--repeats", "1"])
    lines = capsys.readouterr().out.splitlines()
    numbers = [float(line.split()[-1]) for line in lines[2:]]
    assert len(numbers) > 12
    # Each number is rounded to 0.01 us.
    assert abs(sum(numbers[:-2]) - numbers[-2]) < 0.01 * len(numbers)
    assert numbers[-1] > 0.0

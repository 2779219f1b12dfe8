"""Control periods of exo/ElbowLift-v2 per second at 50 Hz, resets included, as ratios to MyoSuite's exoskeleton elbow.

    OMP_NUM_THREADS=1 python tests/benchmarks/env_speed.py

A single environment in CPU seconds of one thread; a batch in wall seconds, for which the machine has to be quiet. Both
are scaled by calibration.py. MyoSuite's myoElbowPose1D6MExoRandom-v0 (MuJoCo, no constraint loops, no PID, 0.03 rad
from its exact solution in half a second) is timed alone and as a pair of processes by `make bench-peers`; without its
figures those of peers.csv are used.

Actions are random over the whole box ("rough") or as a policy in training tries them around its own ("policy"). The
table of one environment tells beside the rate what a reset costs over a step, and the 99.9th percentile of a step over
the median, resets apart; the CPU time of each step is taken, so that other programs count little.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv
from tests.benchmarks import csv_file
from tests.benchmarks.calibration import normalised
from tests.benchmarks.peer_table import MEASURED, PeerTable

MODES = ("rope_tension", "pid_setpoint")
MOST_TAIL, MOST_RESET = 5.0, 5.0
"""Wanted at most: the 99.9th percentile over the median, and a reset over a step."""
Row = tuple[str, str, str, float, float, float]
"""What, mode, actions, steps a second, 99.9 % over median, reset over step."""


def actions_of(mode: str, shape: tuple[int, ...], rough: bool) -> np.ndarray:
    """Random actions: `rough` over the whole box, else as a policy in training tries them around its own."""
    generator = np.random.default_rng(0)
    if rough:
        return generator.uniform(-1.0, 1.0, (*shape, 2))
    centre = np.array([-0.5, -0.95]) if mode == "rope_tension" else np.array([0.0, 0.5])
    return np.clip(centre + 0.1 * generator.standard_normal((*shape, 2)), -1.0, 1.0)


def single(mode: str, rough: bool, steps: int, repeats: int, rival: float) -> Row:
    """One environment."""
    env, step_times, reset_times = ElbowLiftEnv(action_mode=mode), list[float](), list[float]()
    actions = actions_of(mode, (steps,), rough)

    def run() -> None:
        for action in actions:
            begin = time.thread_time()
            *_, terminated, truncated, _ = env.step(action)
            middle = time.thread_time()
            step_times.append(middle - begin)
            if terminated or truncated:
                env.reset()
                reset_times.append(time.thread_time() - middle)

    env.reset(seed=0)
    run()
    step_times.clear(), reset_times.clear()
    seconds, _ = normalised(run, repeats)
    median, tail = np.percentile(step_times, (50.0, 99.9))
    reset = float(np.mean(reset_times) / np.mean(step_times)) if reset_times else float("nan")
    style, rate = "rough" if rough else "policy", steps / seconds
    print(f"{mode:14} {style:7} {rate:8.0f} {rate / rival:8.2f} {len(reset_times):7d} {reset:12.1f} "
          f"{tail / median:14.1f} {max(step_times) / median:9.1f}", flush=True)  # fmt: skip
    return ("single", mode, style, rate, float(tail / median), reset)


def batch(mode: str, rough: bool, worlds: int, threads: int, rows: int, repeats: int) -> float:
    """Control periods a second of many worlds, in wall time."""
    found = ElbowLiftVectorEnv(worlds, action_mode=mode, threads=threads)
    actions = actions_of(mode, (rows, worlds), rough)
    found.reset(seed=0)
    for row in actions[:5]:
        found.step(row)

    def run() -> None:
        for row in actions:
            found.step(row)

    seconds, _ = normalised(run, repeats, clock=time.perf_counter)
    found.close()
    return rows * worlds / seconds


def singles(given: argparse.Namespace, peers: PeerTable) -> list[Row]:
    """The table of one environment."""
    rival = 1e3 / peers.of("environment", "single")[0].ms
    print(f"one environment; ratio to {peers.of('environment')[0].program} alone: {rival:.0f} steps/s, "
          f"{peers.origin('environment')}")  # fmt: skip
    print(f"{'mode':14} {'actions':7} {'steps/s':>8} {'MyoSuite':>8} {'resets':>7} {'reset / step':>12} "
          f"{'99.9 % / median':>14} {'max / med':>9}")  # fmt: skip
    found = [single(m, rough, given.steps, given.repeats, rival) for m in MODES for rough in (True, False)]
    print(f"wanted: reset / step at most {MOST_RESET:g}, 99.9 % / median at most {MOST_TAIL:g}; "
          f"largest here: {max(r[5] for r in found):.1f} and {max(r[4] for r in found):.1f}")  # fmt: skip
    return found


def batches(given: argparse.Namespace, peers: PeerTable, alone: list[Row]) -> list[Row]:
    """The table of many worlds."""
    rival = 1e3 / peers.of("environment", "single")[0].ms
    pair = 1e3 / peers.of("environment", "pair")[0].ms
    print(
        f"\n{given.worlds} worlds, wall time; ratios to MyoSuite alone, to its pair of processes ({pair:.0f} steps/s),"
    )
    print("to our one environment in that row of the table above, and to the best one of that table")
    print(
        f"{'mode':14} {'actions':7} {'threads':>7} {'steps/s':>8} {'MyoSuite':>8} {'pair':>6} {'ours':>6} {'best':>6}"
    )
    best, found = max(r[3] for r in alone), list[Row]()
    for _, mode, style, rate, _, _ in alone:
        for threads in (1, 2):
            many = batch(mode, style == "rough", given.worlds, threads, given.rows, given.repeats)
            found.append((f"{given.worlds} worlds, {threads} threads", mode, style, many, float("nan"), float("nan")))
            print(f"{mode:14} {style:7} {threads:7d} {many:8.0f} {many / rival:8.2f} {many / pair:6.2f} "
                  f"{many / rate:6.2f} {many / best:6.2f}", flush=True)  # fmt: skip
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=3000, help="control periods of a timing of one environment")
    parser.add_argument("--worlds", type=int, default=64, help="of a batch")
    parser.add_argument("--rows", type=int, default=300, help="control periods of a timing of a batch")
    parser.add_argument("--repeats", type=int, default=3, help="of each timing; the median counts")
    parser.add_argument("--peers", type=Path, default=MEASURED, help="figures of other programs")
    parser.add_argument("--out", type=Path, help="a CSV of our rows")
    given = parser.parse_args(arguments)
    peers = PeerTable(given.peers)
    alone = singles(given, peers)
    rows = [*alone, *batches(given, peers, alone)]
    if given.out:
        columns = ("what", "mode", "actions", "steps_per_s", "tail_over_median", "reset_over_step")
        csv_file.write(given.out, columns, rows)


if __name__ == "__main__":
    main()

"""What the adjoint of an episode of the arm costs, over the run itself: the figures of docs/sensitivities.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/adjoint_cost.py [--seconds 6] [--repeats 5] [--methods sdirk2 bdf2]

The arm in its device lifts for some seconds; the device's command jumps every 20 ms. Differentiated are a state and a
sensor at the end, a sensor at the end of each period, and the integral of one, by the command of each period and by
three declared numbers. Medians of CPU time; run and adjoint take turns, so that the load of the machine counts little.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, Result, SimulationError, SolverOptions
from dms_core.model import Constant, Input, MinimumJerk
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import Output, Sensitivity, Shift
from dms_core.simulation.state import COUNTS
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.ecosystem import Ecosystem

PERIOD = 0.02
"""Between two jumps of the command [s]."""
RTOL = 1e-4
NUMBERS = (Number("forearm", "mass"), Number("pid", "kp"), Number("BIClong", "max_isometric_force"))


def arm(seconds: float) -> Model:
    """Six muscles at an activation of 0.4, and the device with its ropes, its PID and a command."""
    start, end = math.radians(40.0), math.radians(60.0)
    return Model(Ecosystem().system(
        start, MinimumJerk(times=(0.0, seconds), values=(start, end)), {m: Constant(value=0.4) for m in Arm().muscles},
        device_inputs=[Input(name="assistance", signal=Constant(value=0.9))],
    ))  # fmt: skip


def episode(model: Model, method: str, periods: int) -> RecordedWorld:
    """A run whose command jumps at the begin of each period."""
    world = RecordedWorld(model, SolverOptions(rtol=RTOL, method=method))
    for k, jump in enumerate(np.random.default_rng(0).standard_normal(periods)):
        world.set_input("assistance", 0.9 + 0.1 * jump)
        if world.advance((k + 1) * PERIOD) is not Result.SUCCESS:
            raise SimulationError(world.message)
    return world


def outputs(periods: int) -> dict[str, list[Output]]:
    """What is differentiated, by a name for the table."""
    return {
        "at the end": [Output("v.forearm.x"), Output("elbow_angle.angle")],
        "at each period": [Output("elbow_reaction.Fy", (k + 1) * PERIOD) for k in range(periods)],
        "integral": [Output("agonist_tension", integral=True)],
    }


def adjoint(world: RecordedWorld, of: list[Output], periods: int) -> Sensitivity:
    """The sum of these outputs by all commands and numbers."""
    commands = [Shift("assistance", k * PERIOD, (k + 1) * PERIOD) for k in range(periods)]
    run = Sensitivity(world, of, [*commands, *NUMBERS])
    run.adjoint(weights=np.ones((1, len(of))))
    return run


def report(model: Model, method: str, seconds: float, repeats: int) -> None:
    """Lines of the table."""
    periods = round(seconds / PERIOD)
    # Everything is compiled and loaded before the clock starts.
    short = episode(model, method, 2)
    for of in outputs(2).values():
        adjoint(short, of, 2)
    ratios: dict[str, list[float]] = {name: [] for name in outputs(periods)}
    for _ in range(repeats):
        begin = time.process_time()
        world = episode(model, method, periods)
        forward = time.process_time() - begin
        for name, of in outputs(periods).items():
            begin = time.process_time()
            run = adjoint(world, of, periods)
            ratios[name].append((time.process_time() - begin) / forward)
            if name == "at the end":
                factors = run.replay.state.counts[COUNTS.factorisations] / world.stats().steps
    print(
        f"{method:7s} {world.stats().steps:6d} steps, {factors:.2f} matrices a step; adjoint over run: "
        + ", ".join(f"{name} {statistics.median(x):.2f}" for name, x in ratios.items()),
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--methods", nargs="+", default=["sdirk2", "bdf2"])
    given = parser.parse_args()
    model = arm(given.seconds)
    for method in given.methods:
        report(model, method, given.seconds, given.repeats)


if __name__ == "__main__":
    main()

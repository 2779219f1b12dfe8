"""How the cost of a step grows with the size of a problem: links, elements of a beam, worlds, muscles.

    OMP_NUM_THREADS=1 python tests/benchmarks/growth.py [--links ...] [--elements ...] [--worlds ...] [--muscles ...]

links    the hanging chain of N links, 13 N unknowns, fixed steps of 1 ms; CPU time
elements the swinging beam of flexible_reference.py with N elements, fixed steps of 1 ms; CPU time
worlds   a batch of N environments over whole episodes, a control period of one world; 1 thread in CPU time, 2 in wall
         time. Every world has one of the same 16 patients with the same actions, so that each N does the same work a
         world; where N is less than 16, several batches are timed. Beginning an episode is not timed.
muscles  arm26 with its six muscles repeated, each of a share of the force, so that the motion is the same; fixed steps
         of 1 ms; CPU time

All scaled by calibration.py. Slopes are those of log cost over log size: from one size to the next, and of a straight
line through all sizes from 8 (from 12 muscles): links, elements and muscles should have at most 1.1, worlds 0.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, Simulation, SolverOptions, System
from dms_core.model import Revolute, ThelenMuscle
from dms_core.model.signals import Constant
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.bare_arm import bare_arm
from exo_env.envs.elbow_lift import ElbowLiftVectorEnv
from tests.benchmarks import csv_file
from tests.benchmarks.calibration import normalised
from tests.benchmarks.env_speed import actions_of
from tests.benchmarks.problems import ARM_TASKS, START_ACTIVATION, beam, chain

STEP, WARM = 1e-3, 0.02
"""Step of the chain and the arm [s], and what is solved before the clock starts."""
STEEPEST, FLAT, WARM_ROWS = 1.1, 16, 5
"""Slope allowed; number of different patients; control periods before the clock starts."""
MODE = "pid_setpoint"
MUSCLES = Arm().muscles
Row = tuple[str, int, float, float, float]
"""What, size, us a step, us a step and piece, slope from the size before."""


def stepped(model: Model, steps: int, repeats: int) -> tuple[float, Simulation]:
    """Normalised CPU us of a fixed step."""

    def prepare() -> Simulation:
        simulation = Simulation(model, SolverOptions(fixed_step=STEP))
        simulation.advance(WARM)
        return simulation

    def run(simulation: Simulation) -> Simulation:
        if not simulation.advance(WARM + steps * STEP):
            raise RuntimeError(f"{model.system.name}: the solver failed")
        return simulation

    seconds, simulation = normalised(run, repeats, prepare=prepare)
    return seconds / steps * 1e6, simulation


def links(sizes: Sequence[int], steps: int, repeats: int) -> list[Row]:
    """The chain."""
    heading("links", "us/step", "us/link", "slope", "iterations", "factorisations", "compile s")
    rows: list[Row] = []
    for n in sizes:
        begin = time.process_time()
        model = Model(chain(n))
        compiled = time.process_time() - begin
        us, simulation = stepped(model, steps, repeats)
        add(rows, "links", n, us, us / n, per_step(simulation), f"{compiled:10.2f}")
    return conclude(rows, 8, 2)


def elements(sizes: Sequence[int], steps: int, repeats: int) -> list[Row]:
    """The beam."""
    heading("elements", "us/step", "us/element", "slope", "iterations", "factorisations")
    rows: list[Row] = []
    for n in sizes:
        us, simulation = stepped(Model(beam(n)), steps, repeats)
        add(rows, "elements", n, us, us / n, per_step(simulation))
    return conclude(rows, 8, 2)


def muscles(counts: Sequence[int], steps: int, repeats: int) -> list[Row]:
    """The arm."""
    heading("muscles", "us/step", "us/muscle", "slope", "iterations", "factorisations")
    rows: list[Row] = []
    for n in counts:
        us, simulation = stepped(Model(many_muscles(n // len(MUSCLES))), steps, repeats)
        add(rows, "muscles", n, us, us / n, per_step(simulation))
    return conclude(rows, 12, 2)


def many_muscles(times: int) -> System:
    """arm26, co-contracting, each muscle replaced by `times` of a share of its force."""
    start, excitations = ARM_TASKS["co-contract"]
    system = bare_arm(start, {m: Constant(value=excitations[m[:3]]) for m in MUSCLES}, START_ACTIVATION)
    single = [force for force in system.forces if not isinstance(force, ThelenMuscle)]
    shares = [
        force.model_copy(
            update={
                "name": f"{force.name}{k or ''}", "max_isometric_force": force.max_isometric_force / times,
            }
        )
        for k in range(times)
        for force in system.forces
        if isinstance(force, ThelenMuscle)
    ]  # fmt: skip
    # A system adds the unit norms of its bodies by itself, so those of the other one stay behind.
    elbow = [constraint for constraint in system.constraints if isinstance(constraint, Revolute)]
    return System("arm26", bodies=system.bodies, constraints=elbow, forces=[*single, *shares], inputs=system.inputs)


def worlds(sizes: Sequence[int], rows: int, repeats: int, threads: int) -> list[Row]:
    """A batch of environments."""
    clock = time.process_time if threads == 1 else time.perf_counter
    heading("worlds", "us/world", "ms/step", "slope", f"{threads} thread{'s' * (threads > 1)}, "
            f"{'CPU' if threads == 1 else 'wall'} time")  # fmt: skip
    found: list[Row] = []
    actions = actions_of(MODE, (rows, FLAT), rough=False)
    for n in sizes:
        batch = ElbowLiftVectorEnv(n, action_mode=MODE, threads=threads)
        one_episode(batch, [0] * n, actions[:WARM_ROWS], 1, clock)
        us = 0.0
        # Repeats go through all patients before any comes again, since the machine's speed drifts.
        for first in range(0, max(n, FLAT), n) if n < FLAT else (0,):
            patients = [(first + i) % FLAT for i in range(n)]
            us += one_episode(batch, patients, actions, repeats, clock) * n / max(n, FLAT)
        batch.close()
        add(found, f"worlds, threads={threads}", n, us, us * n * 1e-3)
    return conclude(found, 1, 1)


def one_episode(batch: ElbowLiftVectorEnv, patients: list[int], actions: np.ndarray, repeats: int, clock) -> float:
    """Normalised us of a control period of one world."""

    def run(_: object) -> None:
        for row in actions:
            batch.step(row[patients])

    seconds, _ = normalised(run, repeats, prepare=lambda: batch.reset(seed=patients), clock=clock)
    return seconds / (actions.shape[0] * len(patients)) * 1e6


def per_step(simulation: Simulation) -> str:
    """Newton iterations and factorisations a step, in columns."""
    s = simulation.stats()
    return f"{s.newton_iterations / s.steps:10.2f} {s.factorisations / s.steps:14.2f}"


def heading(name: str, *columns: str) -> None:
    """Print the head of a table."""
    print(f"\n{name:>8} " + " ".join(f"{c:>{max(10, len(c))}}" for c in columns), flush=True)


def add(rows: list[Row], what: str, size: int, us: float, share: float, *more: str) -> None:
    """Print and keep a row."""
    before = rows[-1] if rows else None
    slope = np.nan if before is None else float(np.log(us / before[2]) / np.log(size / before[1]))
    rows.append((what, size, us, share, slope))
    print(f"{size:8d} {us:10.1f} {share:10.3f} {slope:10.2f} " + " ".join(more), flush=True)


def conclude(rows: list[Row], smallest: int, column: int) -> list[Row]:
    """Print the slope of a line through the sizes from `smallest`."""
    used = [(row[1], row[2]) for row in rows if row[1] >= smallest]
    if len(used) > 1:
        slope = np.polyfit(*np.log(np.array(used)).T, 1)[0]
        wanted = f"at most {STEEPEST:g}" if column > 1 else "0"
        spread = max(us for _, us in used) / min(us for _, us in used)
        flat = "" if column > 1 else f"; dearest over cheapest {spread:.2f}"
        print(f"slope from {used[0][0]} to {used[-1][0]}: {slope:.2f} (wanted: {wanted}){flat}")
    return rows


def main(arguments: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--links", type=int, nargs="*", default=[1, 2, 4, 8, 16, 32, 64, 128, 256])
    parser.add_argument("--elements", type=int, nargs="*", default=[4, 8, 16, 32, 64], help="of a beam")
    parser.add_argument("--worlds", type=int, nargs="*", default=[1, 4, 16, 64, 256])
    parser.add_argument("--muscles", type=int, nargs="*", default=[6, 12, 24, 48, 96, 192], help="multiples of 6")
    parser.add_argument("--threads", type=int, nargs="*", default=[1, 2], help="of the worlds")
    parser.add_argument("--steps", type=int, default=200, help="of a timing of chain, beam or arm")
    parser.add_argument("--rows", type=int, default=300, help="control periods of an episode; 300 is a whole one")
    parser.add_argument("--repeats", type=int, default=3, help="of each timing; the median counts")
    parser.add_argument("--out", type=Path, help="a CSV of the tables")
    given = parser.parse_args(arguments)
    if any(n < 6 or n % 6 for n in given.muscles):
        parser.error("--muscles: multiples of 6 are wanted")
    if any(n < 1 or (FLAT % n if n < FLAT else n % FLAT) for n in given.worlds):
        parser.error(f"--worlds: divisors or multiples of {FLAT} are wanted")
    rows = links(given.links, given.steps, given.repeats) if given.links else []
    rows += elements(given.elements, given.steps, given.repeats) if given.elements else []
    rows += muscles(given.muscles, given.steps, given.repeats) if given.muscles else []
    for threads in given.threads if given.worlds else []:
        rows += worlds(given.worlds, given.rows, max(1, given.repeats - 2), threads)
    if given.out:
        csv_file.write(given.out, ("what", "size", "us_per_step", "us_per_piece_or_ms_per_batch", "slope"), rows)


if __name__ == "__main__":
    main()

"""Where the time of env.step goes: the parts of one control period, counted and timed.

    OMP_NUM_THREADS=1 python tests/benchmarks/env_profile.py [--env ...] [--out docs/env_profile.csv]

Parts of the solver are counted and timed where they are called, by the processor's cycle counter: each is called by its
address (dms_core/simulation/iteration/parts.py), which is replaced by that of a function that counts, times and calls
it; the compiled period as a whole likewise. What a part calls in turn is taken off, so that "Newton's method" is what
is left of a stage without its residuals. What comes before and behind the solver is timed in loops of its own, in CPU
time; within a step it is slower, as the processor meets it cold, and by how much is a row. What Python does is the CPU
time of a step less the compiled period. Calls that another program interrupted, longer than a millisecond, count with
the mean of the others. Actions are those that a policy tries in training. The sum of all rows is printed beside
env.step as a whole, which is timed without counters.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from dms_core import World
from dms_core.compiled.arena import floats, inner, ints, table_at
from dms_core.compiled.calls import PART, address, call_part
from dms_core.simulation.iteration import parts as solver
from dms_core.simulation.iteration.parts import PARTS, Parts
from dms_core.simulation.state import STATE
from exo_env.envs import base_env
from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.envs.hidden_intent import HiddenIntentEnv
from exo_env.tables import PATIENT_TABLES, WORLD
from exo_env.world.kernels import control_period
from exo_env.world.kernels.observe import observe
from tests.benchmarks import csv_file

ENVS: dict[str, tuple[type[AssistanceEnv], str, tuple[float, float]]] = {
    "hidden_intent": (HiddenIntentEnv, "assist_moment", (0.0, -1.0)),
    "elbow_lift": (ElbowLiftEnv, "rope_tension", (-0.5, -0.95)),
}
"""Class, action mode, and the action that a policy tries others around."""
LONGEST = 1e-3
"""Time of a call that was not interrupted, at most [s]."""
ROWS = {
    "inputs": "inputs in time",
    "residual": "residual",
    "constraints": "constraint errors, to close them",
    "newton_matrix": "derivatives and factors of a stage",
    "newton_solution": "solve",
    "rate_matrix": "derivatives and factors of the accelerations alone",
    "both_matrices": "derivatives and factors of accelerations and next step",
    "rate_solution": "solve for the accelerations",
    "solve_stage": "Newton's method around these",
    "consistent_rates": "accelerations anew, around these",
    "stage_rates": "accelerations at the end of a period, around these",
    "jump_rates": "accelerations behind a jump, around these",
    "restart": "restart, around these",
    "advance": "steps, around the stages",
}
"""Words for the parts of the solver."""
WITHIN = {
    "solve_stage": ("inputs", "residual", "constraints", "newton_matrix", "newton_solution"),
    "stage_rates": ("both_matrices", "rate_matrix", "rate_solution"),
    "advance": ("solve_stage", "stage_rates", "consistent_rates", "jump_rates", "restart"),
}
"""What each calls in turn; the few other calls go to "around"."""


class Part(NamedTuple):
    """A row of the table."""

    what: str
    calls: float
    """Calls in a control period."""
    each: float
    """[us]"""

    @property
    def us(self) -> float:
        """[us] in a control period."""
        return self.calls * self.each


@intrinsic
def cycles(typingctx):  # noqa: ANN001, ANN201
    """The processor's cycle counter."""

    def codegen(context, builder, sig, args):  # noqa: ANN001, ANN202
        counter = ir.FunctionType(ir.IntType(64), [])
        return builder.call(cgutils.get_or_insert_function(builder.module, counter, "llvm.readcyclecounter"), [])

    return types.int64(), codegen


_now = njit(lambda: cycles())


def cycles_per_us() -> float:
    """Cycles of the counter in a microsecond."""
    _now()
    before, begin = _now(), time.perf_counter()
    time.sleep(0.2)
    return float((_now() - before) / (time.perf_counter() - begin) * 1e-6)


def _timed(target: int, signature: Any, call: Any, table: int, k: int, longest: float) -> int:
    """Address of a function that calls the one at `target` and notes it in row k of the counts."""
    names = ", ".join(f"x{i}" for i in range(len(signature.args)))
    keep = "" if signature.return_type == types.none else "result = "
    source = (
        f"def timed({names}):\n"
        f"    counts = floats(table_at(table, 1), 0)\n"
        f"    begin = cycles()\n"
        f"    {keep}call(target, {names})\n"
        f"    spent = 1.0 * (cycles() - begin)\n"
        f"    if spent < longest:\n"
        f"        counts[3 * k] += 1.0\n"
        f"        counts[3 * k + 1] += spent\n"
        f"    else:\n"
        f"        counts[3 * k + 2] += 1.0\n" + ("    return result\n" if keep else "")
    )
    known = {"floats": floats, "table_at": table_at, "cycles": cycles, "call": call}
    known |= {"target": target, "table": table, "k": k, "longest": longest}
    exec(source, known)  # numba compiles no function of a variable number of arguments to an address
    return address(njit(error_model="numpy")(known["timed"]), signature)


def _timed_period(table: int, k: int, longest: float) -> Any:
    """The compiled control period, noted in row k of the counts."""
    run_period = control_period.run_period

    @njit(error_model="numpy")
    def timed(w, action):  # noqa: ANN001, ANN202
        counts = floats(table_at(table, 1), 0)
        begin = cycles()
        code = run_period(w, action)
        spent = 1.0 * (cycles() - begin)
        if spent < longest:
            counts[3 * k] += 1.0
            counts[3 * k + 1] += spent
        else:
            counts[3 * k + 2] += 1.0
        return code

    return timed


class Counters:
    """Counts and times the parts of the solver of a world from now on."""

    def __init__(self, world: World) -> None:
        # A row a part, and a last one for the whole period.
        self.scale, self._found = cycles_per_us(), np.zeros(3 * len(PARTS) + 3)
        self._table = np.array([[self._found.ctypes.data, self._found.size, 1]], np.int64)
        own, longest = world.state.parts, LONGEST * 1e6 * self.scale
        calls = {
            "solve_stage": (solver.STAGE, solver._call_stage), "restart": (solver.RESTART, solver._call_restart),
            "advance": (solver.ADVANCE, solver._call_advance),
            **dict.fromkeys(("consistent_rates", "stage_rates", "jump_rates"), (solver.RATES, solver._call_rates)),
        }  # fmt: skip
        self._parts = own.copy()
        for k, name in enumerate(Parts._fields):
            if name in ROWS:
                signature, call = calls.get(name, (PART, call_part))
                self._parts[k] = _timed(int(own[k]), signature, call, int(self._table.ctypes.data), k, longest)
        world.packed.table[STATE.parts, 0] = self._parts.ctypes.data
        self.period = _timed_period(int(self._table.ctypes.data), len(PARTS), longest)
        """In place of `run_period`."""

    def reset(self) -> None:
        """Begin anew."""
        self._found[:] = 0.0

    @property
    def period_us(self) -> float:
        """Mean time of a compiled period [us]."""
        calls, spent, _ = self._found[-3:]
        return float(spent / calls / self.scale)

    def parts(self, periods: int) -> list[Part]:
        """A row a part, what it calls in turn taken off."""
        counts = self._found.reshape(-1, 3)[:-1]
        mean = {n: c[1] / c[0] / self.scale if c[0] else 0.0 for n, c in zip(Parts._fields, counts, strict=True)}
        calls = {n: (c[0] + c[2]) / periods for n, c in zip(Parts._fields, counts, strict=True)}
        rows = []
        for name, what in ROWS.items():
            inside = sum(calls[n] * mean[n] for n in WITHIN.get(name, ()))
            if calls[name] >= 1e-3:
                rows.append(Part(what, calls[name], mean[name] - inside / calls[name]))
        return rows


@njit(error_model="numpy")
def _read(w):  # noqa: ANN001, ANN202
    control_period.read(w)


@njit(error_model="numpy")
def _show(w):  # noqa: ANN001, ANN202
    observe(w, False)
    control_period.judge(w)


@njit(error_model="numpy")
def _command(w):  # noqa: ANN001, ANN202
    control_period.set_commands(w)
    control_period.set_excitations(w)
    ints(inner(w, WORLD.patient), PATIENT_TABLES.ticks)[0] -= 1


def _loop(function: Any, table: np.ndarray, repeats: int) -> float:
    """CPU us of a call."""

    @njit(error_model="numpy")
    def drive(w, n):  # noqa: ANN001, ANN202
        for _ in range(n):
            function(w)

    drive(table, 10)
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        drive(table, 2000)
        times.append((time.process_time() - begin) / 2000 * 1e6)
    return statistics.median(times)


def actions_of(name: str, steps: int) -> np.ndarray:
    """Actions around those of a policy, shape (steps, 2)."""
    return np.clip(ENVS[name][2] + 0.1 * np.random.default_rng(0).standard_normal((steps, 2)), -1.0, 1.0)


def run(env: AssistanceEnv, actions: np.ndarray) -> float:
    """CPU us of a step; resets are not timed."""
    total = 0.0
    env.reset(seed=0)
    for action in actions:
        begin = time.process_time()
        *_, terminated, truncated, _ = env.step(action)
        total += time.process_time() - begin
        if terminated or truncated:
            env.reset()
    return total / len(actions) * 1e6


def profile(name: str, steps: int, repeats: int) -> tuple[list[Part], float]:
    """Rows of one environment, and env.step as a whole [us]."""
    kind, mode, _ = ENVS[name]
    env, actions = kind(action_mode=mode), actions_of(name, steps)
    run(env, actions[: steps // 4])
    whole, table = statistics.median(run(env, actions) for _ in range(repeats)), env.world.packed.table
    around = [
        Part("commands of drive and patient", 1.0, _loop(_command, table, repeats)),
        Part("sensors and readings", 1.0, _loop(_read, table, repeats)),
        Part("observation and reward", 1.0, _loop(_show, table, repeats)),
    ]
    env.reset(seed=0)
    counters, period = Counters(env.world.dynamics), base_env.run_period
    try:
        base_env.run_period = counters.period
        run(env, actions[: steps // 4])
        counters.reset()
        # The whole run again, resets included, whose few calls of the solver hardly count.
        counted = run(env, actions)
    finally:
        base_env.run_period = period
    parts, compiled = counters.parts(steps), counters.period_us
    cold = compiled - sum(r.us for r in parts) - sum(r.us for r in around)
    return [
        Part("Python around the compiled period", 1.0, counted - compiled), *around,
        Part("what these take longer within a step", 1.0, cold), *parts,
    ], whole  # fmt: skip


def main(arguments: list[str] | None = None) -> None:
    """Print a table an environment."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--env", nargs="+", choices=list(ENVS), default=list(ENVS), help="environments")
    parser.add_argument("--steps", type=int, default=3000, help="control periods of a timing")
    parser.add_argument("--repeats", type=int, default=5, help="of each timing; the median counts")
    parser.add_argument("--out", type=Path, help="a CSV of all rows")
    given = parser.parse_args(arguments)
    lines: list[tuple[Any, ...]] = []
    for name in given.env:
        rows, whole = profile(name, given.steps, given.repeats)
        rows += [Part("sum of these", 1.0, sum(r.us for r in rows)), Part("env.step as a whole", 1.0, whole)]
        print(f"{name}\n{'':56} {'calls':>7} {'us each':>8} {'us':>8}")
        for r in rows:
            print(f"{r.what:56} {r.calls:7.2f} {r.each:8.2f} {r.us:8.2f}", flush=True)
            lines.append((name, r.what, r.calls, r.each, r.us))
    if given.out:
        csv_file.write(given.out, ("environment", "what", "calls_a_period", "us_each", "us_a_period"), lines)


if __name__ == "__main__":
    main()

"""The arrays that the derivative of a step lives in, as NamedTuples that are packed for compiled code.

Columns of tangents are rows of these arrays, so that each lies in one piece: dq[k] is column k, of shape (n_q,).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import Direction
from dms_core.assembly.model import Model
from dms_core.assembly.pattern.sparsity import BlockPattern, block_pattern
from dms_core.assembly.tables import Calls, Tables, Work
from dms_core.compiled.arena import Packed, fields
from dms_core.compiled.entries import Slopes
from dms_core.linear.lu import storage


class StageDerivatives(NamedTuple):
    """One implicit stage at its converged point: its factorised matrix, and what multiplies the right-hand sides."""

    factors: np.ndarray
    """Of the scaled Newton matrix there (sparsity.py)."""
    by_a: np.ndarray
    """Entries of r2 by vdot."""
    by_mu: np.ndarray
    """Entries of (phi_q^T mu)_q, which the Newton matrix leaves out."""
    r2_u: np.ndarray
    """r2 by each input's value, rate and second derivative, shape (3 n_u, n_q + 7)."""
    r3_u: np.ndarray
    """Shape (3 n_u, n_phi)."""
    r4_u: np.ndarray
    r_p: np.ndarray
    """(r1, r2) of all coordinates, (r3, r4) of all rows by each declared number, shape (n_p, 2 n_q + 2 n_phi)."""
    sweeps: np.ndarray
    """Repeated solves that make up for what the Newton matrix leaves out, (1,)."""


class Numbers(NamedTuple):
    """Places in `Differentials.numbers`: coefficients of the step that was differentiated."""

    kind: int
    """A place in `Kind`."""
    h: int
    c0: int
    by_q: int
    """BDF2: cq by q_n and by q_(n-1)."""
    by_before: int
    close: int
    """Relative distance to a converged stage up to which a matrix is taken there. A correction with it leaves the
    square of that; derivatives err by about as much."""
    known: int
    """1 where `end_q` and `end_v` hold the end of the step, as it was recorded."""
    state_only: int
    """1 where the end of the step is asked for, and no derivative."""


class Kind(NamedTuple):
    """How a step is made of stages."""

    sdirk2: int
    bdf2: int


class Movement(NamedTuple):
    """A declared number p moved to both sides; `moving` of these calls are the ones that it moves."""

    high_dynamics: Calls
    high_constraints: Calls
    low_dynamics: Calls
    low_constraints: Calls
    step: np.ndarray
    """h of the difference, (1,)."""


class Differentials(NamedTuple):
    """What the derivative of a step is computed with and written into; one world at a time."""

    pattern: BlockPattern
    a_rows: np.ndarray
    a_columns: np.ndarray
    mu_rows: np.ndarray
    mu_columns: np.ndarray
    kernels: np.ndarray
    """Addresses of the input kernels of all dynamic calls, 0 where there is none."""
    reading: np.ndarray
    """Dynamic calls that read an input."""
    driven: np.ndarray
    """Constraint calls that read an input."""
    slopes: Slopes
    scratch: np.ndarray
    """Derivatives of one constraint by its inputs, (2 rows + 1, most inputs) and arrays of that call."""
    movements: np.ndarray
    """Addresses of packed `Movement`s, (n_p,)."""
    first: StageDerivatives
    second: StageDerivatives
    """The one that ends the step; of BDF2 the only one."""
    numbers: np.ndarray
    b: np.ndarray
    r: np.ndarray
    x: np.ndarray
    work: np.ndarray
    full: np.ndarray
    """(n_q,)."""
    more: np.ndarray
    """(n_q,)."""
    end_q: np.ndarray
    """Where the step is known to end, if numbers[NUMBERS.known] is 1: its stages follow."""
    end_v: np.ndarray


class Columns(NamedTuple):
    """Tangents carried through steps; k counts columns."""

    dq: np.ndarray
    """At the present end, shape (k, n_q)."""
    dv: np.ndarray
    dq_before: np.ndarray
    """One step before, for BDF2."""
    dv_before: np.ndarray
    dlam: np.ndarray
    """Of the last stage, shape (k, n_phi)."""
    du: np.ndarray
    """Value, rate and second derivative of each input that the column moves: of the first stage in rows 0 to k - 1, of
    the second behind them, shape (2 k, 3 n_u). A step of BDF2 reads the second."""
    parameter: np.ndarray
    """Declared number that the column moves, a row of r_p; -1 for none."""
    cq: np.ndarray
    cv: np.ndarray
    stage_q: np.ndarray
    stage_v: np.ndarray


class Adjoints(NamedTuple):
    """Derivatives of outputs, carried back through steps; k counts outputs."""

    aq: np.ndarray
    """Of each output by q at the present end, shape (k, n_q)."""
    av: np.ndarray
    aq_before: np.ndarray
    """By q one step before, from steps of BDF2 that reach over the present one."""
    av_before: np.ndarray
    au: np.ndarray
    """By a shift of each input's value, rate and second derivative, summed over steps, shape (k, 3 n_u)."""
    ap: np.ndarray
    """By each declared number, summed, shape (k, n_p)."""
    cq: np.ndarray
    cv: np.ndarray


STAGE, NUMBERS, MOVEMENT = fields(StageDerivatives), fields(Numbers), fields(Movement)
DIFFERENTIALS, COLUMNS, ADJOINTS, KIND = fields(Differentials), fields(Columns), fields(Adjoints), fields(Kind)


def _touched(calls: Calls, change: np.ndarray) -> np.ndarray:
    """Those of the moving calls whose numbers change."""
    ptr = calls.par_ptr
    return np.array([e for e in calls.moving if change[ptr[e] : ptr[e + 1]].any()], np.int64)


def new_movement(tables: Tables, direction: Direction) -> Packed:
    """A packed Movement of one declared number for the numbers that these tables hold now."""

    def moved(sign: float, calls: Calls, change: np.ndarray) -> Calls:
        return calls._replace(par=calls.par + sign * change, moving=_touched(calls, change))

    return Packed(Movement(
        moved(1.0, tables.dynamics, direction.dynamics), moved(1.0, tables.constraints, direction.constraints),
        moved(-1.0, tables.dynamics, direction.dynamics), moved(-1.0, tables.constraints, direction.constraints),
        np.array([direction.step]),
    ))  # fmt: skip


CLOSE, CLOSEST = 1e-8, 1e-12
"""`Numbers.close` for single steps, and for whole runs, along which the errors of thousands of steps add up."""


def new_differentials(
    model: Model, tables: Tables, work: Work, movements: Sequence[Packed] = (), close: float = CLOSE
) -> Packed:
    """Packed Differentials of one world: for the rows and orders of its tables, with the local arrays of its Work.

    Args:
        model: a compiled model.
        tables: those that the world is solved with.
        work: work arrays of the world's state, `State.w`.
        movements: declared numbers, packed Movements; they must be kept alive.
        close: see `Numbers.close`.
    """
    pattern, slots = block_pattern(model.layout)
    a, mu = slots["a"].coordinates(), slots["mu"].coordinates()
    n, m, n_u = model.n_q, model.n_phi, len(model.layout.input_index)
    size, lu = 2 * len(tables.free) + 2 * len(tables.active), tables.newton_lu
    known = model.derivatives.inputs
    local, k = len(work.q_l), len(work.u_l)

    def stage() -> StageDerivatives:
        return StageDerivatives(
            storage(lu.size), np.zeros(len(a[0]) + 1), np.zeros(len(mu[0]) + 1), np.zeros((3 * n_u, n + 7)),
            np.zeros((3 * n_u, m)), np.zeros((3 * n_u, m)), np.zeros((len(movements), 2 * n + 2 * m)),
            np.zeros(1, np.int64),
        )  # fmt: skip

    rows, most = len(work.phi_l), max(k, len(work.phi_l))
    numbers = np.zeros(len(NUMBERS))
    numbers[NUMBERS.close] = close
    vectors = {name: np.zeros(size) for name in ("b", "r", "x")}
    return Packed(Differentials(
        pattern, a_rows=a[0], a_columns=a[1], mu_rows=mu[0], mu_columns=mu[1], kernels=known.kernels,
        reading=np.array(known.dynamics, np.int64), driven=np.array(known.constraints, np.int64),
        slopes=Slopes(work.q_l, work.v_l, work.a_l, work.u_l, np.zeros((local, 3 * k)), np.zeros((local, 1))),
        scratch=np.zeros((2 * rows + 4, most)),
        movements=np.array([p.table.ctypes.data for p in movements], np.int64), first=stage(), second=stage(),
        numbers=numbers, **vectors, work=storage(lu.work_size), full=np.zeros(n), more=np.zeros(n),
        end_q=np.zeros(n), end_v=np.zeros(n),
    ))  # fmt: skip


def new_columns(model: Model, count: int) -> Packed:
    """Packed Columns, all zero, none of them of a declared number."""
    n_u = len(model.layout.input_index)
    by_coordinate = [name for name in Columns._fields if name not in ("dlam", "du", "parameter")]
    return Packed(Columns(
        **{name: np.zeros((count, model.n_q)) for name in by_coordinate}, dlam=np.zeros((count, model.n_phi)),
        du=np.zeros((2 * count, 3 * n_u)), parameter=np.full(count, -1, np.int64),
    ))  # fmt: skip


def new_adjoints(model: Model, count: int, numbers: int) -> Packed:
    """Packed Adjoints of that many outputs by that many declared numbers, all zero."""
    n_u = len(model.layout.input_index)
    by_coordinate = [name for name in Adjoints._fields if name not in ("au", "ap")]
    return Packed(Adjoints(
        **{name: np.zeros((count, model.n_q)) for name in by_coordinate}, au=np.zeros((count, 3 * n_u)),
        ap=np.zeros((count, numbers)),
    ))  # fmt: skip

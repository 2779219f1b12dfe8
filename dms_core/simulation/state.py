"""What the solver carries: constant tables of a model, mutable state of one world, options of a run."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.assembly.sparsity import NewtonPattern, RatePattern
from dms_core.assembly.tables import WORK, Calls, Signals, Work
from dms_core.compiled.arena import Packed, fields, floats, inner, ints
from dms_core.compiled.jit import compiled
from dms_core.linear.lu import LuTables, storage

# Entries of State.clock [s, unless said].
T, H_BEFORE, H_BEFORE2, H_WANTED, C0_FACTORED, CONTRACTION, PIVOT, T_INPUTS, WORST = range(9)
# Entries of State.counts.
(STEPS, REJECTED_ERROR, REJECTED_NEWTON, ITERATIONS, FACTORISATIONS, RESTARTS,
 RESTART, STALE, AGE, BEFORE_JUMP, RATES_FACTORED) = range(11)  # fmt: skip
# Entries of State.largest.
PHI, PHI_V, MU, H_LEAST, H_MOST = range(5)


class Tables(NamedTuple):
    """Constants of a compiled model."""

    dynamics: Calls
    constraints: Calls
    sensors: Calls
    newton: NewtonPattern
    newton_lu: LuTables
    rates: RatePattern
    rate_lu: LuTables
    free: np.ndarray
    """Coordinates that are solved for: all but those of welded bodies, (n_free,)."""
    active: np.ndarray
    """Constraint rows that are solved for, (n_active,)."""
    second: np.ndarray
    """True for second-order coordinates, whose vdot appears in their row, (n_q,)."""
    scale_q: np.ndarray
    scale_v: np.ndarray
    driven: int
    """Constraints that read an input: a jump of it opens rows of accelerations."""
    parts: np.ndarray
    """Addresses of the parts of a step, see parts.py."""


class State(NamedTuple):
    """One world. Vectors of the history have length n_q; w holds the values being solved for."""

    w: Work
    signals: Signals
    clock: np.ndarray
    counts: np.ndarray
    largest: np.ndarray
    q: np.ndarray
    v: np.ndarray
    qd: np.ndarray
    """d q/dt of the method at the last accepted time."""
    vd: np.ndarray
    lam: np.ndarray
    mu: np.ndarray
    q_before: np.ndarray
    v_before: np.ndarray
    lam_before: np.ndarray
    cq: np.ndarray
    """qdot = c0 q + cq in the step being solved."""
    cv: np.ndarray
    q_guess: np.ndarray
    v_guess: np.ndarray
    wq: np.ndarray
    """Error weights of q: LOCAL_SHARE (bdf2.py) of atol + rtol |q|."""
    wv: np.ndarray
    newton_values: np.ndarray
    newton_work: np.ndarray
    b: np.ndarray
    x: np.ndarray
    x_before: np.ndarray
    rate_values: np.ndarray
    rate_work: np.ndarray
    rate_b: np.ndarray
    rate_x: np.ndarray


class Options(NamedTuple):
    """Numbers that steer a run, as compiled code sees them; see dynamics.SolverOptions."""

    rtol: float
    atol: float
    """Absolute tolerance of every variable; 0 takes rtol times the nominal size of each."""
    fixed_step: float
    """Step [s]; 0 for error control."""
    h_max: float
    h_min: float
    newton_tol: float
    constraint_tol: float
    max_steps: int
    one_step: int
    """1 for SDIRK2 throughout, 0 for BDF2 behind an SDIRK2 start."""


MODEL, STATE = fields(Tables), fields(State)


def _linear_arrays(tables: Tables) -> dict[str, np.ndarray]:
    """Storage of both linear systems."""
    n, k = len(tables.free), len(tables.active)
    newton, rates = tables.newton_lu, tables.rate_lu
    return {
        "newton_values": storage(newton.size),
        "newton_work": storage(newton.work_size),
        **{name: np.zeros(2 * n + 2 * k) for name in ("b", "x", "x_before")},
        "rate_values": storage(rates.size),
        "rate_work": storage(rates.work_size),
        **{name: np.zeros(n + k) for name in ("rate_b", "rate_x")},
    }


def new_state(tables: Tables, w: Work, signals: Signals, q: np.ndarray, v: np.ndarray) -> Packed:
    """A world at its start: q and v of shape (n_q,)."""
    n, m = len(tables.second), len(w.lam)
    histories = ("q", "v", "qd", "vd", "q_before", "v_before", "cq", "cv", "q_guess", "v_guess", "wq", "wv")
    state = State(
        w=w, signals=signals, clock=np.zeros(9), counts=np.zeros(11, np.int64), largest=np.zeros(5),
        **{name: np.zeros(n) for name in histories}, **{name: np.zeros(m) for name in ("lam", "mu", "lam_before")},
        **_linear_arrays(tables),
    )  # fmt: skip
    packed = Packed(state)
    rewind(packed.table, q, v, 0.0)
    return packed


@compiled
def rewind(s, q, v, step):
    """A packed State back to t = 0, at q and v of shape (n_q,), as if nothing had been computed; inputs stay.

    `step` is tried first [s]; 0 takes a careful one.
    """
    clock, counts, largest = floats(s, STATE.clock), ints(s, STATE.counts), floats(s, STATE.largest)
    w, n = inner(s, STATE.w), q.shape[0]
    clock[:], counts[:], largest[:], floats(s, STATE.vd)[:] = 0.0, 0, 0.0, 0.0
    floats(s, STATE.lam)[:], floats(s, STATE.mu)[:], floats(s, STATE.lam_before)[:] = 0.0, 0.0, 0.0
    floats(w, WORK.lam)[:], floats(w, WORK.mu)[:] = 0.0, 0.0
    counts[RESTART], counts[STALE] = 1, 1
    largest[H_LEAST], clock[H_WANTED] = math.inf, step
    floats(s, STATE.q)[:], floats(s, STATE.q_before)[:], floats(w, WORK.q)[:n] = q, q, q
    floats(s, STATE.v)[:], floats(s, STATE.qd)[:], floats(s, STATE.v_before)[:], floats(w, WORK.v)[:n] = v, v, v, v


def with_tables(tables: Tables, state: State) -> Packed:
    """The same world for other rows and elimination orders: it starts afresh, with multipliers 0 as their guess."""
    state.counts[RESTART] = state.counts[STALE] = 1
    state.counts[RATES_FACTORED] = 0
    state.lam[:], state.mu[:] = 0.0, 0.0
    state.w.lam[:], state.w.mu[:] = 0.0, 0.0
    return Packed(State(**{**state._asdict(), **_linear_arrays(tables)}))

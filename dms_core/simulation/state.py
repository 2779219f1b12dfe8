"""What the solver carries: the mutable state of one world and the options of a run.

Three letters stand for the arguments of compiled functions all over this package:

    m    the model: a packed `Tables` (assembly/tables.py), constant, shared by all worlds of a model
    s    the world: a packed `State`, which everything that a step computes is written into
    o    an `Options` tuple: the numbers that steer a run

A field is looked up by name, and so is a place in one of the arrays of single numbers:

    clock = floats(s, STATE.clock)          t = clock[CLOCK.t]
    counts = ints(s, STATE.counts)          counts[COUNTS.steps] += 1
    free = naturals(m, MODEL.free)          q = floats(inner(s, STATE.w), WORK.q)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dms_core.assembly.tables import WORK, Signals, Tables, Work
from dms_core.compiled.arena import Packed, fields, floats, inner, ints
from dms_core.compiled.jit import compiled
from dms_core.linear.lu import storage
from dms_core.simulation.methods.radau_state import NOT_USED, new_radau_state


class Clock(NamedTuple):
    """Places in `State.clock` [s, unless said]."""

    t: int
    """Time reached."""
    h_before: int
    """Size of the last step."""
    h_before2: int
    """Size of the step before that one; 0 behind a start."""
    h_wanted: int
    """Size that the next step should have."""
    c0_factored: int
    """c0 of the factorised Newton matrix [1/s]."""
    contraction: int
    """Contraction that Newton's method showed last with that matrix [-]."""
    pivot: int
    """Smallest relative pivot of the last factorisation [-]."""
    t_inputs: int
    """Time at which inputs are evaluated."""
    worst: int
    """Largest local error over its tolerance since the last landing [-]."""
    best_pivot: int
    """Largest of the relative pivots of the Newton matrix since its order of elimination was chosen [-]."""
    singular_pivot: int
    """Relative pivot below which the position is known to be nearly singular; 0 where it is regular [-]."""
    landed: int
    """Time of the last landing."""


class Counts(NamedTuple):
    """Places in `State.counts`: what a run reports, then flags (1: true)."""

    steps: int
    rejected_error: int
    rejected_newton: int
    iterations: int
    factorisations: int
    restarts: int
    restart: int
    """The method starts afresh with the next step."""
    stale: int
    """The factorised Newton matrix is to be renewed."""
    age: int
    """Stages solved with it."""
    before_jump: int
    """Inputs are taken from the left of a jump."""
    rates_factored: int
    """The factorised matrix of the acceleration problem belongs to the present q and v."""


class Largest(NamedTuple):
    """Places in `State.largest`: extremes over a run, see `SolveStats`."""

    phi: int
    phi_v: int
    mu: int
    h_least: int
    h_most: int


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
    """Error weights of q: LOCAL_SHARE (implicit_stage.py) of atol + rtol |q|."""
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
    parts: np.ndarray
    """Addresses of the parts of a step, see parts.py."""
    radau: Packed
    """A packed RadauState, what Radau IIA carries beside; its arrays are empty where another method runs."""


class Method(NamedTuple):
    """Methods of integration."""

    bdf2: int
    """Behind a start by SDIRK2."""
    sdirk2: int
    radau5: int


class Options(NamedTuple):
    """Numbers that steer a run, as compiled code sees them; see options.SolverOptions."""

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
    method: int
    """A place in `Method`."""


STATE, CLOCK, COUNTS, LARGEST = fields(State), fields(Clock), fields(Counts), fields(Largest)
METHOD = fields(Method)


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


def new_state(
    tables: Tables, w: Work, signals: Signals, parts: np.ndarray, q: np.ndarray, v: np.ndarray, radau: bool = False
) -> Packed:
    """A world at its start: q and v of shape (n_q,); `parts` from `addresses.part_addresses`; `radau`: for radau5."""
    n, m = len(tables.second), len(w.lam)
    histories = ("q", "v", "qd", "vd", "q_before", "v_before", "cq", "cv", "q_guess", "v_guess", "wq", "wv")
    state = State(
        w=w, signals=signals, clock=np.zeros(len(CLOCK)),
        counts=np.zeros(len(COUNTS), np.int64), largest=np.zeros(len(LARGEST)), parts=parts,
        **{name: np.zeros(n) for name in histories}, **{name: np.zeros(m) for name in ("lam", "mu", "lam_before")},
        **_linear_arrays(tables), radau=new_radau_state(tables, m, radau),
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
    counts[COUNTS.restart], counts[COUNTS.stale] = 1, 1
    largest[LARGEST.h_least], clock[CLOCK.h_wanted] = math.inf, step
    q_s, q_before, q_w = floats(s, STATE.q), floats(s, STATE.q_before), floats(w, WORK.q)
    v_s, qd, v_before, v_w = floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.v_before), floats(w, WORK.v)
    # A loop: numba compiles the copy of an array to an array with all that it takes if they overlap.
    for i in range(n):
        q_s[i] = q_before[i] = q_w[i] = q[i]
        v_s[i] = qd[i] = v_before[i] = v_w[i] = v[i]


@compiled
def begin_matrix(s, c0):
    """Say that the Newton matrix is factorised anew, for this c0 [1/s]: nothing is known of how it contracts."""
    clock, counts = floats(s, STATE.clock), ints(s, STATE.counts)
    clock[CLOCK.c0_factored], clock[CLOCK.contraction] = c0, 0.0
    counts[COUNTS.factorisations] += 1
    counts[COUNTS.stale] = counts[COUNTS.age] = 0


@compiled
def renumber(s):
    """Say that numbers of the model have changed, such as a mass: the next step begins with their rates and factors."""
    counts = ints(s, STATE.counts)
    counts[COUNTS.restart], counts[COUNTS.stale], counts[COUNTS.rates_factored] = 1, 1, 0


def with_storage(tables: Tables, state: State) -> Packed:
    """The same world with fresh storage for other rows and elimination orders; nothing is written into its arrays."""
    radau = new_radau_state(tables, len(state.lam), state.radau is not NOT_USED)
    return Packed(State(**{**state._asdict(), **_linear_arrays(tables), "radau": radau}))


def with_tables(tables: Tables, state: State) -> Packed:
    """The same world, in the same motion, for other rows and elimination orders; multipliers are the caller's."""
    state.counts[COUNTS.stale], state.counts[COUNTS.rates_factored] = 1, 0
    state.clock[CLOCK.best_pivot] = state.clock[CLOCK.singular_pivot] = 0.0
    if state.radau is not NOT_USED:
        # Its last step's polynomial belongs to the rows that were; the next step begins without one.
        state.counts[COUNTS.restart] = 1
    return with_storage(tables, state)

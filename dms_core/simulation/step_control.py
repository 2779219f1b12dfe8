"""The loop over steps: size, acceptance, jumps of the inputs, recording.

The next size is 0.9 err^(-1/3) h (order 2), lowered when Newton needed many iterations (paper sect. 2.3; the formula
is that of Hairer and Wanner 1996, IV.8), and left alone when it would grow by less than a fifth: an unchanged step
keeps the factorised matrix good. Where all coordinates are of second order, BDF2 takes the next smaller size of a grid,
1.4^k, instead. There motions may be reversible, as that of a body that tumbles, and BDF2's leading error then cancels
if steps depend on the state and not on the way there, but not if they grow late and shrink at once. Radau IIA has a
rule of its own (radau5.py).
"""

import math
from typing import NamedTuple

from dms_core.assembly.tables import MODEL, SIGNALS, WORK
from dms_core.compiled.arena import fields, flags, floats, inner, ints, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.implicit_stage import set_weights
from dms_core.simulation.iteration.newton import MAX_ITERATIONS, NEWTON, note_errors
from dms_core.simulation.iteration.order_watch import (
    may_be_singular,
    nearly_singular,
    ordered_for_another_size,
    pivots_weaken,
)
from dms_core.simulation.iteration.parts import PARTS, run_radau5, run_rates, set_inputs
from dms_core.simulation.methods.bdf2 import bdf2_step
from dms_core.simulation.methods.radau_constants import ORDER_OF_ERROR, REAL
from dms_core.simulation.methods.radau_state import CONTROL, RADAU
from dms_core.simulation.methods.sdirk2 import GAMMA, sdirk2_step
from dms_core.simulation.state import CLOCK, COUNTS, LARGEST, METHOD, STATE


class Outcome(NamedTuple):
    """How `advance` ended; results.Result gives each its sentence."""

    done: int
    buffer_full: int
    step_too_small: int
    newton_failed: int
    matrix_singular: int
    """The Newton matrix is singular, or will be soon, in the present order of elimination: another one may do."""
    too_many_steps: int
    rates_failed: int


OUTCOME = fields(Outcome)

SAFETY, SHRINK, GROW = 0.9, 0.2, 2.0
DEAD_ZONE = 1.2
"""Growth up to which a step is left alone."""
GRID, GRID_SAFETY = math.log(1.4), 0.99
"""Logarithm of the ratio of neighbouring sizes on the grid; on average a step is a sixth below what is allowed."""
LONGEST_START = 1e-3
"""Largest first step of a run [s]: at rest nothing tells yet how soon an input will move."""
HELP = 3
"""Failed attempts at a step after which order and position are looked at."""
LEAPS = (1.5, 2.3, 3.1, 4.2)
"""Longer steps, over the one that failed, that are tried across a singular position."""
SINGULAR_ERROR = 100.0
"""Local error, over what a step may make, that counts as rounding beside a singular position."""
KEEPING = 0.5
"""Local error at which a step keeps its size: rounding beside a singular position says nothing about the next size."""
NEAR = 32
"""Steps to a landing from which on those of SDIRK2 are of one size; farther off the size follows the error."""


@compiled
def next_stop(s, t_end):
    """The next time a step must end on: a jump of an input or the end."""
    t, jumps = floats(s, STATE.clock)[CLOCK.t], floats(inner(s, STATE.signals), SIGNALS.jumps)
    for k in range(jumps.shape[0]):
        if jumps[k] > t:
            return min(t_end, jumps[k])
    return t_end


@compiled
def first_step(s, o):
    """A careful first size: accelerations move no coordinate by more than a tenth of its weight."""
    vd, wq, fastest = floats(s, STATE.vd), floats(s, STATE.wq), 0.0
    for i in range(wq.shape[0]):
        fastest = max(fastest, abs(vd[i]) / wq[i])
    return min(math.sqrt(0.2 / fastest), o.h_max, LONGEST_START) if fastest > 0.0 else min(o.h_max, LONGEST_START)


@compiled
def record_point(s, record, k):
    """Row k of the record: t, q, v, vdot, lam, mu."""
    q, v, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.vd)
    lam, mu = floats(s, STATE.lam), floats(s, STATE.mu)
    n, m = q.shape[0], lam.shape[0]
    record[k, 0] = floats(s, STATE.clock)[CLOCK.t]
    for i in range(n):
        record[k, 1 + i] = q[i]
        record[k, 1 + n + i] = v[i]
        record[k, 1 + 2 * n + i] = vd[i]
    for i in range(m):
        record[k, 1 + 3 * n + i] = lam[i]
        record[k, 1 + 3 * n + m + i] = mu[i]


@compiled
def accept(s, h, c0, started):
    """Take over the solved step: history, derivatives of the method, clock."""
    w, clock, largest = inner(s, STATE.w), floats(s, STATE.clock), floats(s, STATE.largest)
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q_before, v_before, cq, cv = (
        floats(s, STATE.q_before), floats(s, STATE.v_before), floats(s, STATE.cq), floats(s, STATE.cv),
    )  # fmt: skip
    q_new, v_new = floats(w, WORK.q), floats(w, WORK.v)
    for i in range(q.shape[0]):
        q_before[i], v_before[i] = q[i], v[i]
        q[i], v[i] = q_new[i], v_new[i]
        qd[i] = c0 * q[i] + cq[i]
        vd[i] = c0 * v[i] + cv[i]
    lam, mu, lam_before = floats(s, STATE.lam), floats(s, STATE.mu), floats(s, STATE.lam_before)
    lam_new, mu_new = floats(w, WORK.lam), floats(w, WORK.mu)
    for k in range(lam.shape[0]):
        lam_before[k] = lam[k]
        lam[k], mu[k] = lam_new[k], mu_new[k]
    clock[CLOCK.t] += h
    clock[CLOCK.h_before2] = 0.0 if started else clock[CLOCK.h_before]
    clock[CLOCK.h_before] = h
    largest[LARGEST.h_least] = min(largest[LARGEST.h_least], h)
    largest[LARGEST.h_most] = max(largest[LARGEST.h_most], h)
    ints(s, STATE.counts)[COUNTS.steps] += 1
    ints(s, STATE.counts)[COUNTS.restart] = 0
    ints(s, STATE.counts)[COUNTS.rates_factored] = 0


@compiled
def restart_method(m, s, o):
    """Values just behind a jump: inputs from the right, consistent rates and multipliers; False if there are none."""
    clock = floats(s, STATE.clock)
    set_inputs(m, s, clock[CLOCK.t], False)
    ints(s, STATE.counts)[COUNTS.restarts] += 1
    clock[CLOCK.worst] = 0.0
    if not (o.method == METHOD.sdirk2 and run_rates(m, s, PARTS.jump_rates, 0.0)) and not run_rates(
        m, s, PARTS.consistent_rates, 0.0
    ):
        return False
    set_weights(m, s, o)
    if clock[CLOCK.h_wanted] <= 0.0:
        clock[CLOCK.h_wanted] = first_step(s, o)
    return True


@compiled
def landing_size(h, rest, fixed, equal):
    """h shortened so that a step ends after `rest`, without leaving a sliver; `equal`: in steps of one size."""
    if h >= rest * (1.0 - 1e-9):
        return rest
    if equal:
        return rest / math.ceil(rest / h * (1.0 - 1e-9))
    return 0.5 * rest if h > 0.55 * rest and not fixed else h


@compiled
def try_step(m, s, o, h, started):
    """One attempt; gives (code, iterations per stage, error, c0)."""
    if o.method == METHOD.radau5:
        code, iterations, error = run_radau5(m, s, o, h)
        return code, 1.0 * iterations, error, REAL / h
    if started:
        code, iterations, error = sdirk2_step(m, s, o, h)
        return code, 0.5 * iterations, error, 1.0 / (GAMMA * h)
    ratio = h / floats(s, STATE.clock)[CLOCK.h_before]
    code, iterations, error = bdf2_step(m, s, o, h)
    return code, 1.0 * iterations, error, (1.0 + 2.0 * ratio) / (1.0 + ratio) / h


@compiled
def growth(error, iterations, safety):
    """Next step size over the last, from the error and the Newton count."""
    effort = (2.0 * MAX_ITERATIONS + 1.0) / (2.0 * MAX_ITERATIONS + iterations)
    factor = GROW if error <= 0.0 else safety * effort * error ** (-1.0 / 3.0)
    return min(GROW, max(SHRINK, factor))


@compiled
def resize(h, error, iterations):
    """The next step size, h where it would hardly grow."""
    factor = growth(error, iterations, SAFETY)
    return h if 1.0 <= factor < DEAD_ZONE else h * factor


@compiled
def all_of_second_order(m):
    """Whether no coordinate that is solved for is of first order."""
    second = flags(m, MODEL.second)
    for i in naturals(m, MODEL.free):
        if not second[i]:
            return False
    return True


@compiled
def size_behind(m, s, o, h, error, iterations):
    """Size that the step behind an accepted one should have."""
    if o.method == METHOD.radau5:
        return floats(inner(s, STATE.radau), RADAU.control)[CONTROL.wanted]
    if o.method == METHOD.bdf2 and all_of_second_order(m):
        # A size that is on the grid but for rounding stays.
        place = math.log(h * growth(error, iterations, GRID_SAFETY)) / GRID
        return math.exp(GRID * math.floor(place + 1e-9))
    return resize(h, error, iterations)


@compiled
def find_rates(m, s, o, c0):
    """Accelerations and multipliers that belong to q and v behind a step; False if there are none.

    Those of a stage are of order 1 (Radau IIA: 3) only. With c0 > 0 the matrix of the next step is made with them.
    """
    if o.method != METHOD.bdf2 and run_rates(m, s, PARTS.stage_rates, c0):
        return True
    # Those of Radau IIA's last stage, of order 3, stand in where a kink of a fibre leaves none for its q and v.
    return run_rates(m, s, PARTS.consistent_rates, 0.0) or o.method == METHOD.radau5


@compiled
def wants_another_order(m, s, o, code, failures):
    """Whether an attempt failed in a way that another order of elimination, or another position, may mend."""
    fixed = o.fixed_step > 0.0
    if code != NEWTON.converged and (fixed or failures > 1) and ordered_for_another_size(m, s):
        return True
    return failures == HELP and not fixed and may_be_singular(m, s)


@compiled
def size_behind_failure(s, o, h, code, error):
    """Count a failed attempt; gives the size of the next one, from what was wrong."""
    count = ints(s, STATE.counts)
    if code == NEWTON.converged:
        count[COUNTS.rejected_error] += 1
        power = -1.0 / ORDER_OF_ERROR if o.method == METHOD.radau5 else -1.0 / 3.0
        return h * max(SHRINK, min(0.9, SAFETY * error**power))
    count[COUNTS.rejected_newton] += 1
    count[COUNTS.stale] = 1
    return h * (0.5 if o.method == METHOD.radau5 else 0.25)


@compiled
def find_slopes_anew(m, s):
    """Rates where a step begins; False if there are none.

    Slopes of the step before are as good as its tolerance only; a shorter step from them starts no better.
    """
    set_inputs(m, s, floats(s, STATE.clock)[CLOCK.t], False)
    return run_rates(m, s, PARTS.consistent_rates, 0.0)


@compiled
def find_rates_behind(m, s, o, started, stop, landed, kept):
    """Rates behind an accepted step, where somebody asks for them, and a landing's clock; False if there are none."""
    c0 = land(s, o, stop) if landed else 0.0
    # Methods without a past want rates between two landings only for a record.
    wanted_rates = started if o.method == METHOD.bdf2 else kept or landed
    return not wanted_rates or find_rates(m, s, o, c0)


@compiled
def choose_next_size(m, s, o, h, wanted, error, iterations, equal, landed, first_try):
    """Size that the next step is to have, behind a step of size h that was to have had the size `wanted`."""
    clock = floats(s, STATE.clock)
    # A step cut short by a landing says little about the size that the motion allows.
    cut_short = h < wanted and first_try
    if not equal:
        size = size_behind(m, s, o, h, error, iterations)
        clock[CLOCK.h_wanted] = max(size, wanted) if cut_short else size
        return
    clock[CLOCK.worst] = max(clock[CLOCK.worst], error)
    if landed or not first_try:
        clock[CLOCK.h_wanted] = max(resize(h, clock[CLOCK.worst], iterations), wanted if cut_short else 0.0)
        clock[CLOCK.worst] = 0.0


@compiled
def one_step(m, s, o, stop, kept):
    """Attempts until one step is accepted; gives OUTCOME.done or what went wrong. `kept`: the step is recorded."""
    clock, fixed = floats(s, STATE.clock), o.fixed_step > 0.0
    started = ints(s, STATE.counts)[COUNTS.restart] == 1 or o.method == METHOD.sdirk2
    set_weights(m, s, o)
    wanted = o.fixed_step if fixed else min(clock[CLOCK.h_wanted], o.h_max)
    if not fixed and wanted < o.h_min:
        return OUTCOME.step_too_small
    if not started and not fixed and o.method == METHOD.bdf2:
        wanted = min(wanted, GROW * clock[CLOCK.h_before])
    rest = stop - clock[CLOCK.t]
    equal = o.method == METHOD.sdirk2 and not fixed and rest <= NEAR * wanted
    failures, leaps, before_leap = 0, 0, 0.0
    while True:
        h = landing_size(wanted, rest, fixed, equal)
        code, iterations, error, c0 = try_step(m, s, o, h, started)
        if code == NEWTON.singular:
            return OUTCOME.matrix_singular
        # A step of Radau IIA that erred is not finished: nothing of it can be taken.
        passing = nearly_singular(s) and o.method != METHOD.radau5
        if code == NEWTON.converged and (error <= (SINGULAR_ERROR if passing else 1.0) or fixed):
            break
        failures += 1
        if wants_another_order(m, s, o, code, failures):
            clock[CLOCK.h_wanted] = h
            return OUTCOME.matrix_singular
        wanted = size_behind_failure(s, o, h, code, error)
        if code != NEWTON.converged and failures == 1 and o.method == METHOD.sdirk2 and not find_slopes_anew(m, s):
            return OUTCOME.rates_failed
        if not fixed and nearly_singular(s):
            # A shorter step would end no farther from the singular position: one that passes it may do.
            before_leap = before_leap if leaps > 0 else h
            wanted = before_leap * (LEAPS[leaps] if leaps < len(LEAPS) else 0.6)
            leaps = leaps + 1 if leaps < len(LEAPS) else 0
        if fixed or wanted < o.h_min:
            return OUTCOME.step_too_small if code == NEWTON.converged else OUTCOME.newton_failed
    if nearly_singular(s):
        error = min(error, KEEPING)
    note_errors(s)
    accept(s, h, c0, started)
    if not fixed:
        choose_next_size(m, s, o, h, wanted, error, iterations, equal, h == rest, failures == 0)
    return OUTCOME.done if find_rates_behind(m, s, o, started, stop, h == rest, kept) else OUTCOME.rates_failed


@compiled
def land(s, o, stop):
    """Set the clock exactly; behind a jump of an input the method starts afresh.

    Gives c0 of the next steps of SDIRK2, for which a matrix is made where they begin, if the next landing is as far off
    as this one was from the last; 0 for another method.
    """
    clock = floats(s, STATE.clock)
    span, clock[CLOCK.landed], clock[CLOCK.t] = stop - clock[CLOCK.landed], stop, stop
    jumps = floats(inner(s, STATE.signals), SIGNALS.jumps)
    for k in range(jumps.shape[0]):
        if jumps[k] == stop:
            ints(s, STATE.counts)[COUNTS.restart] = 1
    if o.method != METHOD.sdirk2:
        return 0.0
    h = o.fixed_step if o.fixed_step > 0.0 else min(clock[CLOCK.h_wanted], o.h_max)
    return 1.0 / (GAMMA * landing_size(h, span, o.fixed_step > 0.0, o.fixed_step <= 0.0 and span <= NEAR * h))


@compiled
def advance_method(m, s, o, t_end, record, recorded):
    """Step until t_end; gives (code, number of rows recorded). OUTCOME.buffer_full asks to be called again with room.

    Nothing is recorded where the record has no rows at all.
    """
    clock, count, kept = floats(s, STATE.clock), ints(s, STATE.counts), record.shape[0] > 0
    while clock[CLOCK.t] < t_end:
        if kept and recorded + 2 > record.shape[0]:
            return OUTCOME.buffer_full, recorded
        if count[COUNTS.steps] >= o.max_steps:
            return OUTCOME.too_many_steps, recorded
        if pivots_weaken(m, s):
            return OUTCOME.matrix_singular, recorded
        if count[COUNTS.restart] == 1:
            if not restart_method(m, s, o):
                return OUTCOME.rates_failed, recorded
            if kept:
                record_point(s, record, recorded)
                recorded += 1
        code = one_step(m, s, o, next_stop(s, t_end), kept)
        if code != OUTCOME.done:
            return code, recorded
        if kept:
            record_point(s, record, recorded)
            recorded += 1
    return OUTCOME.done, recorded

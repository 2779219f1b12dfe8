"""One implicit stage qdot = c0 q + cq, vdot = c0 v + cv of any method: error weights, guess, solution.

A step of BDF2 has one stage, one of SDIRK2 has two.
"""

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner, ints, naturals
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.newton import NEWTON, newton
from dms_core.simulation.iteration.parts import set_inputs
from dms_core.simulation.state import COUNTS, METHOD, STATE

LOCAL_SHARE = 0.1
"""Share of the tolerance that one step may use up: the errors of hundreds of steps add up."""
COARSEST_RATE = 0.01
"""Largest weight of a first-order rate, relative to its size."""
MAX_AGE = 30
"""Stages after which a factorised matrix is renewed, however well it still contracts."""


@compiled
def set_weights(m, s, o):
    """Error weights, a share of atol + rtol |y|, from the last accepted values.

    Rates of first-order coordinates add nothing to the error of a step: Newton's method alone looks at them. Their
    weight is the whole of that sum, but fine enough for what they enter, such as the curve of force and velocity.

    Radau IIA estimates its error by a formula of order 3 and errs much less: both tolerances are divided by rtol^(1/3),
    as in RADAU5 (Hairer and Wanner 1996), so that the error of a run falls with rtol as with the other methods.
    """
    looser = o.rtol ** (-1.0 / 3.0) if o.method == METHOD.radau5 else 1.0
    q, v, wq, wv = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.wq), floats(s, STATE.wv)
    scale_q, scale_v, second = floats(m, MODEL.scale_q), floats(m, MODEL.scale_v), flags(m, MODEL.second)
    for i in range(q.shape[0]):
        wq[i] = LOCAL_SHARE * looser * ((o.atol if o.atol > 0.0 else o.rtol * scale_q[i]) + o.rtol * abs(q[i]))
        wv[i] = looser * ((o.atol if o.atol > 0.0 else o.rtol * scale_v[i]) + o.rtol * abs(v[i]))
        wv[i] = LOCAL_SHARE * wv[i] if second[i] else min(wv[i], COARSEST_RATE * (scale_v[i] + abs(v[i])))


@compiled
def put_guess(m, s, c0, lam_slope):
    """The guess into the iterate; first-order coordinates get the v that belongs to their q.

    Coordinates that are not solved for stay: a guess that nothing corrects would run away from rounding errors.
    """
    w, second, cq, free = inner(s, STATE.w), flags(m, MODEL.second), floats(s, STATE.cq), naturals(m, MODEL.free)
    q, v, lam, mu = floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.lam), floats(w, WORK.mu)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    lam_n, lam_before, mu_n = floats(s, STATE.lam), floats(s, STATE.lam_before), floats(s, STATE.mu)
    for i in free:
        q[i] = q_guess[i]
        v[i] = v_guess[i] if second[i] else c0 * q_guess[i] + cq[i]
    for k in range(lam_n.shape[0]):
        lam[k] = lam_n[k] + lam_slope * (lam_n[k] - lam_before[k])
        mu[k] = mu_n[k]


@compiled
def solve_stage(m, s, o, t, c0, lam_slope, last):
    """One implicit stage at time t from the guess; gives (code, iterations). An old matrix is renewed once.

    Only the last stage of a step has to close the constraints.
    """
    count = ints(s, STATE.counts)
    set_inputs(m, s, t, True)
    count[COUNTS.age] += 1
    if count[COUNTS.age] > MAX_AGE:
        count[COUNTS.stale] = 1
    put_guess(m, s, c0, lam_slope)
    code, iterations = newton(m, s, o, c0, last)
    if code == NEWTON.stale_matrix:
        count[COUNTS.stale] = 1
        put_guess(m, s, c0, lam_slope)
        code, more = newton(m, s, o, c0, last)
        iterations += more
        if code == NEWTON.stale_matrix:
            code = NEWTON.diverged
    return code, iterations

"""SDIRK2, a method of one step, and its local error.

The L-stable SDIRK method of order 2 with gamma = 1 - 1/sqrt 2 (Alexander 1977): it needs no past, and its two stages
have the same form qdot = c0 q + cq as that of BDF2. Its error constant is |1/6 - 3 gamma^2 + 2 gamma^3| = 0.0404
h^3 y'''. A run of BDF2, and every jump of an input, starts with it; an environment, whose commands change every few
steps, takes it throughout.
"""

import math

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.newton import NEWTON
from dms_core.simulation.iteration.parts import run_stage
from dms_core.simulation.state import CLOCK, STATE

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
SDIRK_ERROR = 0.0404


@compiled
def prepare_first_stage(s, h, c0):
    """Constants and guess of the stage at GAMMA h."""
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    cq, cv = floats(s, STATE.cq), floats(s, STATE.cv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(q.shape[0]):
        cq[i], cv[i] = -c0 * q[i], -c0 * v[i]
        q_guess[i], v_guess[i] = q[i] + GAMMA * h * qd[i], v[i] + GAMMA * h * vd[i]


@compiled
def prepare_second_stage(s, h, c0):
    """Rates of the first stage; constants and guess of the one at h."""
    w = inner(s, STATE.w)
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q1, v1, cq, cv = floats(w, WORK.q), floats(w, WORK.v), floats(s, STATE.cq), floats(s, STATE.cv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(q.shape[0]):
        kq, kv = c0 * q1[i] + cq[i], c0 * v1[i] + cv[i]
        cq[i] = -c0 * (q[i] + h * (1.0 - GAMMA) * kq)
        cv[i] = -c0 * (v[i] + h * (1.0 - GAMMA) * kv)
        q_guess[i] = q[i] + h * qd[i] + 0.5 * h / GAMMA * (kq - qd[i])
        v_guess[i] = v[i] + h * vd[i] + 0.5 * h / GAMMA * (kv - vd[i])


@compiled
def sdirk2_step(m, s, o, h):
    """One SDIRK2 step of size h into w. Gives (code, iterations, weighted local error)."""
    t, c0 = floats(s, STATE.clock)[CLOCK.t], 1.0 / (GAMMA * h)
    prepare_first_stage(s, h, c0)
    code, first = run_stage(m, s, o, t + GAMMA * h, c0, 0.0, False)
    if code != NEWTON.converged:
        return code, first, 0.0
    prepare_second_stage(s, h, c0)
    code, second = run_stage(m, s, o, t + h, c0, 0.0, True)
    if code != NEWTON.converged:
        return code, first + second, 0.0
    w, is_second, error = inner(s, STATE.w), flags(m, MODEL.second), 0.0
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q1, v1, cq, cv = floats(w, WORK.q), floats(w, WORK.v), floats(s, STATE.cq), floats(s, STATE.cv)
    wq, wv = floats(s, STATE.wq), floats(s, STATE.wv)
    for i in range(q.shape[0]):
        # h^3 y''' of the cubic through both ends and their slopes.
        size = SDIRK_ERROR * abs(6.0 * h * (qd[i] + c0 * q1[i] + cq[i]) - 12.0 * (q1[i] - q[i]))
        if size > error * wq[i]:
            error = size / wq[i]
        if is_second[i]:
            size = SDIRK_ERROR * abs(6.0 * h * (vd[i] + c0 * v1[i] + cv[i]) - 12.0 * (v1[i] - v[i]))
            if size > error * wv[i]:
                error = size / wv[i]
    return code, first + second, error

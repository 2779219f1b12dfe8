"""Variable-step BDF2 and its local error (paper sect. 2.3).

With w = h / h_before:

    ydot ~ [ (1 + 2w)/(1 + w) y - (1 + w) y_n + w^2/(1 + w) y_(n-1) ] / h
    local error  C y''' ,  C = h^3 (1 + w)^2 / (6 w (1 + 2w))

zero-stable for w < 1 + sqrt 2 (Hairer, Norsett, Wanner 1993, III.5). It needs a past, which a step of sdirk2.py makes.
"""

from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import flags, floats, inner
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.newton import NEWTON
from dms_core.simulation.iteration.parts import run_stage
from dms_core.simulation.state import CLOCK, STATE


@compiled
def prepare_bdf2(s, h, h1):
    """Constants cq, cv of the step; its guess, the quadratic through y_n, y_(n-1) and ydot_n, which carries y_(n-2)."""
    q, v, qd, vd = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.qd), floats(s, STATE.vd)
    q_before, v_before = floats(s, STATE.q_before), floats(s, STATE.v_before)
    cq, cv = floats(s, STATE.cq), floats(s, STATE.cv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    ratio = h / h1
    b1, b2 = -(1.0 + ratio) / h, ratio * ratio / (1.0 + ratio) / h
    for i in range(q.shape[0]):
        cq[i] = b1 * q[i] + b2 * q_before[i]
        cv[i] = b1 * v[i] + b2 * v_before[i]
        q_guess[i] = q[i] + h * (qd[i] + ratio * (qd[i] - (q[i] - q_before[i]) / h1))
        v_guess[i] = v[i] + h * (vd[i] + ratio * (vd[i] - (v[i] - v_before[i]) / h1))


@compiled
def bdf2_step(m, s, o, h):
    """One BDF2 step of size h into w. Gives (code, iterations, weighted local error)."""
    clock = floats(s, STATE.clock)
    h1, h2 = clock[CLOCK.h_before], clock[CLOCK.h_before2]
    ratio = h / h1
    prepare_bdf2(s, h, h1)
    code, iterations = run_stage(m, s, o, clock[CLOCK.t] + h, (1.0 + 2.0 * ratio) / (1.0 + ratio) / h, ratio, True)
    if code != NEWTON.converged:
        return code, iterations, 0.0
    C = h**3 * (1.0 + ratio) ** 2 / (6.0 * ratio * (1.0 + 2.0 * ratio))
    # The guess interpolates three past points or, behind a start, two and a slope: its error is P y'''.
    P = h * (h + h1) * (h + h1 + h2) / 6.0 if h2 > 0.0 else h * h * (h + h1) / 6.0
    w, second, error = inner(s, STATE.w), flags(m, MODEL.second), 0.0
    q, v, wq, wv = floats(w, WORK.q), floats(w, WORK.v), floats(s, STATE.wq), floats(s, STATE.wv)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(wq.shape[0]):
        error = max(error, abs(q[i] - q_guess[i]) / wq[i])
        if second[i]:
            error = max(error, abs(v[i] - v_guess[i]) / wv[i])
    return code, iterations, error * C / (C + P)

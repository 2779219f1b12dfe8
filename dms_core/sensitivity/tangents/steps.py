"""A step that is solved, differentiated and accepted; its tangents carried forward and its adjoints carried back.

SDIRK2 takes two stages, with k = c0 (Y1 - y_n) and c0 = 1 / (gamma h):

    Y1:  cy = -c0 y_n                          Y2 = y_(n+1):  cy = -c0 (y_n + h (1 - gamma) k)

and BDF2 one, cy = b1 y_n + b2 y_(n-1). The multipliers and the rates that are kept between steps are no more than a
guess for the next step's iteration, so that they are no part of the map. Nor are first-order rates, which their own
equations give at each stage. At the converged last stage phi = 0 and phi_q v + phi_t = 0 are equations of the stage
itself, so that the projection that closes it onto the constraints is the identity there: its tangents lie in those of
the constraints already.
"""

from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import floats, inner, matrix, naturals
from dms_core.compiled.jit import compiled
from dms_core.sensitivity.tangents.stage import SETTLED, differentiate_stage
from dms_core.sensitivity.tangents.stage_solve import column_forward, output_back
from dms_core.sensitivity.tangents.tables import ADJOINTS, COLUMNS, DIFFERENTIALS, KIND, NUMBERS
from dms_core.simulation.iteration.implicit_stage import put_guess, set_weights
from dms_core.simulation.iteration.newton import NEWTON, set_rates
from dms_core.simulation.iteration.parts import run_stage, set_inputs
from dms_core.simulation.methods.bdf2 import prepare_bdf2
from dms_core.simulation.methods.sdirk2 import GAMMA, prepare_first_stage, prepare_second_stage
from dms_core.simulation.state import CLOCK, STATE
from dms_core.simulation.step_control import accept


@compiled
def _near(m, s, o, d, g, t, c0):
    """Solve and differentiate a stage from a guess that is close to it; False where that leads nowhere."""
    set_inputs(m, s, t, True)
    put_guess(m, s, c0, 0.0)
    set_rates(s, c0)
    return differentiate_stage(m, s, o, d, g, c0) == SETTLED.yes


@compiled
def _far(m, s, o, d, g, t, c0, lam_slope, last):
    """Solve and differentiate a stage from the guess of its method; False where that fails."""
    code, _ = run_stage(m, s, o, t, c0, lam_slope, last)
    return code == NEWTON.converged and differentiate_stage(m, s, o, d, g, c0) != SETTLED.singular


@compiled
def _guess_end(s, d):
    """The recorded end of the step as guess of its last stage."""
    q, v, end_q, end_v = (
        floats(s, STATE.q_guess), floats(s, STATE.v_guess), floats(d, DIFFERENTIALS.end_q),
        floats(d, DIFFERENTIALS.end_v),
    )  # fmt: skip
    for i in range(q.shape[0]):
        q[i], v[i] = end_q[i], end_v[i]


@compiled
def _guess_first(s, d, h):
    """The first stage of SDIRK2 that leads to the recorded end, as its guess.

    qdot of the second stage is v of the end, but for the projection; that of the first one, which is its v, is then
    what else the step needs.
    """
    q, end_q, end_v = floats(s, STATE.q), floats(d, DIFFERENTIALS.end_q), floats(d, DIFFERENTIALS.end_v)
    q_guess, v_guess = floats(s, STATE.q_guess), floats(s, STATE.v_guess)
    for i in range(q.shape[0]):
        v_guess[i] = (end_q[i] - q[i] - GAMMA * h * end_v[i]) / ((1.0 - GAMMA) * h)
        q_guess[i] = q[i] + GAMMA * h * v_guess[i]


@compiled
def _sdirk2(m, s, o, d, h, known):
    """Solve and differentiate the two stages of a step of size h; False where either fails."""
    t, c0, numbers = floats(s, STATE.clock)[CLOCK.t], 1.0 / (GAMMA * h), floats(d, DIFFERENTIALS.numbers)
    first, second = inner(d, DIFFERENTIALS.first), inner(d, DIFFERENTIALS.second)
    numbers[NUMBERS.kind], numbers[NUMBERS.h], numbers[NUMBERS.c0] = KIND.sdirk2, h, c0
    prepare_first_stage(s, h, c0)
    if known:
        _guess_first(s, d, h)
        if not _near(m, s, o, d, first, t + GAMMA * h, c0):
            return False
        prepare_second_stage(s, h, c0)
        _guess_end(s, d)
        return _near(m, s, o, d, second, t + h, c0)
    if not _far(m, s, o, d, first, t + GAMMA * h, c0, 0.0, False):
        return False
    prepare_second_stage(s, h, c0)
    return _far(m, s, o, d, second, t + h, c0, 0.0, True)


@compiled
def _bdf2(m, s, o, d, h, known):
    """Solve and differentiate a step of size h; False where it fails."""
    clock, numbers = floats(s, STATE.clock), floats(d, DIFFERENTIALS.numbers)
    h1 = clock[CLOCK.h_before]
    ratio = h / h1
    c0 = (1.0 + 2.0 * ratio) / (1.0 + ratio) / h
    numbers[NUMBERS.kind], numbers[NUMBERS.h], numbers[NUMBERS.c0] = KIND.bdf2, h, c0
    numbers[NUMBERS.by_q], numbers[NUMBERS.by_before] = -(1.0 + ratio) / h, ratio * ratio / (1.0 + ratio) / h
    prepare_bdf2(s, h, h1)
    stage, end = inner(d, DIFFERENTIALS.second), clock[CLOCK.t] + h
    if known:
        _guess_end(s, d)
        return _near(m, s, o, d, stage, end, c0)
    return _far(m, s, o, d, stage, end, c0, ratio, True)


@compiled
def differentiated_step(m, s, o, d, h, kind):
    """One step of the world s, solved to rounding, differentiated into d and accepted; False where it cannot be solved.

    Size and kind are given: nothing is rejected. What `carry_forward` and `carry_back` need stays in d until the next.
    """
    set_weights(m, s, o)
    known = floats(d, DIFFERENTIALS.numbers)[NUMBERS.known] == 1.0
    solved = _sdirk2(m, s, o, d, h, known) if kind == KIND.sdirk2 else _bdf2(m, s, o, d, h, known)
    if solved:
        accept(s, h, floats(d, DIFFERENTIALS.numbers)[NUMBERS.c0], kind == KIND.sdirk2)
    return solved


@compiled
def _forward_stage(m, d, c, first):
    """All columns through the first stage of SDIRK2, or through the one that ends a step."""
    c0 = floats(d, DIFFERENTIALS.numbers)[NUMBERS.c0]
    for k in range(matrix(c, COLUMNS.dq).shape[0]):
        if first:
            column_forward(m, d, inner(d, DIFFERENTIALS.first), c, k, 0, c0)
        else:
            column_forward(m, d, inner(d, DIFFERENTIALS.second), c, k, 1, c0)


@compiled
def carry_forward(m, d, c):
    """The columns from the begin of the differentiated step to its end."""
    numbers = floats(d, DIFFERENTIALS.numbers)
    c0, h = numbers[NUMBERS.c0], numbers[NUMBERS.h]
    dq, dv = matrix(c, COLUMNS.dq), matrix(c, COLUMNS.dv)
    before_q, before_v = matrix(c, COLUMNS.dq_before), matrix(c, COLUMNS.dv_before)
    cq, cv = matrix(c, COLUMNS.cq), matrix(c, COLUMNS.cv)
    stage_q, stage_v = matrix(c, COLUMNS.stage_q), matrix(c, COLUMNS.stage_v)
    one_step = numbers[NUMBERS.kind] == KIND.sdirk2
    for k in range(dq.shape[0]):
        for i in range(dq.shape[1]):
            stage_q[k, i], stage_v[k, i] = dq[k, i], dv[k, i]
            if one_step:
                cq[k, i], cv[k, i] = -c0 * dq[k, i], -c0 * dv[k, i]
            else:
                b1, b2 = numbers[NUMBERS.by_q], numbers[NUMBERS.by_before]
                cq[k, i] = b1 * dq[k, i] + b2 * before_q[k, i]
                cv[k, i] = b1 * dv[k, i] + b2 * before_v[k, i]
    if one_step:
        _forward_stage(m, d, c, True)
        for k in range(dq.shape[0]):
            for i in range(dq.shape[1]):
                cq[k, i] = -c0 * (dq[k, i] + h * (1.0 - GAMMA) * c0 * (stage_q[k, i] - dq[k, i]))
                cv[k, i] = -c0 * (dv[k, i] + h * (1.0 - GAMMA) * c0 * (stage_v[k, i] - dv[k, i]))
    _forward_stage(m, d, c, False)
    for k in range(dq.shape[0]):
        for i in range(dq.shape[1]):
            before_q[k, i], before_v[k, i] = dq[k, i], dv[k, i]
            dq[k, i], dv[k, i] = stage_q[k, i], stage_v[k, i]


@compiled
def carry_back(m, d, b):
    """The adjoints from the end of the differentiated step to its begin; inputs and numbers are added up."""
    numbers = floats(d, DIFFERENTIALS.numbers)
    for k in range(matrix(b, ADJOINTS.aq).shape[0]):
        if numbers[NUMBERS.kind] == KIND.sdirk2:
            _sdirk2_back(m, d, b, k, numbers[NUMBERS.c0])
        else:
            _bdf2_back(m, d, b, k, numbers)


@compiled
def _sdirk2_back(m, d, b, k, c0):
    """Output k; h c0 = 1 / gamma."""
    free, weight = naturals(m, MODEL.free), c0 * (1.0 - GAMMA) / GAMMA
    aq, av, cq, cv = matrix(b, ADJOINTS.aq), matrix(b, ADJOINTS.av), matrix(b, ADJOINTS.cq), matrix(b, ADJOINTS.cv)
    before_q, before_v = matrix(b, ADJOINTS.aq_before), matrix(b, ADJOINTS.av_before)
    output_back(m, d, inner(d, DIFFERENTIALS.second), b, k, aq[k], av[k], c0)
    # What steps of BDF2 behind have left for the begin of this step waits in `before`.
    for j in range(free.shape[0]):
        i = free[j]
        aq[k, i], av[k, i] = -weight * cq[k, i], -weight * cv[k, i]
        before_q[k, i] += (weight - c0) * cq[k, i]
        before_v[k, i] += (weight - c0) * cv[k, i]
    output_back(m, d, inner(d, DIFFERENTIALS.first), b, k, aq[k], av[k], c0)
    for j in range(free.shape[0]):
        i = free[j]
        aq[k, i] = before_q[k, i] - c0 * cq[k, i]
        av[k, i] = before_v[k, i] - c0 * cv[k, i]
        before_q[k, i] = before_v[k, i] = 0.0


@compiled
def _bdf2_back(m, d, b, k, numbers):
    """Output k."""
    free, b1, b2 = naturals(m, MODEL.free), numbers[NUMBERS.by_q], numbers[NUMBERS.by_before]
    aq, av, cq, cv = matrix(b, ADJOINTS.aq), matrix(b, ADJOINTS.av), matrix(b, ADJOINTS.cq), matrix(b, ADJOINTS.cv)
    before_q, before_v = matrix(b, ADJOINTS.aq_before), matrix(b, ADJOINTS.av_before)
    output_back(m, d, inner(d, DIFFERENTIALS.second), b, k, aq[k], av[k], numbers[NUMBERS.c0])
    for j in range(free.shape[0]):
        i = free[j]
        aq[k, i], av[k, i] = before_q[k, i] + b1 * cq[k, i], before_v[k, i] + b1 * cv[k, i]
        before_q[k, i], before_v[k, i] = b2 * cq[k, i], b2 * cv[k, i]

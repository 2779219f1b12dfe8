"""Entries of calls that read driven inputs or sensors; their tables are those of dms_core.assembly.pattern.connections.

`_kernel` and `_second` are put into the globals of each entry (entries.py): the element's or sensor's kernel, and the
element's `input_kernel`.
"""

from __future__ import annotations

from typing import Any

from dms_core.assembly.local import clear
from dms_core.assembly.tables import WORK
from dms_core.compiled.arena import floats, matrix
from dms_core.compiled.jit import compiled

_kernel: Any = None
_second: Any = None
integers_of: Any = None
numbers_of: Any = None
SLOPES: Any = None
"""Those of entries.py, which imports this file."""


@compiled
def put_wires(ip, v_l, u_l):
    """Rates of coordinates in place of driven inputs; their own rates are not known, and 0."""
    end = ip.shape[0] - 1
    for pair in range(ip[end]):
        k, j = ip[end - 2 - 2 * pair], ip[end - 1 - 2 * pair]
        u_l[k, 0], u_l[k, 1], u_l[k, 2] = v_l[j], 0.0, 0.0


@compiled
def add_wires(ip, by_input, step, by_rate):
    """by_rate[:, coordinate] += by_input[:, step * input] for each driven input, and that of the input becomes 0."""
    end = ip.shape[0] - 1
    for pair in range(ip[end]):
        k, j = ip[end - 2 - 2 * pair], ip[end - 1 - 2 * pair]
        for i in range(by_input.shape[0]):
            by_rate[i, j] += by_input[i, step * k]
            for m in range(step):
                by_input[i, step * k + m] = 0.0


def wired_dynamic(calls, e, w, level):  # noqa: ANN001, ANN201
    """Dynamic call that reads driven inputs."""
    ip, par = integers_of(calls, e), numbers_of(calls, e)
    q_l, v_l, a_l, u_l = floats(w, WORK.q_l), floats(w, WORK.v_l), floats(w, WORK.a_l), matrix(w, WORK.u_l)
    Jv = matrix(w, WORK.Jv)
    put_wires(ip, v_l, u_l)
    _kernel(ip, par, q_l, v_l, a_l, u_l, level, floats(w, WORK.r_l), matrix(w, WORK.Jq), Jv, matrix(w, WORK.Ja))
    if level > 0:
        Ju = matrix(w, WORK.Ju)
        clear(Ju, Ju.shape[0], Ju.shape[1])
        _second(ip, par, q_l, v_l, a_l, u_l, Ju.reshape((Ju.shape[0], Ju.shape[1] // 3, 3)))
        add_wires(ip, Ju, 3, Jv)


def wired_sensor(calls, e, w, level):  # noqa: ANN001, ANN201
    """Sensor call that reads driven inputs."""
    ip, v_l, u_l = integers_of(calls, e), floats(w, WORK.v_l), matrix(w, WORK.u_l)
    Yv, Yu = matrix(w, WORK.Yv), matrix(w, WORK.Yu)
    put_wires(ip, v_l, u_l)
    _kernel(
        ip, numbers_of(calls, e), floats(w, WORK.q_l), v_l, floats(w, WORK.a_l), floats(w, WORK.lam_l), u_l, level,
        floats(w, WORK.y_l), matrix(w, WORK.Yq), Yv, matrix(w, WORK.Ya), matrix(w, WORK.Yl), Yu,
    )  # fmt: skip
    if level > 0:
        add_wires(ip, Yu, 1, Yv)


def reading(calls, e, w, level):  # noqa: ANN001, ANN201
    """Dynamic call that is the row v - y = 0 of a sensor component."""
    ip, v_l, u_l = integers_of(calls, e), floats(w, WORK.v_l), matrix(w, WORK.u_l)
    y_l, Yq, Yv, Ya = floats(w, WORK.y_l), matrix(w, WORK.Yq), matrix(w, WORK.Yv), matrix(w, WORK.Ya)
    Yl, Yu = matrix(w, WORK.Yl), matrix(w, WORK.Yu)
    put_wires(ip, v_l, u_l)
    tail = ip.shape[0] - 1 - 2 * ip[ip.shape[0] - 1]
    component, rows, own = ip[tail - 3], ip[tail - 2], ip[tail - 1]
    for i in range(rows):
        y_l[i] = 0.0
    if level > 0:
        clear(Yq, rows, own)
        clear(Yv, rows, own)
        clear(Ya, rows, own)
        clear(Yl, rows, Yl.shape[1])
        clear(Yu, rows, Yu.shape[1])
    _kernel(
        ip, numbers_of(calls, e), floats(w, WORK.q_l), v_l, floats(w, WORK.a_l), floats(w, WORK.lam_l), u_l, level,
        y_l, Yq, Yv, Ya, Yl, Yu,
    )  # fmt: skip
    floats(w, WORK.r_l)[own] = v_l[own] - y_l[component]
    if level > 0:
        add_wires(ip, Yu, 1, Yv)
        Jq, Jv, Ja = matrix(w, WORK.Jq), matrix(w, WORK.Jv), matrix(w, WORK.Ja)
        for j in range(own):
            Jq[own, j], Jv[own, j], Ja[own, j] = -Yq[component, j], -Yv[component, j], -Ya[component, j]
        Jv[own, own] = 1.0


def wired_by_input(calls, e, w, level):  # noqa: ANN001, ANN201
    """Derivatives by the inputs that are not driven."""
    ip, v_l, u_l, Ju = integers_of(calls, e), floats(w, SLOPES.v_l), matrix(w, SLOPES.u_l), matrix(w, SLOPES.Ju)
    put_wires(ip, v_l, u_l)
    _kernel(
        ip, numbers_of(calls, e), floats(w, SLOPES.q_l), v_l, floats(w, SLOPES.a_l), u_l,
        Ju.reshape((Ju.shape[0], Ju.shape[1] // 3, 3)),
    )  # fmt: skip
    end = ip.shape[0] - 1
    for pair in range(ip[end]):
        for i in range(Ju.shape[0]):
            for m in range(3):
                Ju[i, 3 * ip[end - 2 - 2 * pair] + m] = 0.0


def wired_by_parameter(calls, e, w, level):  # noqa: ANN001, ANN201
    """Derivatives by numbers, with driven inputs in their place."""
    ip, v_l, u_l = integers_of(calls, e), floats(w, SLOPES.v_l), matrix(w, SLOPES.u_l)
    put_wires(ip, v_l, u_l)
    _kernel(ip, numbers_of(calls, e), floats(w, SLOPES.q_l), v_l, floats(w, SLOPES.a_l), u_l, matrix(w, SLOPES.Jp))

"""The compiled form of a system: constant tables and mutable work arrays, both plain tuples of arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dms_core.assembly.layout import Layout
from dms_core.assembly.pattern.sparsity import NewtonPattern, RatePattern
from dms_core.compiled.arena import fields
from dms_core.compiled.calls import SIGNAL, address
from dms_core.errors import InputError
from dms_core.linear.symbolic import LuTables
from dms_core.model.signals import Function, Harmonic

POLYNOMIAL, HARMONIC, FUNCTION = 0, 1, 2


class Calls(NamedTuple):
    """Kernel calls of one kind. Slices of the flat arrays belong to call e: x[x_ptr[e] : x_ptr[e + 1]]."""

    kernel: np.ndarray
    """Addresses of their entries (entries.py), (n_calls,)."""
    iq: np.ndarray
    iq_ptr: np.ndarray
    iu: np.ndarray
    iu_ptr: np.ndarray
    ip: np.ndarray
    ip_ptr: np.ndarray
    par: np.ndarray
    par_ptr: np.ndarray
    row: np.ndarray
    """First row of each call; row[e + 1] ends it, (n_calls + 1,)."""
    moving: np.ndarray
    """Calls that see a coordinate which is solved for; a step evaluates these only."""
    solved: np.ndarray
    """Local places of the coordinates of each call that are solved for; all others of a moving call rest."""
    solved_ptr: np.ndarray


class Signals(NamedTuple):
    """Inputs u(t); mutable, so that a value can be set between calls of the solver."""

    kind: np.ndarray
    t: np.ndarray
    """Starts of all pieces [s], flat."""
    c: np.ndarray
    """Coefficients of all pieces, (n_pieces, 6); amplitude, 2 pi frequency, phase, offset of a harmonic."""
    ptr: np.ndarray
    address: np.ndarray
    jumps: np.ndarray
    """All times of discontinuity [s], sorted."""


class Work(NamedTuple):
    """Arrays that evaluation writes. Global vectors carry the ground's seven slots behind n_q."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    """vdot."""
    lam: np.ndarray
    mu: np.ndarray
    u: np.ndarray
    """(n_u, 3): value, first, second derivative."""
    y: np.ndarray
    r2: np.ndarray
    """M vdot + phi_q^T lam - f, (n_q + 7,)."""
    gmu: np.ndarray
    """phi_q^T mu, (n_q + 7,)."""
    phi: np.ndarray
    phi_v: np.ndarray
    """phi_q v + phi_t."""
    phi_a: np.ndarray
    """phi_q vdot + (phi_q v)_q v + phi_tt; only where asked."""
    # Local arrays of one kernel call.
    q_l: np.ndarray
    v_l: np.ndarray
    a_l: np.ndarray
    lam_l: np.ndarray
    u_l: np.ndarray
    r_l: np.ndarray
    Jq: np.ndarray
    Jv: np.ndarray
    Ja: np.ndarray
    phi_l: np.ndarray
    phi_t_l: np.ndarray
    G: np.ndarray
    W: np.ndarray
    H: np.ndarray
    y_l: np.ndarray
    Yq: np.ndarray
    Yv: np.ndarray
    Ya: np.ndarray
    Yl: np.ndarray
    Yu: np.ndarray
    Ju: np.ndarray
    """(n, 3 k), derivatives by inputs that elements drive; without any row where none are."""


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
    redundant: int
    """Rows that are left out as the others imply them; which ones these may be changes with the position."""
    c0_ordered: np.ndarray
    """c0 for which the order of elimination of the Newton matrix was chosen [1/s], (1,)."""


CALLS, SIGNALS, WORK, MODEL = fields(Calls), fields(Signals), fields(Work), fields(Tables)


def flat(parts: list[Any], dtype: Any) -> tuple[np.ndarray, np.ndarray]:
    """Concatenated parts, and the pointers to where each begins; the last one ends it."""
    arrays = [np.asarray(p, dtype) for p in parts]
    ptr = np.concatenate([[0], np.cumsum([len(a) for a in arrays])]).astype(np.int64)
    return np.ascontiguousarray(np.concatenate([np.zeros(0, dtype), *arrays])), ptr


def _writer(function: Any) -> Any:
    """The user's function of time, its three results written into an array."""
    from numba import njit

    course = njit(function)

    def write(t, out):  # noqa: ANN001, ANN202
        out[0], out[1], out[2] = course(t)

    return njit(write)


def signal_tables(layout: Layout) -> tuple[Signals, list[Any]]:
    """Tables of all inputs, and the compiled user functions that must be kept alive."""
    kinds, starts, coefficients, addresses, jumps, keep = [], [], [], [], [np.zeros(0)], []
    for item in layout.system.inputs:
        signal, pointer = item.signal, 0
        t, c = np.zeros(1), np.zeros((1, 6))
        if isinstance(signal, Harmonic):
            kind = HARMONIC
            c[0, :4] = signal.amplitude, 2.0 * np.pi * signal.frequency, signal.phase, signal.offset
        elif isinstance(signal, Function):
            kind = FUNCTION
            jumps.append(np.array(signal.jumps))
            compiled = _writer(signal.function)
            try:
                pointer = address(compiled, SIGNAL)
            except Exception as error:
                raise InputError(
                    f"input '{item.name}': its function cannot be compiled by numba; it must take t [s] and return "
                    f"(value, first, second derivative).\n{error}"
                ) from error
            keep.append(compiled)
        else:
            kind = POLYNOMIAL
            t, c, jump = signal.pieces()
            jumps.append(jump)
        kinds.append(kind)
        starts.append(t)
        coefficients.append(c)
        addresses.append(pointer)
    pieces, ptr = flat(starts, np.float64)
    c = np.ascontiguousarray(np.concatenate([np.zeros((0, 6)), *coefficients]))
    events = np.unique(np.concatenate(jumps))
    return Signals(np.array(kinds, np.int64), pieces, c, ptr, np.array(addresses, np.int64), events), keep


def with_settings(signals: Signals, settings: dict[int, list[tuple[float, float]]]) -> Signals:
    """The same inputs, those set between calls as the steps they made: settings[k] = [(time [s], value), ...]."""
    starts, coefficients = [], []
    for k in range(len(signals.kind)):
        t, c = (x[signals.ptr[k] : signals.ptr[k + 1]] for x in (signals.t, signals.c))
        if k in settings:
            t = np.array([time for time, _ in settings[k]])
            c = np.zeros((len(t), 6))
            c[:, 0] = [value for _, value in settings[k]]
        starts.append(t)
        coefficients.append(c)
    pieces, ptr = flat(starts, np.float64)
    c = np.ascontiguousarray(np.concatenate([np.zeros((0, 6)), *coefficients]))
    return signals._replace(t=pieces, ptr=ptr, c=c)


def new_work(layout: Layout) -> Work:
    """Fresh work arrays, the ground's coordinates in place."""
    calls = [*layout.dynamics, *layout.constraints, *layout.sensors]
    n = max([len(c.iq) for c in calls] + [7])
    m = max([c.rows for c in layout.constraints] + [1])
    k = max([len(c.iu) for c in calls] + [1])
    y = max([c.rows for c in layout.sensors] + [1])
    big = layout.n_q + 7
    zeros = np.zeros
    q, v = layout.start()
    return Work(
        q=q, v=v, a=zeros(big), lam=zeros(layout.n_phi), mu=zeros(layout.n_phi), u=zeros((len(layout.input_index), 3)),
        y=zeros(len(layout.outputs)), r2=zeros(big), gmu=zeros(big), phi=zeros(layout.n_phi), phi_v=zeros(layout.n_phi),
        phi_a=zeros(layout.n_phi), q_l=zeros(n), v_l=zeros(n), a_l=zeros(n), lam_l=zeros(m), u_l=zeros((k, 3)),
        r_l=zeros(n), Jq=zeros((n, n)), Jv=zeros((n, n)), Ja=zeros((n, n)), phi_l=zeros(m), phi_t_l=zeros((m, 2)),
        G=zeros((m, n)), W=zeros((m, n)), H=zeros((n, n)), y_l=zeros(y), Yq=zeros((y, n)), Yv=zeros((y, n)),
        Ya=zeros((y, n)), Yl=zeros((y, m)), Yu=zeros((y, k)),
        Ju=zeros((n if layout.driven else 0, 3 * k)),
    )  # fmt: skip

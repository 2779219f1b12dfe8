"""Kernels as the loops call them: by the address of a small function that finds a kernel's arrays.

An element's kernel takes a dozen arrays, each of them seven or nine machine words to numba; handing them over would
take as long as many a kernel runs. Its entry takes the packed tables instead, and the kernel is compiled into it.
"""

from __future__ import annotations

from functools import cache
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numba.core.caching import NullCache
from numba.extending import is_jitted

from dms_core.assembly.layout import Call, Layout
from dms_core.assembly.tables import CALLS, WORK, Calls, flat
from dms_core.compiled import connected
from dms_core.compiled.arena import fields, floats, indices, ints, matrix
from dms_core.compiled.calls import ENTRY, address
from dms_core.compiled.jit import compiled
from dms_core.compiled.kept_code import keep
from dms_core.errors import ModelError
from dms_core.model.element import CONSTRAINT, DYNAMIC, INPUT_DERIVATIVE, PARAMETER_DERIVATIVE, SENSOR

_kernel: Any = None
"""In the globals of an entry: the kernel that it is for."""


class Slopes(NamedTuple):
    """Local arrays of a kernel that gives derivatives by inputs or by parameters; the first four belong to a Work."""

    q_l: np.ndarray
    v_l: np.ndarray
    a_l: np.ndarray
    u_l: np.ndarray
    Ju: np.ndarray
    """(n, 3 k): columns 3 k to 3 k + 2 belong to input k."""
    Jp: np.ndarray


SLOPES = fields(Slopes)


@compiled(makes_arrays=True)
def integers_of(calls, e):
    """Integers of call e."""
    ptr = ints(calls, CALLS.ip_ptr)
    return indices(calls, CALLS.ip)[ptr[e] : ptr[e + 1]]


@compiled(makes_arrays=True)
def numbers_of(calls, e):
    """Numbers of call e."""
    ptr = ints(calls, CALLS.par_ptr)
    return floats(calls, CALLS.par)[ptr[e] : ptr[e + 1]]


def _dynamic(calls, e, w, level):  # noqa: ANN001, ANN202
    _kernel(
        integers_of(calls, e), numbers_of(calls, e), floats(w, WORK.q_l), floats(w, WORK.v_l), floats(w, WORK.a_l),
        matrix(w, WORK.u_l), level, floats(w, WORK.r_l), matrix(w, WORK.Jq), matrix(w, WORK.Jv), matrix(w, WORK.Ja),
    )  # fmt: skip


def _constraint(calls, e, w, level):  # noqa: ANN001, ANN202
    _kernel(
        integers_of(calls, e), numbers_of(calls, e), floats(w, WORK.q_l), floats(w, WORK.v_l), floats(w, WORK.lam_l),
        matrix(w, WORK.u_l), level, floats(w, WORK.phi_l), matrix(w, WORK.phi_t_l), matrix(w, WORK.G),
        matrix(w, WORK.W), matrix(w, WORK.H),
    )  # fmt: skip


def _sensor(calls, e, w, level):  # noqa: ANN001, ANN202
    _kernel(
        integers_of(calls, e), numbers_of(calls, e), floats(w, WORK.q_l), floats(w, WORK.v_l), floats(w, WORK.a_l),
        floats(w, WORK.lam_l), matrix(w, WORK.u_l), level, floats(w, WORK.y_l), matrix(w, WORK.Yq),
        matrix(w, WORK.Yv), matrix(w, WORK.Ya), matrix(w, WORK.Yl), matrix(w, WORK.Yu),
    )  # fmt: skip


def _by_input(calls, e, w, level):  # noqa: ANN001, ANN202
    Ju = matrix(w, SLOPES.Ju)
    _kernel(
        integers_of(calls, e), numbers_of(calls, e), floats(w, SLOPES.q_l), floats(w, SLOPES.v_l),
        floats(w, SLOPES.a_l), matrix(w, SLOPES.u_l), Ju.reshape((Ju.shape[0], Ju.shape[1] // 3, 3)),
    )  # fmt: skip


def _by_parameter(calls, e, w, level):  # noqa: ANN001, ANN202
    _kernel(
        integers_of(calls, e), numbers_of(calls, e), floats(w, SLOPES.q_l), floats(w, SLOPES.v_l),
        floats(w, SLOPES.a_l), matrix(w, SLOPES.u_l), matrix(w, SLOPES.Jp),
    )  # fmt: skip


_ENTRIES = {
    DYNAMIC: _dynamic, CONSTRAINT: _constraint, SENSOR: _sensor, INPUT_DERIVATIVE: _by_input,
    PARAMETER_DERIVATIVE: _by_parameter,
}  # fmt: skip
_WIRED = {
    DYNAMIC: connected.wired_dynamic, SENSOR: connected.wired_sensor, INPUT_DERIVATIVE: connected.wired_by_input,
    PARAMETER_DERIVATIVE: connected.wired_by_parameter,
}  # fmt: skip


@cache
def entry(kernel: Any, signature: Any, form: Any = None, second: Any = None) -> Any:
    """The function (calls, e, w, level) that runs `kernel` on the local arrays of call e.

    It counts as a function of the kernel's file, where its machine code is kept if the kernel's is.

    Args:
        kernel: compiled function of the signature.
        signature: DYNAMIC, CONSTRAINT, SENSOR, INPUT_DERIVATIVE or PARAMETER_DERIVATIVE.
        form: what the entry does around it; default: the plain form of that signature.
        second: what the form calls as `_second`.
    """
    function = kernel.py_func
    name, origin = f"{function.__name__}_{form.__name__ if form else 'entry'}", function.__code__
    form = form or _ENTRIES[signature]
    code = form.__code__.replace(
        co_name=name, co_qualname=name, co_filename=origin.co_filename, co_firstlineno=origin.co_firstlineno
    )
    options = {k: v for k, v in kernel.targetoptions.items() if k not in ("nopython", "cache")}
    # Nobody calls an entry, or the copy of the kernel in it, from Python.
    habits: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True, "no_cpython_wrapper": True}
    habits["_nrt"] = options.get("_nrt", True)
    within = njit(function, locals=kernel.locals, **{**options, **habits, "forceinline": True})
    known = {**form.__globals__, "_kernel": within, "_second": second}
    known |= {"integers_of": integers_of, "numbers_of": numbers_of, "SLOPES": SLOPES}
    found = FunctionType(code, known, name)
    found.__module__, found.__qualname__ = function.__module__, name
    made = njit(found, **habits)
    if type(kernel._cache) is not NullCache:
        keep(made)
    return made


def derivative_kernel(element: type, attribute: str) -> Any:
    """`input_kernel` or `parameter_kernel` of an element's class; None where differences have to do.

    One that was inherited beside a kernel of the subclass's own belongs to another kernel, and does not count.
    """
    declared = next(c for c in element.__mro__ if attribute in vars(c))
    kernel_of = next(c for c in element.__mro__ if "kernel" in vars(c))
    return vars(declared)[attribute] if issubclass(declared, kernel_of) else None


def derivative_addresses(calls: list[Call], attribute: str, signature: Any) -> np.ndarray:
    """Addresses of the entries of that derivative kernel, compiled or loaded here; 0 where there is none, (n_calls,).

    Raises:
        ModelError: a derivative kernel is no function compiled by numba.
    """
    found = []
    for call in calls:
        element, kernel = call.element, derivative_kernel(type(call.element), attribute)
        if kernel is not None and not is_jitted(kernel):
            raise ModelError(
                f"{element.kind} '{element.name}': expected a function decorated with numba.njit as {attribute}, got "
                f"{kernel!r}."
            )
        # The kernel of a call that reads a sensor is the sensor's, and differences have to do.
        known = kernel is not None and not call.placement.reads
        form = _WIRED[signature] if call.placement.wired else None
        found.append(address(entry(kernel, signature, form), ENTRY) if known else 0)
    return np.array(found, np.int64)


def call_tables(calls: list[Call], signature: Any) -> Calls:
    """Tables of all calls of one kind; kernels are compiled here, or loaded from numba's cache.

    Raises:
        ModelError: a kernel is no function compiled by numba.
    """
    addresses = []
    for call in calls:
        element = call.element
        kernel: Any = type(call.sensor or element).kernel
        if kernel is not None and not is_jitted(kernel):
            raise ModelError(
                f"{element.kind} '{element.name}': Expected a kernel decorated with numba.njit, got {kernel!r}."
            )
        addresses.append(0 if kernel is None else address(_entry_of(call, kernel, signature), ENTRY))
    return Calls(
        np.array(addresses, np.int64),
        *flat([c.iq for c in calls], np.int32),
        *flat([c.iu for c in calls], np.int32),
        *flat([c.placement.integers for c in calls], np.int32),
        *flat([c.placement.numbers for c in calls], np.float64),
        np.array([c.row for c in calls] + [sum(c.rows for c in calls)], np.int64),
        np.arange(len(calls)),
        *flat([np.arange(len(c.iq)) for c in calls], np.int32),
    )


def _entry_of(call: Call, kernel: Any, signature: Any) -> Any:
    """The entry of a call, which may read a sensor or driven inputs.

    Raises:
        ModelError: an element that reads a driven input cannot say how it depends on it.
    """
    if call.sensor is not None:
        return entry(kernel, SENSOR, connected.reading)
    if not call.placement.wired:
        return entry(kernel, signature)
    if signature is not DYNAMIC:
        return entry(kernel, signature, _WIRED[signature])
    second = derivative_kernel(type(call.element), "input_kernel")
    if second is None:
        raise ModelError(
            f"{call.element.kind} '{call.element.name}' reads a driven input. Expected an input_kernel, which gives "
            "its derivatives by it.",
            call.element.name,
        )
    return entry(kernel, signature, connected.wired_dynamic, second)


def all_calls(layout: Layout) -> tuple[Calls, Calls, Calls]:
    """Tables of dynamics, constraints and sensors; every call counts as moving."""
    return (
        call_tables(layout.dynamics, DYNAMIC),
        call_tables(layout.constraints, CONSTRAINT),
        call_tables(layout.sensors, SENSOR),
    )


def moving_calls(calls: list[Call], free: np.ndarray) -> np.ndarray:
    """Numbers of the calls that see a coordinate which is solved for."""
    return np.array([e for e, c in enumerate(calls) if np.isin(c.iq, free).any()], np.int64)


def solved_calls(tables: Calls, calls: list[Call], free: np.ndarray) -> Calls:
    """The same tables, of which a step evaluates what belongs to the coordinates that are solved for."""
    solved, ptr = flat([np.flatnonzero(np.isin(c.iq, free)) for c in calls], np.int32)
    return tables._replace(moving=moving_calls(calls, free), solved=solved, solved_ptr=ptr)

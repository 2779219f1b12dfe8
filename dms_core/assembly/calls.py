"""Calling an element's kernel by its address, from inside compiled code.

A kernel is an ordinary `numba.njit` function, so that it can be called, tested and cached like any other. The
compiled loops know it only by the address of its machine code: one loop, compiled and cached once, serves every
element that exists or that a user writes later.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import types
from numba.extending import intrinsic

from dms_core.errors import ModelError
from dms_core.model.element import CONSTRAINT, DYNAMIC, SENSOR

PART = types.void(types.Array(types.int64, 2, "C"), types.Array(types.int64, 2, "C"))
SIGNAL = types.void(types.float64, types.Array(types.float64, 1, "C"))


def address(kernel: Any, signature: Any, who: str) -> int:
    """Compile `kernel` for `signature` (or load it from numba's cache) and give the address of its code."""
    if not hasattr(kernel, "compile"):
        raise ModelError(f"{who}: its kernel is {kernel!r}; a function decorated with numba.njit is wanted.")
    return _address(kernel, signature)


@cache
def _address(kernel: Any, signature: Any) -> int:
    """As above; asking numba again takes longer than a step."""
    kernel.compile(signature)
    compiled = kernel.get_compile_result(signature)
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def _call_by_address(signature: Any) -> Any:
    """Code generator of a call with numba's own calling convention to the address in the first argument."""

    def codegen(context, builder, sig, args):
        target = context.call_conv.get_function_type(types.none, signature.args)
        function = builder.inttoptr(args[0], target.as_pointer())
        context.call_conv.call_function(builder, function, types.none, signature.args, args[1:])
        return context.get_dummy_value()

    return types.void(types.int64, *signature.args), codegen


@intrinsic
def call_dynamic(typingctx, address, ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Call a dynamic kernel."""
    return _call_by_address(DYNAMIC)


@intrinsic
def call_constraint(typingctx, address, ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """Call a constraint kernel."""
    return _call_by_address(CONSTRAINT)


@intrinsic
def call_sensor(typingctx, address, ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Call a sensor kernel."""
    return _call_by_address(SENSOR)


@intrinsic
def call_signal(typingctx, address, t, out):
    """Call a compiled function of time."""
    return _call_by_address(SIGNAL)


@intrinsic
def call_part(typingctx, address, m, s):
    """Call a part of a step."""
    return _call_by_address(PART)

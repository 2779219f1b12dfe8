"""Calling functions by their addresses, from inside compiled code.

An element's kernel is an ordinary `numba.njit` function, so that it can be called, tested and cached like any other.
The compiled loops know it only by the address of its machine code (of its entry, see entries.py): one loop, compiled
and cached once, serves every element that exists or that a user writes later.

An exception in such a function is passed on by its caller, as between numba's own functions, and reaches Python: a
kernel that raises, or that divides by zero without error_model="numpy", ends the call of Python that led to it. What it
was to write is then written in part, so that a world must be reset or restored before it goes on.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

TABLE = types.Array(types.int64, 2, "C")
"""Type of a packed table."""
PART = types.void(TABLE, TABLE)
ENTRY = types.void(TABLE, types.int64, TABLE, types.int64)
SIGNAL = types.void(types.float64, types.Array(types.float64, 1, "C"))
TABLE_CALL = types.void(TABLE)
"""Signature of a function of one packed table, see `call_with_table`."""


@cache
def address(function: Any, signature: Any) -> int:
    """Compile `function` for `signature` (or load it from numba's cache) and give the address of its code.

    Found once for each function: asking numba again takes longer than a step.
    """
    function.compile(signature)
    compiled = function.get_compile_result(signature)
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def call_by_address(signature: Any) -> Any:
    """What an intrinsic (address, *arguments) gives back: a call of the code at an address, by numba's convention.

    Where the code raises, so does the caller.
    """

    def codegen(context, builder, sig, args):
        target = context.call_conv.get_function_type(signature.return_type, signature.args)
        function = builder.inttoptr(args[0], target.as_pointer())
        convention = context.call_conv
        status, value = convention.call_function(builder, function, signature.return_type, signature.args, args[1:])
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return context.get_dummy_value() if signature.return_type == types.none else value

    return signature.return_type(types.int64, *signature.args), codegen


@intrinsic
def call_entry(typingctx, address, calls, e, w, level):
    """Call the entry of a kernel."""
    return call_by_address(ENTRY)


@intrinsic
def call_signal(typingctx, address, t, out):
    """Call a compiled function of time."""
    return call_by_address(SIGNAL)


@intrinsic
def call_part(typingctx, address, m, s):
    """Call a part of a step."""
    return call_by_address(PART)


@intrinsic
def call_with_table(typingctx, address, table):
    """Call a compiled function of one packed table; it gives nothing back."""
    return call_by_address(TABLE_CALL)

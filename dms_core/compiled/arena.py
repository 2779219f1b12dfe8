"""Many arrays behind one: how compiled code is handed a model or a world.

A tuple of a hundred arrays is cheap to own and dear to pass: numba unpacks it at every call. `pack` therefore turns a
(nested) NamedTuple of arrays into one table of addresses, a row (address, first dimension, second dimension) a field,
and compiled code takes views of the fields it needs by name:

    q = floats(w, WORK.q)         with  WORK = fields(Work)

A whole world is then a single row of a batch, and no reference count is touched in a step. The owner of the NamedTuple
must keep it (and the packed table) alive.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray, types
from numba.extending import intrinsic

from dms_core.compiled.jit import compiled


def fields(kind: type) -> Any:
    """The NamedTuple class `kind` filled with the index of each of its fields: names for compiled code."""
    return kind(*range(len(kind._fields)))  # type: ignore[attr-defined]


class Packed:
    """Addresses of a NamedTuple's arrays. `table` is what compiled code is given; the arrays are kept alive here."""

    def __init__(self, values: Any) -> None:
        self.values = values
        self.table = np.zeros((len(values), 3), np.int64)
        self._inner: list[Packed] = []
        for k, value in enumerate(values):
            if isinstance(value, tuple | Packed):
                inner = value if isinstance(value, Packed) else Packed(value)
                self._inner.append(inner)
                self.table[k] = (inner.table.ctypes.data, *inner.table.shape)
            elif isinstance(value, np.ndarray):
                if not value.flags.c_contiguous or value.dtype not in (
                    np.float64,
                    np.int64,
                    np.int32,
                    np.uint32,
                    np.bool_,
                ):
                    raise TypeError(
                        f"{values._fields[k]}: Expected a contiguous array of floats, integers or booleans, "
                        f"got {value.dtype} of shape {value.shape}."
                    )
                self.table[k] = (value.ctypes.data, value.shape[0], value.shape[1] if value.ndim > 1 else 1)
            else:
                self.table[k] = (0, int(value), 1)

    def __reduce__(self) -> Any:
        """Refuse copies and pickles, which would hold addresses of other arrays."""
        raise TypeError(
            "A packed table cannot be copied or pickled, since it holds addresses of this process; expected a Snapshot "
            "of a World, or a copy of an environment as a whole."
        )


def _pointer_to(element: Any) -> Any:
    @intrinsic
    def pointer(typingctx, address):  # noqa: ANN001, ANN202
        kind = types.CPointer(element)

        def codegen(context, builder, sig, args):  # noqa: ANN001, ANN202
            return builder.inttoptr(args[0], context.get_value_type(kind))

        return kind(types.int64), codegen

    return pointer


_float64 = _pointer_to(types.float64)
_complex128 = _pointer_to(types.complex128)
_int64 = _pointer_to(types.int64)
_int32 = _pointer_to(types.int32)
_uint32 = _pointer_to(types.uint32)
_bool = _pointer_to(types.boolean)


@compiled(makes_arrays=True)
def table_at(address, rows):
    """The packed table with that address and number of fields."""
    return carray(_int64(address), (rows, 3))


@compiled(makes_arrays=True)
def floats(table, k):
    """Field k as a vector of floats."""
    return carray(_float64(table[k, 0]), (table[k, 1],))


@compiled(makes_arrays=True)
def complexes(table, k):
    """Field k, floats in pairs of real and imaginary parts, as a vector of complex numbers."""
    return carray(_complex128(table[k, 0]), (table[k, 1] // 2,))


@compiled(makes_arrays=True)
def matrix(table, k):
    """Field k as a matrix of floats."""
    return carray(_float64(table[k, 0]), (table[k, 1], table[k, 2]))


@compiled(makes_arrays=True)
def matrix_as_vector(table, k):
    """Field k, a matrix of floats, as a vector of all its numbers, row by row."""
    return carray(_float64(table[k, 0]), (table[k, 1] * table[k, 2],))


@compiled
def columns_of(table, k):
    """Number of columns of field k."""
    return table[k, 2]


@compiled(makes_arrays=True)
def ints(table, k):
    """Field k as a vector of 64-bit integers."""
    return carray(_int64(table[k, 0]), (table[k, 1],))


@compiled(makes_arrays=True)
def indices(table, k):
    """Field k as a vector of 32-bit integers."""
    return carray(_int32(table[k, 0]), (table[k, 1],))


@compiled(makes_arrays=True)
def naturals(table, k):
    """Field k as a vector of unsigned 32-bit integers."""
    return carray(_uint32(table[k, 0]), (table[k, 1],))


@compiled(makes_arrays=True)
def flags(table, k):
    """Field k as a vector of booleans."""
    return carray(_bool(table[k, 0]), (table[k, 1],))


@compiled(makes_arrays=True)
def inner(table, k):
    """Field k as the table of a nested tuple."""
    return carray(_int64(table[k, 0]), (table[k, 1], table[k, 2]))


@compiled
def number(table, k):
    """Field k as a whole number."""
    return table[k, 1]

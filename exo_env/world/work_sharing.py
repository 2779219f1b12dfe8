"""What threads that share work need: a counter that each raises by itself, and memory fetched ahead of its use.

A world is some 150 kB that are read once a control period. Where many worlds take turns they lie in the slow caches,
and a fifth of the time would go into waiting for them.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from dms_core.compiled.jit import compiled
from dms_core.kernels import Packed

LINE = 64
"""Bytes of memory that a processor fetches at once."""
AREAS, GAP = 96, 512
"""Areas of memory remembered of a world, the largest of them, and bytes between two that are taken as one."""


@intrinsic
def claim(typingctx, counter):  # noqa: ANN001, ANN201
    """Give counter[0], int64, and raise it by one; no two threads are given the same number."""
    signature = types.int64(counter)

    def codegen(context, builder, sig, args):  # noqa: ANN001, ANN202
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        return builder.atomic_rmw("add", data, ir.Constant(ir.IntType(64), 1), "monotonic")

    return signature, codegen


@intrinsic
def fetch_line(typingctx, address):  # noqa: ANN001, ANN201
    """Ask for the line at an address; nothing waits for it, and an address of no memory does nothing."""
    signature = types.void(types.int64)

    def codegen(context, builder, sig, args):  # noqa: ANN001, ANN202
        pointer, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer, flag, flag, flag])
        prefetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        # To write, kept in the second cache and beyond, data.
        how = [ir.Constant(flag, k) for k in (1, 2, 1)]
        builder.call(prefetch, [builder.inttoptr(args[0], pointer), *how])
        return context.get_dummy_value()

    return signature, codegen


@compiled
def fetch_ahead(areas):
    """Ask for areas of memory, rows (address, bytes); an area of 0 bytes is the end."""
    for k in range(areas.shape[0]):
        if areas[k, 1] == 0:
            return
        for address in range(areas[k, 0], areas[k, 0] + areas[k, 1], LINE):
            fetch_line(address)


def areas_of(packed: Packed, beside: Collection[str]) -> np.ndarray:
    """Areas for `fetch_ahead` of the arrays of a packed NamedTuple, but for fields of some names; shape (AREAS, 2)."""
    merged: list[list[int]] = []
    for first, size in sorted(_arrays(packed, beside)):
        if merged and first - sum(merged[-1]) < GAP:
            merged[-1][1] = max(merged[-1][1], first + size - merged[-1][0])
        else:
            merged.append([first, size])
    found = np.zeros((AREAS, 2), np.int64)
    largest = sorted(merged, key=lambda area: -area[1])[:AREAS]
    found[: len(largest)] = largest
    return found


def _arrays(values: Any, beside: Collection[str]) -> list[tuple[int, int]]:
    """Address and bytes of each array."""
    values, found = values.values if isinstance(values, Packed) else values, []
    for name, value in zip(values._fields, values, strict=True):
        if name in beside:
            continue
        if isinstance(value, np.ndarray) and value.nbytes:
            found.append((value.ctypes.data, value.nbytes))
        elif isinstance(value, tuple | Packed):
            found += _arrays(value, beside)
    return found

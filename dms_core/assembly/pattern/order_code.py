"""Compiling what the choice of an elimination order takes, the same for every model."""

from __future__ import annotations

import numpy as np
from numba import types

from dms_core.assembly.residual import evaluate_newton, evaluate_rates
from dms_core.compiled.calls import TABLE
from dms_core.linear.lu import assemble, factor, storage
from dms_core.linear.symbolic import plan

ORDER_CODE = "dms_core.assembly.pattern.order_code:compile_order_code"


def compile_order_code() -> None:
    """Compile both matrices, and the order and factorisation of one, on a matrix of two unknowns."""
    rows, columns = np.array([0, 0, 1], np.int32), np.array([0, 1, 1], np.int32)
    values = np.array([1.0, 2.0, 3.0])
    lu = plan(2, rows, columns, values, threshold=0.1)
    a = storage(lu.size)
    assemble(lu, values, a)
    factor(lu, a, storage(lu.work_size))
    vector = types.Array(types.float64, 1, "C")
    evaluate_newton.compile(types.void(TABLE, TABLE, TABLE, TABLE, types.float64, vector))
    evaluate_rates.compile(types.void(TABLE, TABLE, TABLE, TABLE, vector))

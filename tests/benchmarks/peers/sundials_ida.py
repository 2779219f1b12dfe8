"""SUNDIALS IDA on the very same equations: our compiled residual and Jacobian, behind its own C interface.

The library comes in the wheel of scikit-sundae (`pip install --target FOLDER scikit-sundae`), whose Python interface
cannot leave algebraic variables out of the error test; so it is called by ctypes. Variables are (q, v, lam, mu) of what
a step solves for; lam and mu are algebraic and not tested; its Newton coefficient is 0.01, as with the default of 0.33
its order stays at 3. The linear solver is its dense LU.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import carray, cfunc, types

from dms_core import World
from dms_core.assembly.pattern.sparsity import NewtonPattern, newton_pattern
from dms_core.assembly.residual import evaluate_newton
from dms_core.assembly.tables import MODEL, WORK
from dms_core.compiled.arena import Packed, fields, floats, inner, ints, naturals, table_at
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.parts import PARTS, run_part, set_inputs
from dms_core.simulation.state import STATE

NEWTON_COEFFICIENT = 0.01
LIBRARIES = ("core", "nvecserial", "sunmatrixdense", "sunlinsoldense", "ida")
POINTER, LONG, DOUBLE = ctypes.c_void_p, ctypes.c_long, ctypes.c_double


class Equations(NamedTuple):
    """What the callbacks need, packed."""

    model: Packed
    world: Packed
    pattern: NewtonPattern
    """Of the Newton matrix, into `values`."""
    values: np.ndarray
    row: np.ndarray
    column: np.ndarray
    power: np.ndarray
    """The entry is values[k] c0^power[k]: the matrix of a step is scaled (sparsity.py)."""


EQUATIONS = fields(Equations)


class Counts(NamedTuple):
    """Of one run."""

    steps: int
    residuals: int
    iterations: int
    factorisations: int


def _load(folder: Path) -> ctypes.CDLL:
    """All libraries of the wheel, by one handle each; the last one is IDA's."""
    found = None
    for name in LIBRARIES:
        (path,) = folder.glob(f"scikit_sundae.libs/libsundials_{name}-*.so*")
        found = ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    assert found is not None
    return found


@compiled(makes_arrays=True)
def _put(m, s, t, y, yp):
    """Variables of IDA into the iterate."""
    w, free, active = inner(s, STATE.w), naturals(m, MODEL.free), naturals(m, MODEL.active)
    q, v, a, lam, mu = (
        floats(w, WORK.q), floats(w, WORK.v), floats(w, WORK.a), floats(w, WORK.lam), floats(w, WORK.mu),
    )  # fmt: skip
    n, k = free.shape[0], active.shape[0]
    for i in range(n):
        q[free[i]], v[free[i]], a[free[i]] = y[i], y[n + i], yp[n + i]
    for i in range(k):
        lam[active[i]], mu[active[i]] = y[2 * n + i], y[2 * n + k + i]
    set_inputs(m, s, t, True)


@compiled(makes_arrays=True)
def _residual(m, s, y, yp, out):
    """r1 to r4 of what is solved for."""
    w, free, active = inner(s, STATE.w), naturals(m, MODEL.free), naturals(m, MODEL.active)
    v, gmu, r2 = floats(w, WORK.v), floats(w, WORK.gmu), floats(w, WORK.r2)
    phi, phi_v = floats(w, WORK.phi), floats(w, WORK.phi_v)
    run_part(m, s, PARTS.residual)
    n, k = free.shape[0], active.shape[0]
    for i in range(n):
        out[i], out[n + i] = v[free[i]] - yp[i] - gmu[free[i]], r2[free[i]]
    for i in range(k):
        out[2 * n + i], out[2 * n + k + i] = phi[active[i]], phi_v[active[i]]


@compiled(makes_arrays=True)
def _jacobian(e, m, s, c0, out):
    """dF/dy + c0 dF/dydot, columns one behind the other."""
    values, n = floats(e, EQUATIONS.values), out.shape[0]
    row, column, power = ints(e, EQUATIONS.row), ints(e, EQUATIONS.column), ints(e, EQUATIONS.power)
    evaluate_newton(
        inner(m, MODEL.dynamics),
        inner(m, MODEL.constraints),
        inner(e, EQUATIONS.pattern),
        inner(s, STATE.w),
        c0,
        values,
    )
    for i in range(n):
        for j in range(n):
            out[j, i] = 0.0
    for k in range(row.shape[0]):
        out[column[k], row[k]] += values[k] * c0 ** power[k]


def _callbacks(library: ctypes.CDLL) -> tuple[Any, Any]:
    """Machine code of residual and Jacobian in IDA's form; `user` is the address of a packed `Equations`."""
    vector, dense = library.N_VGetArrayPointer, library.SUNDenseMatrix_Data
    for function in (vector, dense):
        function.argtypes, function.restype = [POINTER], ctypes.POINTER(DOUBLE)
    rows, p = len(EQUATIONS), types.voidptr

    @cfunc(types.int32(types.float64, p, p, p, types.int64))
    def residual(t, y, yp, out, user):  # noqa: ANN001, ANN202
        e = table_at(user, rows)
        m, s = inner(e, EQUATIONS.model), inner(e, EQUATIONS.world)
        size = 2 * (naturals(m, MODEL.free).shape[0] + naturals(m, MODEL.active).shape[0])
        y_now, yp_now = carray(vector(y), (size,)), carray(vector(yp), (size,))
        _put(m, s, t, y_now, yp_now)
        _residual(m, s, y_now, yp_now, carray(vector(out), (size,)))
        return 0

    @cfunc(types.int32(types.float64, types.float64, p, p, p, p, types.int64, p, p, p))
    def jacobian(t, c0, y, yp, _r, out, user, _a, _b, _c):  # noqa: ANN001, ANN202
        e = table_at(user, rows)
        m, s = inner(e, EQUATIONS.model), inner(e, EQUATIONS.world)
        size = 2 * (naturals(m, MODEL.free).shape[0] + naturals(m, MODEL.active).shape[0])
        _put(m, s, t, carray(vector(y), (size,)), carray(vector(yp), (size,)))
        _jacobian(e, m, s, c0, carray(dense(out), (size, size)))
        return 0

    return residual, jacobian


def _equations(world: World) -> Equations:
    """The world's equations; its own state is the work space."""
    known = world.tables.values
    pattern, slots = newton_pattern(world.model.layout, known.free, known.active)
    row, column = (x.astype(np.int64) for x in slots.coordinates())
    n, k = len(known.free), len(known.active)
    rows, columns = np.repeat([-1, -2, 0, -1], [n, n, k, k]), np.repeat([0, 1, 2, 1], [n, n, k, k])
    return Equations(
        world.tables, world.packed, pattern, np.zeros(len(row)), row, column, -(rows[row] + columns[column])
    )


class Ida:
    """IDA for one world at a time.

    Args:
        folder: where scikit-sundae was installed.
    """

    def __init__(self, folder: Path) -> None:
        self._lib = _load(folder)
        self._residual, self._jacobian = _callbacks(self._lib)

    def _call(self, name: str, *given: Any, gives: Any = ctypes.c_int) -> Any:
        function = getattr(self._lib, name)
        function.restype = gives
        value = function(*given)
        if gives is ctypes.c_int and value < 0:
            raise RuntimeError(f"{name} failed with {value}")
        return value

    def _vector(self, values: np.ndarray, context: Any) -> Any:
        return POINTER(
            self._call("N_VMake_Serial", LONG(len(values)), POINTER(values.ctypes.data), context, gives=POINTER)
        )

    def run(
        self,
        world: World,
        times: np.ndarray,
        rtol: float,
        atol: tuple[np.ndarray, np.ndarray],
        first: float = 0.0,
        order: int = 5,
    ) -> tuple[np.ndarray, Counts]:
        """Positions at the times, shape (k, n_q), and what they took.

        Args:
            world: at its start; its arrays are written.
            times: ascending [s].
            rtol: relative tolerance.
            atol: absolute ones of q and of v, shape (n_q,) each.
            first: first step [s]; 0 takes IDA's own.
            order: highest order of its formula.
        """
        world.settle()
        s, known = world.state, world.tables.values
        free, active = known.free, known.active
        none = np.zeros(len(active))
        y = np.concatenate([s.q[free], s.v[free], s.lam[active], none])
        yp = np.concatenate([s.v[free], s.vd[free], none, none])
        kinds = np.repeat([1.0, 0.0], [2 * len(free), 2 * len(active)])
        weights = np.concatenate([atol[0][free], atol[1][free], none + 1.0, none + 1.0])
        equations, context = Packed(_equations(world)), POINTER()
        self._call("SUNContext_Create", 0, ctypes.byref(context))
        y_, yp_, kinds_, weights_ = (self._vector(x, context) for x in (y, yp, kinds, weights))
        memory = POINTER(self._call("IDACreate", context, gives=POINTER))
        self._call("IDAInit", memory, POINTER(self._residual.address), DOUBLE(0.0), y_, yp_)
        self._call("IDASVtolerances", memory, DOUBLE(rtol), weights_)
        self._call("IDASetUserData", memory, POINTER(equations.table.ctypes.data))
        self._call("IDASetId", memory, kinds_)
        self._call("IDASetSuppressAlg", memory, 1)
        A = POINTER(self._call("SUNDenseMatrix", LONG(len(y)), LONG(len(y)), context, gives=POINTER))
        solver = POINTER(self._call("SUNLinSol_Dense", y_, A, context, gives=POINTER))
        self._call("IDASetLinearSolver", memory, solver, A)
        self._call("IDASetJacFn", memory, POINTER(self._jacobian.address))
        self._call("IDASetNonlinConvCoef", memory, DOUBLE(NEWTON_COEFFICIENT))
        self._call("IDASetMaxNumSteps", memory, LONG(10_000_000))
        self._call("IDASetInitStep", memory, DOUBLE(first))
        self._call("IDASetMaxOrd", memory, order)
        q, reached = np.tile(s.q, (len(times), 1)), DOUBLE()
        for k, t in enumerate(times):
            self._call("IDASolve", memory, DOUBLE(t), ctypes.byref(reached), y_, yp_, 1)
            q[k, free] = y[: len(free)]
        return q, Counts(*self._counts(memory))

    def _counts(self, memory: Any) -> Iterator[int]:
        for name in ("Steps", "ResEvals", "NonlinSolvIters", "LinSolvSetups"):
            value = LONG()
            self._call(f"IDAGetNum{name}", memory, ctypes.byref(value))
            yield value.value

"""The residual of eq. 2 and the sensors of eq. 5 at any state, with all their partial derivatives.

    r1 = v - qdot - phi_q^T mu        r2 = M vdot + phi_q^T lam - f        r3 = phi        r4 = phi_q v + phi_t

         by q                  qdot   v        vdot   lam        mu          u
    r1   -(phi_q^T mu)_q       -I     I        0      0          -phi_q^T    0
    r2   r2_q                  0      r2_v     r2_a   phi_q^T    0           r2_u
    r3   phi_q                 0      0        0      0          0           r3_u
    r4   (phi_q v)_q           0      phi_q    0      0          0           r4_u

over all coordinates and all rows: those of welded bodies and redundant rows, which a step leaves out, are included. An
input enters by value, rate and second derivative, so that derivatives by u have the shape (rows, n_u, 3). Units are
those of the row over those of the column: r1 as v, r2 [N, N m, or that of an element's own row], r3 [m, rad or -],
r4 that per second.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from dms_core.assembly.derivatives.input_derivatives import InputDerivatives
from dms_core.assembly.layout import Layout
from dms_core.assembly.local import (
    add_constraint_forces,
    add_dynamic_rows,
    clear,
    evaluate_constraint,
    evaluate_dynamic,
    put_constraint_values,
    views,
)
from dms_core.assembly.pattern.sparsity import Slots, block_pattern
from dms_core.assembly.readings.sensing import Partials, Sensing, evaluate_partials, evaluate_sensors
from dms_core.assembly.scatter import scatter_constraint_blocks, scatter_dynamic_blocks, scatter_projection_block
from dms_core.assembly.tables import WORK, Work
from dms_core.compiled.arena import Packed, fields, floats, matrix
from dms_core.compiled.calls import call_entry
from dms_core.compiled.jit import compiled
from dms_core.errors import InputError


class OperatingPoint(NamedTuple):
    """Where a system is looked at: a state and its inputs. Replace what is to differ with `_replace`."""

    q: np.ndarray
    """Generalised coordinates, shape (n_q,)."""
    qdot: np.ndarray
    """Their rates as the method has them, shape (n_q,); equal to v on an exact solution."""
    v: np.ndarray
    a: np.ndarray
    """vdot, shape (n_q,)."""
    lam: np.ndarray
    """Multipliers of the dynamics, shape (n_phi,)."""
    mu: np.ndarray
    """Multipliers of the projection, shape (n_phi,); 0 on an exact solution."""
    u: np.ndarray
    """Value, rate and second derivative of each input, shape (n_u, 3)."""


class Blocks(NamedTuple):
    """Residual (paper eq. 2) at one operating point, and its derivatives: sparse (CSR), by inputs dense."""

    r1: np.ndarray
    """v - qdot - phi_q^T mu, shape (n_q,)."""
    r2: np.ndarray
    """M vdot + phi_q^T lam - f, shape (n_q,)."""
    r3: np.ndarray
    """phi, shape (n_phi,)."""
    r4: np.ndarray
    """phi_q v + phi_t, shape (n_phi,)."""
    phi_q: sp.csr_array
    """r3 by q and r4 by v, shape (n_phi, n_q); its transpose is r2 by lam, and -r1 by mu."""
    r1_q: sp.csr_array
    """-(phi_q^T mu)_q, shape (n_q, n_q)."""
    r2_q: sp.csr_array
    """(M vdot - f)_q + (phi_q^T lam)_q, shape (n_q, n_q)."""
    r2_v: sp.csr_array
    r2_a: sp.csr_array
    """By vdot: the mass matrix, with what else multiplies an acceleration."""
    r4_q: sp.csr_array
    """(phi_q v)_q, shape (n_phi, n_q)."""
    r2_u: np.ndarray
    """By inputs, shape (n_q, n_u, 3): value, rate, second derivative."""
    r3_u: np.ndarray
    """Shape (n_phi, n_u, 3)."""
    r4_u: np.ndarray
    """Shape (n_phi, n_u, 3)."""
    differenced: tuple[str, ...]
    """Elements whose share of r2_u was found by differences, since they declare no `input_kernel`."""

    def newton(self, c0: float) -> sp.csr_array:
        """d(r1, r2, r3, r4) / d(q, v, lam, mu) with qdot = c0 q + ... and vdot = c0 v + ... [c0 in 1/s].

        Unlike the matrix of a step it contains (phi_q^T mu)_q, and every coordinate and row.
        """
        n = len(self.r1)
        one, G = sp.eye_array(n), self.phi_q
        return sp.csr_array(
            sp.block_array([
                [self.r1_q - c0 * one, one, None, -G.T],
                [self.r2_q, self.r2_v + c0 * self.r2_a, G.T, None],
                [G, None, None, None],
                [self.r4_q, G, None, None],
            ])
        )  # fmt: skip


class SensorBlocks(NamedTuple):
    """Sensors y = h(q, v, vdot, lam, mu, u) (paper eq. 5) at one operating point, and their derivatives, dense."""

    y: np.ndarray
    """Shape (n_y,), in the order and the units of model.layout.outputs."""
    q: np.ndarray
    """Derivative of y by q, shape (n_y, n_q)."""
    v: np.ndarray
    a: np.ndarray
    lam: np.ndarray
    """Shape (n_y, n_phi)."""
    mu: np.ndarray
    """Shape (n_y, n_phi); 0, since no sensor reads mu."""
    u: np.ndarray
    """Shape (n_y, n_u, 3): value, rate, second derivative of each input."""
    differenced: tuple[str, ...]
    """Elements whose share of u was found by differences, since they declare no `input_kernel`."""


class _Values(NamedTuple):
    """Non-zero entries of the sparse blocks, named as in sparsity.block_pattern; the last one is waste."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    mu: np.ndarray
    G: np.ndarray
    W: np.ndarray


_VALUES = fields(_Values)


@compiled(forceinline=True)
def _projection(y, calls, e, w, n):
    """H of constraint call e with mu in place of lam; False where all its mu are 0."""
    row, moved = y.row[e], False
    m = y.row[e + 1] - row
    for k in range(m):
        y.lam_l[k] = y.mu[row + k]
        y.phi_l[k] = y.phi_t_l[k, 0] = y.phi_t_l[k, 1] = 0.0
        moved = moved or y.mu[row + k] != 0.0
    if moved:
        clear(y.G, m, n)
        clear(y.W, m, n)
        clear(matrix(w, WORK.H), n, n)
        call_entry(y.kernel[e], calls, e, w, 1)
    return moved


@compiled(forceinline=True)
def scatter_projection(y, calls, pattern, e, w, n, by_mu):
    """(phi_q^T mu)_q of constraint call e, evaluated in y, into by_mu; the local arrays are written over."""
    if _projection(y, calls, e, w, n):
        scatter_projection_block(pattern, e, w, by_mu)


@compiled
def evaluate_blocks(dynamics, constraints, pattern, w, into):
    """r2, gmu, phi, phi_v at the state in w over all calls, and their derivatives into the packed `into`."""
    x, y = views(dynamics, w), views(constraints, w)
    x.r2[:] = 0.0
    x.gmu[:] = 0.0
    by_q, by_v, by_a = floats(into, _VALUES.q), floats(into, _VALUES.v), floats(into, _VALUES.a)
    by_mu, G, W = floats(into, _VALUES.mu), floats(into, _VALUES.G), floats(into, _VALUES.W)
    for values in (by_q, by_v, by_a, by_mu, G, W):
        values[:] = 0.0
    for e in range(x.kernel.shape[0]):
        n = evaluate_dynamic(x, dynamics, e, w, 1)
        add_dynamic_rows(x, e, n)
        scatter_dynamic_blocks(pattern, e, w, by_q, by_v, by_a)
    for e in range(y.kernel.shape[0]):
        n = evaluate_constraint(y, constraints, e, w, 1)
        put_constraint_values(y, e, n)
        add_constraint_forces(y, e, n)
        scatter_constraint_blocks(pattern, e, w, by_q, G, W)
        scatter_projection(y, constraints, pattern, e, w, n, by_mu)


class _Compressed:
    """A sparse matrix whose entries come in the order of their numbers: rows compressed once."""

    def __init__(self, slots: Slots, shape: tuple[int, int]) -> None:
        rows, columns = slots.coordinates()
        self._order = np.lexsort((columns, rows))
        self._columns = columns[self._order]
        self._start = np.searchsorted(rows[self._order], np.arange(shape[0] + 1)).astype(np.int32)
        self._shape = shape
        self.size = len(rows)

    def __call__(self, values: np.ndarray) -> sp.csr_array:
        """The matrix with these entries."""
        return sp.csr_array((values[self._order], self._columns, self._start), shape=self._shape)


class Derivatives:
    """Residual, sensors and their derivatives of one model; made when they are first asked for.

    One caller at a time: the work arrays of `sensing` are used.

    Args:
        layout: indices of the system's elements.
        sensing: a packed Sensing of that layout; numbers written into its tables later are read.
    """

    def __init__(self, layout: Layout, sensing: Packed) -> None:
        self._layout = layout
        self._packed_sensing = sensing
        self._sensing: Sensing = sensing.values
        pattern, slots = block_pattern(layout)
        self._pattern = Packed(pattern)
        n, m = layout.n_q, layout.n_phi
        self._csr = {name: _Compressed(s, (m if name in ("G", "W") else n, n)) for name, s in slots.items()}
        self._values = Packed(_Values(*(np.zeros(self._csr[name].size) for name in _Values._fields)))
        self.inputs = InputDerivatives(layout, sensing)

    def put(self, point: OperatingPoint) -> Work:
        """The point into the work arrays, checked; gives them.

        Raises:
            InputError: a part of the point has a wrong shape, or is not finite.
        """
        n, m, n_u = self._layout.n_q, self._layout.n_phi, len(self._layout.input_index)
        shapes = {"q": (n,), "qdot": (n,), "v": (n,), "a": (n,), "lam": (m,), "mu": (m,), "u": (n_u, 3)}
        for name, shape in shapes.items():
            value = np.asarray(getattr(point, name), float)
            if value.shape != shape:
                raise InputError(f"operating point: expected {name} of shape {shape}, got {value.shape}.")
            if not np.isfinite(value).all():
                where = tuple(map(int, np.argwhere(~np.isfinite(value))[0]))
                raise InputError(f"operating point: expected finite numbers, got {name}{list(where)} = {value[where]}.")
        w = self._sensing.work.values
        w.q[:n], w.v[:n], w.a[:n], w.lam[:], w.mu[:], w.u[:] = (
            point.q, point.v, point.a, point.lam, point.mu, point.u
        )  # fmt: skip
        return w

    def blocks(self, point: OperatingPoint) -> Blocks:
        """Residual and its derivatives at the point."""
        w, sensing, values = self.put(point), self._sensing, self._values.values
        evaluate_blocks(
            sensing.dynamics.table, sensing.constraints.table, self._pattern.table, sensing.work.table,
            self._values.table,
        )  # fmt: skip
        n, csr = self._layout.n_q, self._csr
        r1, r2 = point.v - point.qdot - w.gmu[:n], w.r2[:n].copy()
        r3, r4 = w.phi.copy(), w.phi_v.copy()
        r2_u, r3_u, r4_u = self.inputs.of_residual()
        return Blocks(
            r1, r2, r3, r4, phi_q=csr["G"](values.G), r1_q=-csr["mu"](values.mu), r2_q=csr["q"](values.q),
            r2_v=csr["v"](values.v), r2_a=csr["a"](values.a), r4_q=csr["W"](values.W), r2_u=r2_u, r3_u=r3_u, r4_u=r4_u,
            differenced=self.inputs.differenced,
        )  # fmt: skip

    def sensor_blocks(self, point: OperatingPoint) -> SensorBlocks:
        """Sensors and their derivatives at the point."""
        w = self.put(point)
        partials = self.partials()
        n_y = len(self._layout.outputs)
        evaluate_sensors(self._packed_sensing.table)
        u = self.inputs.of_moments()
        u[:, :, 0] += partials.u
        n = self._layout.n_q
        return SensorBlocks(
            w.y.copy(), partials.q[:, :n], partials.v[:, :n], partials.a[:, :n], partials.lam,
            np.zeros((n_y, self._layout.n_phi)), u, self.inputs.differenced,
        )  # fmt: skip

    def moments_by_inputs(self, point: OperatingPoint, rows: Sequence[int]) -> np.ndarray:
        """What inputs do to these sensors through the elements that they sum, shape (len(rows), n_u, 3)."""
        self.put(point)
        return self.inputs.of_moments(rows)[rows]

    def partials(self) -> Partials:
        """Derivatives of the sensors at the state in the work arrays, the ground's columns included.

        What inputs do through the elements that a sensor sums is not in u; see InputDerivatives.of_moments.
        """
        sensing, layout, n = self._sensing, self._layout, self._layout.n_q
        shapes = (n + 7, n + 7, n + 7, layout.n_phi, len(layout.input_index))
        into = Partials(*(np.zeros((len(layout.outputs), k)) for k in shapes))
        evaluate_partials(
            sensing.dynamics.table, sensing.constraints.table, sensing.sensors.table, sensing.composed.table,
            sensing.work.table, Packed(into).table,
        )  # fmt: skip
        return into

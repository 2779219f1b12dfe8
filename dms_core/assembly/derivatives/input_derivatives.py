"""Derivatives of the residual and of composed sensors by the inputs: value, rate and second derivative of each.

An element's `input_kernel` gives them (model/element.py). Where it has none, its kernel is differenced,

    Ju[i, k, j] = (r_i(u_kj + h) - r_i(u_kj - h)) / 2 h,   h = STEP max(1, |u_kj|)

which errs by about 1e-10 of the row over the size of the input where the row is smooth, and is a mean of both slopes
across a kink that lies within h. A constraint tells its derivative by itself: with inputs that enter additively,
phi = g(q) + s(u), what it writes into phi_t is linear in the rates and quadratic in them for the second derivative,

    phi_t = s_u udot,     phi_tt = udot^T s_uu udot + s_u uddot
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from dms_core.assembly.layout import Call, Layout
from dms_core.assembly.local import clear, gather, views
from dms_core.assembly.readings.sensing import Sensing
from dms_core.compiled.arena import Packed, matrix
from dms_core.compiled.calls import call_entry
from dms_core.compiled.entries import SLOPES, Slopes, derivative_addresses
from dms_core.compiled.jit import compiled
from dms_core.model.element import COMPOSITIONS, INPUT_DERIVATIVE, MOMENT

STEP = float(np.finfo(float).eps) ** (1.0 / 3.0)
"""Difference step over the size of what is changed, 6e-6: truncation and rounding of a central difference are then both
about 4e-11 of the value."""


@compiled
def _difference(x, calls, e, w, n, k, j, Ju):
    """Column (k, j) of Ju by central differences of the kernel of call e, whose local arrays are filled."""
    before = x.u_l[k, j]
    h = STEP * max(1.0, abs(before))
    high, low = before + h, before - h
    for sign in (1.0, -1.0):
        x.u_l[k, j] = high if sign > 0.0 else low
        for i in range(n):
            x.r_l[i] = 0.0
        call_entry(x.kernel[e], calls, e, w, 0)
        for i in range(n):
            Ju[i, 3 * k + j] += sign * x.r_l[i] / (high - low)
    x.u_l[k, j] = before


@compiled
def dynamic_by_input(calls, kernels, e, w, slopes):
    """Ju of dynamic call e at the state in w, into the packed Slopes; kernels[e] = 0 asks for differences."""
    x, Ju = views(calls, w), matrix(slopes, SLOPES.Ju)
    n = gather(x, e, True)
    clear(Ju, Ju.shape[0], Ju.shape[1])
    if kernels[e] != 0:
        call_entry(kernels[e], calls, e, slopes, 1)
        return
    for k in range(x.iu_ptr[e + 1] - x.iu_ptr[e]):
        for j in range(3):
            _difference(x, calls, e, w, n, k, j, Ju)


@compiled
def _constraint_at_rates(x, calls, e, w, m, n, rates, inputs):
    """phi_t of constraint call e for these rates of its inputs, without second derivatives."""
    for k in range(inputs):
        x.u_l[k, 1], x.u_l[k, 2] = rates[k], 0.0
    clear(x.G, m, n)
    for i in range(m):
        x.phi_l[i] = x.phi_t_l[i, 0] = x.phi_t_l[i, 1] = 0.0
    call_entry(x.kernel[e], calls, e, w, 0)


@compiled
def constraint_by_input(calls, e, w, out):
    """s_u and (s_u udot)_u of constraint call e at the state in w, shapes (m, k), in the first 2 m rows of `out`.

    What follows there is written over: `out` has 2 m + 4 rows and as many columns as m and k at least.
    """
    x = views(calls, w)
    n, m, inputs = gather(x, e, False), x.row[e + 1] - x.row[e], x.iu_ptr[e + 1] - x.iu_ptr[e]
    rates, unit, both, square = out[2 * m], out[2 * m + 1], out[2 * m + 2], out[2 * m + 3]
    for k in range(inputs):
        rates[k], unit[k] = x.u_l[k, 1], 0.0
    _constraint_at_rates(x, calls, e, w, m, n, rates, inputs)
    for i in range(m):
        square[i] = x.phi_t_l[i, 1]
    for k in range(inputs):
        for j in range(inputs):
            both[j] = rates[j]
        both[k] += 1.0
        unit[k] = 1.0
        # The mixed term of a quadratic form from its values: B(e, r) = (Q(e + r) - Q(e) - Q(r)) / 2.
        _constraint_at_rates(x, calls, e, w, m, n, both, inputs)
        for i in range(m):
            out[m + i, k] = x.phi_t_l[i, 1] - square[i]
        _constraint_at_rates(x, calls, e, w, m, n, unit, inputs)
        for i in range(m):
            out[i, k] = x.phi_t_l[i, 0]
            out[m + i, k] = 0.5 * (out[m + i, k] - x.phi_t_l[i, 1])
        unit[k] = 0.0


class InputDerivatives:
    """Derivatives by inputs at the state in the work arrays of `sensing`.

    Args:
        layout: indices of the system's elements.
        sensing: a packed Sensing of that layout; numbers written into its tables later are read.

    Attributes:
        kernels: addresses of the input kernels of all dynamic calls, 0 where there is none, shape (n_calls,).
        dynamics: dynamic calls that read an input that is given.
        constraints: constraint calls that read an input.
        differenced: names of the elements without an `input_kernel` of their own, whose kernels are differenced.
    """

    def __init__(self, layout: Layout, sensing: Packed) -> None:
        self._layout = layout
        self._sensing: Sensing = sensing.values
        self.kernels = derivative_addresses(layout.dynamics, "input_kernel", INPUT_DERIVATIVE)
        # By an input that an element drives every derivative is 0.
        free = layout.input_index.keys() - layout.driven.keys()
        reading = [e for e, c in enumerate(layout.dynamics) if free.intersection(c.placement.inputs)]
        self.dynamics = reading
        self.constraints = [e for e, c in enumerate(layout.constraints) if len(c.iu)]
        self.differenced = tuple(dict.fromkeys(layout.dynamics[e].element.name for e in reading if not self.kernels[e]))
        work = self._sensing.work.values
        n, k = len(work.q_l), len(work.u_l)
        slopes = Slopes(work.q_l, work.v_l, work.a_l, work.u_l, np.zeros((n, 3 * k)), np.zeros((n, 1)))
        self._slopes = Packed(slopes)
        self._moments = [(c, self._sources(c)) for c in layout.sensors if c.placement.sources]

    def _sources(self, sensor: Call) -> list[int]:
        """Dynamic calls that read inputs, of the elements that a composed sensor sums."""
        calls = self._layout.dynamics
        return [e for e in self.dynamics if calls[e].element.name in sensor.placement.sources]

    def _of_call(self, e: int) -> np.ndarray:
        """Ju of dynamic call e, shape (n, k, 3)."""
        call, sensing = self._layout.dynamics[e], self._sensing
        dynamic_by_input(sensing.dynamics.table, self.kernels, e, sensing.work.table, self._slopes.table)
        Ju = self._slopes.values.Ju
        return Ju.reshape(len(Ju), -1, 3)[: len(call.iq), : len(call.iu)]

    def of_residual(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(r2_u, r3_u, r4_u), shapes (n_q, n_u, 3), (n_phi, n_u, 3) twice."""
        layout, sensing = self._layout, self._sensing
        n_u = len(layout.input_index)
        r2 = np.zeros((layout.n_q + 7, n_u, 3))
        for e in self.dynamics:
            call = layout.dynamics[e]
            np.add.at(r2, (call.iq[:, None], call.iu[None, :]), self._of_call(e))
        r3, r4 = np.zeros((layout.n_phi, n_u, 3)), np.zeros((layout.n_phi, n_u, 3))
        for e in self.constraints:
            call = layout.constraints[e]
            out = np.zeros((2 * call.rows + 4, max(call.rows, len(call.iu))))
            constraint_by_input(sensing.constraints.table, e, sensing.work.table, out)
            by_value, rate_by_value = out[: call.rows], out[call.rows : 2 * call.rows]
            rows = slice(call.row, call.row + call.rows)
            for k, into in enumerate(call.iu):
                r3[rows, into, 0] += by_value[:, k]
                r4[rows, into, 1] += by_value[:, k]
                r4[rows, into, 0] += rate_by_value[:, k]
        return r2[: layout.n_q], r3, r4

    def moments_read(self, rows: Collection[int]) -> set[int]:
        """Inputs that move any of these components of sensors through an element that it sums."""
        return {
            int(k) for sensor, sources in self._moments
            if any(sensor.row <= row < sensor.row + sensor.rows for row in rows)
            for e in sources for k in self._layout.dynamics[e].iu
        }  # fmt: skip

    def of_moments(self, asked: Collection[int] | None = None) -> np.ndarray:
        """What the inputs of summed elements add to composed sensors, shape (n_y, n_u, 3); other rows are 0.

        Args:
            asked: components of sensors that are wanted, all if None.
        """
        layout = self._layout
        y = np.zeros((len(layout.outputs), len(layout.input_index), 3))
        q = self._sensing.work.values.q
        for sensor, sources in self._moments:
            if asked is not None and not any(sensor.row <= k < sensor.row + sensor.rows for k in asked):
                continue
            for e in sources:
                call = layout.dynamics[e]
                if sensor.element.composition == COMPOSITIONS.force_load:  # type: ignore[union-attr]
                    for k, load in enumerate(np.moveaxis(self._load(sensor, call, e, q), 1, 0)):
                        y[sensor.row : sensor.row + 6, call.iu[k]] -= load
                else:
                    np.add.at(y[sensor.row], call.iu, -self._moment(sensor, call, e, q))
        return y

    def _load(self, sensor: Call, call: Call, e: int, q: np.ndarray) -> np.ndarray:
        """Force and moment of the columns of Ju on the sensor's body, in its frame, shape (6, k, 3)."""
        own, frame = q[sensor.iq[:7]], sensor.placement.integers[0]
        arm, total = _turned(own[3:], np.array(sensor.placement.numbers)), np.zeros((6, len(call.iu), 3))
        axes = (
            np.eye(3) if frame < 0 else np.array([_turned(q[sensor.iq[frame + 3 : frame + 7]], x) for x in np.eye(3)])
        )
        Ju = self._of_call(e)
        for o in range(0, 7 * len(call.placement.bodies), 7):
            if call.iq[o] == sensor.iq[0]:
                load = np.moveaxis(Ju[o : o + 7], 0, -1)
                force, moment = load[..., :3], _ground_moment(own, load) - np.cross(arm, load[..., :3])
                total += np.concatenate([np.moveaxis(x @ axes.T, -1, 0) for x in (force, moment)])
        return total

    def _moment(self, sensor: Call, call: Call, e: int, q: np.ndarray) -> np.ndarray:
        """Moment about the sensor's axis of the columns of Ju on its distal bodies, shape (k, 3)."""
        base, numbers = q[sensor.iq[:7]], np.array(sensor.placement.numbers)
        Ju, total = self._of_call(e), np.zeros((len(call.iu), 3))
        if not Ju[: 7 * len(call.placement.bodies)].any():
            # The input of a muscle moves its activation, and no body at once.
            return total
        centre = base[:3] + _turned(base[3:], numbers[MOMENT.centre : MOMENT.centre + 3])
        axis = _turned(base[3:], numbers[MOMENT.axis : MOMENT.axis + 3])
        for o in range(0, 7 * len(call.placement.bodies), 7):
            if call.iq[o] in sensor.iq[7::7]:
                own, load = q[call.iq[o : o + 7]], np.moveaxis(Ju[o : o + 7], 0, -1)
                total += (np.cross(own[:3] - centre, load[..., :3]) + _ground_moment(own, load)) @ axis
        return total


def _ground_moment(own: np.ndarray, load: np.ndarray) -> np.ndarray:
    """E(p) Q_p / 2 of generalised loads (..., 7) on a body with the coordinates `own`, shape (..., 3)."""
    e0, ev, rest = own[3], own[4:], load[..., 4:]
    return 0.5 * (-load[..., 3:4] * ev + e0 * rest + np.cross(ev, rest))


def _turned(p: np.ndarray, s: np.ndarray) -> np.ndarray:
    """A(p) s for Euler parameters p that need not be of unit length."""
    e = p[1:]
    return (p[0] * p[0] - e @ e) * s + 2.0 * (e @ s) * e + 2.0 * p[0] * np.cross(e, s)

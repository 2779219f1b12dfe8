"""Extended Kalman filter in the tangent space of the constraints (e.g. Simon 2006, ch. 13; Joseph form, sect. 5.1).

The state is q, v on the constraints; its covariance is that of the chart x = (z, w, s) of independent coordinates, with
the estimated inputs u, constants p and channels' biases b behind. A period

    x1 = f(x0, u, p) by the model's own implicit steps,    u1 = m + F (u0 - m),    P1 = A P0 A^T + Q

and a correction, C from the sensors' analytic partial derivatives through accelerations and multipliers,

    S = C P C^T + R,  K = P C^T S^-1,  x += K (y - h(x)),  P = (1 - K C) P (1 - K C)^T + K R K^T

after which q and v are those on the constraints that have the corrected z, w and s: no constraint is ever a
measurement. `iterated` repeats the correction about what it gave (Bell and Cathey 1993); `unscented` (unscented.py)
takes both from 2 n points instead of derivatives. A bounded component that a correction leaves outside is cut there
(`gaussian.truncated`); inside its bounds nothing is done, so that the same bound is not counted as news each time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import system_with
from dms_core.assembly.model import Model
from dms_core.errors import SimulationError
from dms_core.estimation.estimated import Belief, Estimated
from dms_core.estimation.filter.charts import chart_at, placed
from dms_core.estimation.filter.gaussian import corrected, gain, is_usable, truncated
from dms_core.estimation.filter.nominal_world import NominalWorld
from dms_core.estimation.filter.transition import (
    MovedNumber,
    Transitions,
    difference_step,
    in_chart,
    linear_here,
    moved_number,
)
from dms_core.estimation.settings import FilterSettings

ITERATIONS, SMALL = 20, 1e-9
"""Corrections of the iterated form, and the last one over the deviations."""
PASSES = 20
"""Rounds in which bounds are looked at: two or three are enough for two components that are strongly correlated."""


@dataclass(frozen=True)
class Predicted:
    """A belief at the end of a period."""

    belief: Belief
    joint: np.ndarray
    """Covariance of begin and end, Cov(x0, x1) = P0 A^T, shape (n0, n1)."""
    A: np.ndarray
    """Derivative of (x, rest) at the end by that at the begin, shape (n1, n0)."""


@dataclass(frozen=True)
class Readout:
    """All sensors of a belief."""

    y: np.ndarray
    """Shape (n_y,)."""
    C: np.ndarray
    """By (x, rest) without biases, shape (n_y, n)."""


@dataclass(frozen=True)
class Correction:
    """A belief behind a measurement."""

    belief: Belief
    nis: float
    residual: np.ndarray
    """Reading less what was expected, of the channels that told something."""


class KalmanFilter:
    """The extended or iterated filter of a model.

    Args:
        model: a compiled model; the numbers that are estimated are written into it.
        settings: of the filter.

    Raises:
        InputError: settings that do not fit the model.

    Example:
        >>> kalman = KalmanFilter(Model(system), FilterSettings.from_file("filter.yaml"))
        >>> belief = kalman.correct(kalman.start(), {"swing.angle": 0.31}).belief
        >>> belief = kalman.predict(belief, 0.01).belief
    """

    def __init__(self, model: Model, settings: FilterSettings) -> None:
        self.model, self.settings = model, settings
        self.world = NominalWorld(model)
        self.estimated = Estimated(model, settings)
        self._transitions = Transitions(self.world, self.estimated.inputs)
        self._mean = self.estimated.start
        self.known: dict[int, float] = {}
        """Values of known inputs, by their places."""
        self.turned = np.array([unit == "rad" for _, unit in model.layout.outputs], bool)
        """Whether each sensor component is an angle, of which the nearest turn counts, shape (n_y,)."""

    def start(self, t: float = 0.0) -> Belief:
        """The model's assembled start at a time [s], with the covariance of the settings.

        Raises:
            InputError: the covariance is not positive definite.
        """
        start = self.model.start
        chart = chart_at(self.model, start.q, start.v, t)
        belief = Belief(
            t, start.q.copy(), start.v.copy(), self._mean.copy(), chart, self.estimated.first_covariance(chart)
        )
        # Drivers may have moved since the start was assembled at 0.
        return self.here(self.moved(belief, belief.mean)) if t > 0.0 else belief

    def hold(self, values: dict[int, float]) -> None:
        """Known values of inputs from now on, by their places."""
        self.known.update(values)

    def put(self, belief: Belief) -> None:
        """The world at a belief, with its inputs and numbers."""
        self.world.put_numbers(self.estimated.numbers(belief.rest))
        self.world.put(belief.q, belief.v, belief.t)
        self.world.put_inputs({**self.known, **self.estimated.input_values(belief.rest)})

    def predict(self, belief: Belief, t: float) -> Predicted:
        """A belief at a later time [s].

        Raises:
            SimulationError: the equations cannot be solved on the way.
        """
        es = self.estimated
        dt = t - belief.t
        steps = self._steps(dt)
        self.put(belief)
        end = self._transitions.over(belief.chart, t, steps, self._moved_numbers(belief))
        n0, n1, m = belief.chart.size, end.chart.size, len(belief.rest)
        A = np.zeros((n1 + m, n0 + m))
        A[:n1, :n0], A[:n1, n0 : n0 + len(es.inputs)] = end.A, end.B
        A[:n1, n0 + len(es.inputs) : n0 + len(es.inputs) + len(es.constants)] = end.D
        F = es.factors(dt)
        A[n1:, n0:] = np.diag(F)
        rest = self._mean + F * (belief.rest - self._mean)
        P = A @ belief.P @ A.T + es.noise(end.chart, dt)
        return Predicted(Belief(t, end.q, end.v, rest, end.chart, 0.5 * (P + P.T)), belief.P @ A.T, A)

    def _moved_numbers(self, belief: Belief) -> list[MovedNumber]:
        """The constants, at the belief at which the world is."""
        if not self.estimated.constants:
            return []
        system = system_with(self.model.system, self.estimated.numbers(belief.rest))
        return [moved_number(self.world, belief.chart, key, system) for key in self.estimated.constants]

    def _steps(self, dt: float) -> int:
        """Implicit steps of a time [s]: as many as a period has, fewer of a part of it."""
        return max(1, int(np.ceil(self.settings.steps * dt / self.settings.period * (1.0 - 1e-9))))

    def _end(self, belief: Belief, t: float) -> tuple[np.ndarray, np.ndarray]:
        """q and v at a later time [s]."""
        self.put(belief)
        self.world.go(t, self._steps(t - belief.t))
        return self.world.state.q.copy(), self.world.state.v.copy()

    def moved_on(self, belief: Belief, t: float) -> Belief:
        """The mean at a later time [s], without a covariance of its own."""
        q, v = self._end(belief, t)
        rest = self._mean + self.estimated.factors(t - belief.t) * (belief.rest - self._mean)
        return replace(belief, t=t, q=q, v=v, rest=rest, chart=chart_at(self.model, q, v, t, belief.chart))

    def _by_constant(self, belief: Belief, k: int, value, turned: np.ndarray | bool = False) -> np.ndarray:  # noqa: ANN001
        """Central difference of value(belief) by constant k, at the same x; of angles that of the nearest turn."""
        place = len(self.estimated.inputs) + k
        h = difference_step(float(belief.rest[place]))
        ends = []
        for sign in (1.0, -1.0):
            rest = belief.rest.copy()
            rest[place] += sign * h
            ends.append(value(self.moved(belief, np.concatenate([belief.chart.read(belief.q, belief.v), rest]))))
        return nearest(ends[0] - ends[1], turned) / (2.0 * h)

    def moved(self, belief: Belief, x: np.ndarray) -> Belief:
        """The belief with another mean (x of the chart, rest), on the constraints; P and chart stay.

        Raises:
            SimulationError: no state on the constraints is near.
        """
        n = belief.chart.size
        self.world.put_numbers(self.estimated.numbers(x[n:]))
        q, v = placed(belief.chart, x[:n], belief.q, belief.v, belief.t)
        return replace(belief, q=q, v=v, rest=x[n:].copy())

    def read(self, belief: Belief) -> np.ndarray:
        """All sensors of a belief, shape (n_y,)."""
        self.put(belief)
        self.world.settled()
        return self.world.read()

    def read_out(self, belief: Belief) -> Readout:
        """All sensors and their derivatives by (x, rest)."""
        self.put(belief)
        linear, es = linear_here(self.world), self.estimated
        n, first = belief.chart.size, belief.chart.size + len(es.inputs)
        C = np.zeros((len(linear.y), n + len(belief.rest)))
        C[:, :n], C[:, n:first] = linear.C @ in_chart(belief.chart, linear), linear.D[:, es.inputs]
        for k in range(len(es.constants)):
            C[:, first + k] = self._by_constant(belief, k, self.read, self.turned)
        return Readout(linear.y, C)

    def correct(self, belief: Belief, readings: dict[str, float]) -> Correction:
        """The belief behind readings of channels, by name, in SI units.

        Those that are no finite number tell nothing, and nor do sensors that are no channel of the settings.

        Raises:
            InputError: the model has no sensor of a name.
            SimulationError: no state on the constraints is near the corrected one, or the result is not finite.
        """
        taken = self.estimated.readings(readings)
        names = [name for name, x in zip(self.settings.channels, taken, strict=True) if not np.isnan(x)]
        if not names:
            return Correction(belief, 0.0, np.zeros(0))
        y = taken[~np.isnan(taken)]
        R = np.diag([self.settings.channels[name].variance for name in names])
        result = self._corrected(belief, names, y, R)
        bounded = self.within_bounds(result.belief)
        if not (is_usable(bounded.P) and np.isfinite(bounded.mean).all()):
            raise SimulationError(f"the covariance is not positive definite at t = {belief.t:.6g} s.")
        return replace(result, belief=self.here(bounded))

    def here(self, belief: Belief) -> Belief:
        """The belief with the chart of the same coordinates at its own state, where its mean was moved."""
        return replace(belief, chart=chart_at(self.model, belief.q, belief.v, belief.t, belief.chart, keep=True))

    def expected(self, belief: Belief, names: list[str]) -> tuple[np.ndarray, np.ndarray]:
        """What channels should show, and its derivative by (x, rest)."""
        out = self.read_out(belief)
        at, b = [self.estimated.outputs[name] for name in names], self.estimated.biases(names)
        C = out.C[at].copy()
        C[:, belief.chart.size :] += b
        return out.y[at] + b @ belief.rest, C

    def residual(self, names: list[str], y: np.ndarray, expected: np.ndarray) -> np.ndarray:
        """y less what was expected, shape (..., names); of angles the nearest turn."""
        return nearest(y - expected, self.turned[[self.estimated.outputs[name] for name in names]])

    def difference(self, y: np.ndarray, less: np.ndarray) -> np.ndarray:
        """Difference of readings of all channels, shape (k, channels)."""
        return self.residual(list(self.settings.channels), y, less)

    def _corrected(self, belief: Belief, names: list[str], y: np.ndarray, R: np.ndarray) -> Correction:
        """Extended form, repeated in the iterated one."""
        expected, C = self.expected(belief, names)
        r = self.residual(names, y, expected)
        found, start = corrected(belief.P, C, R, r), belief.mean
        x, P = start + found.dx, found.P
        here = self.here(self.moved(belief, x))
        for _ in range(ITERATIONS if self.settings.form == "iterated" else 0):
            expected, C = self.expected(here, names)
            K, _ = gain(belief.P, C, R)
            last, x = x, start + K @ (self.residual(names, y, expected) - C @ (start - x))
            P = corrected(belief.P, C, R, r).P
            here = self.here(self.moved(here, x))
            if np.max(np.abs(x - last) / belief.deviations) < SMALL:
                break
        return Correction(replace(here, P=P), found.nis, r)

    def within_bounds(self, belief: Belief) -> Belief:
        """The belief with what lies outside its bounds cut there.

        A cut moves what is correlated, too, perhaps out of bounds that were kept; so all are looked at again. What is
        outside still behind the last pass is put onto its bound.
        """
        x, P = belief.mean, belief.P
        bounds = self.estimated.bounds(belief.chart)
        outside = False
        for _ in range(PASSES):
            if all(low <= x[k] <= high for k, low, high in bounds):
                break
            outside = True
            for k, low, high in bounds:
                if not low <= x[k] <= high:
                    dx, P = truncated(P, k, float(x[k]), low, high)
                    x = x + dx
        for k, low, high in bounds:
            x[k] = min(max(x[k], low), high)
        return replace(self.moved(belief, x), P=P) if outside else belief


def nearest(difference: np.ndarray, turned: np.ndarray | bool) -> np.ndarray:
    """A difference of readings; where `turned`, of angles, that to the nearest turn."""
    return np.where(turned, difference - 2.0 * np.pi * np.round(difference / (2.0 * np.pi)), difference)

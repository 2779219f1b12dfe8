"""What is estimated: x = (chart of the state, inputs, constants, biases), its names, its start, and what drives it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import declared_number
from dms_core.assembly.model import Model
from dms_core.errors import InputError, choices
from dms_core.estimation.filter.charts import Chart
from dms_core.estimation.filter.nominal_world import declared_constant, held_input
from dms_core.estimation.settings import FilterSettings, checked_covariance


@dataclass(frozen=True)
class Belief:
    """What a filter holds to be true at one time: a state on the constraints, what goes with it, and a covariance."""

    t: float
    """Time [s]."""
    q: np.ndarray
    """Shape (n_q,)."""
    v: np.ndarray
    rest: np.ndarray
    """Inputs, constants, biases, in this order."""
    chart: Chart
    P: np.ndarray
    """Covariance of (x of the chart, rest), shape (n, n)."""

    @property
    def mean(self) -> np.ndarray:
        """(x of the chart, rest), shape (n,)."""
        return np.concatenate([self.chart.read(self.q, self.v), self.rest])

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations of (x of the chart, rest), shape (n,)."""
        return np.sqrt(np.maximum(np.diag(self.P), 0.0))

    @property
    def columns(self) -> tuple[np.ndarray, np.ndarray]:
        """dq and dv by (x of the chart, rest), shape (n_q, n) each."""
        nothing = np.zeros((len(self.q), len(self.rest)))
        return np.hstack([self.chart.dq, nothing]), np.hstack([self.chart.dv, nothing])


def finite_or_missing(readings: np.ndarray) -> np.ndarray:
    """Readings with NaN, which tells nothing, in place of what is no finite number."""
    return np.where(np.isfinite(readings), readings, np.nan)


class Estimated:
    """Names and places of what is estimated, and the noise that drives it.

    Args:
        model: a compiled model.
        settings: of the filter.

    Raises:
        InputError: a channel, an input, a constant, a coordinate or a bound that the model does not have.
    """

    def __init__(self, model: Model, settings: FilterSettings) -> None:
        self.model, self.settings = model, settings
        self.inputs = [held_input(model, name, "inputs") for name in settings.inputs]
        """Places of the estimated inputs."""
        self.constants = [declared_constant(model, name) for name in settings.constants]
        """Element and path of each estimated constant."""
        self.outputs = {name: k for k, (name, _) in enumerate(model.layout.outputs)}
        for name in settings.channels:
            if name not in self.outputs:
                raise InputError(f"channels: the model has no sensor '{name}'. There are: {choices(self.outputs)}.")
        self.biased = [name for name, channel in settings.channels.items() if channel.bias is not None]
        """Channels whose bias is estimated."""
        self._check_coordinates()

    def readings(self, given: Mapping[str, float]) -> np.ndarray:
        """Readings in the order of the channels, NaN where there is none or no finite number, shape (channels,).

        Sensors of the model that are no channel tell nothing.

        Raises:
            InputError: the model has no sensor of a name.
        """
        for name in given:
            if name not in self.outputs:
                raise InputError(
                    f"readings: the model has no sensor '{name}'. The channels are: {choices(self.settings.channels)}."
                )
        return finite_or_missing(np.array([given.get(name, np.nan) for name in self.settings.channels], float))

    @cached_property
    def rest_names(self) -> tuple[str, ...]:
        """Names of inputs, constants and biases."""
        s = self.settings
        return (*(f"input.{x}" for x in s.inputs), *(f"constant.{x}" for x in s.constants),
                *(f"bias.{x}" for x in self.biased))  # fmt: skip

    def names(self, chart: Chart) -> tuple[str, ...]:
        """Names of (x of the chart, rest)."""
        return (*chart.names, *self.rest_names)

    def _check_coordinates(self) -> None:
        """Refuse coordinates that the model does not have, and bounds of what cannot be bounded."""
        settings, index = self.settings, self.model.layout.index
        both = {f"{kind}.{name}" for kind in "qv" for name in index}
        for what, given, known in (
            ("noise.coordinates", settings.noise.coordinates, set(index)),
            ("initial.coordinates", settings.initial.coordinates, both),
        ):
            for name in given:
                if name not in known:
                    raise InputError(f"{what}: the model has no coordinate '{name}'. There are: {choices(known)}.")
        first = {f"q.{name}" for name, k in index.items() if not self.model.second_order[k]}
        allowed = {x.partition(".")[2] for x in (*first, *self.rest_names)}
        for name in settings.bounds:
            if name not in allowed:
                raise InputError(
                    f"bounds: '{name}' is no state of first order, and no input or constant that is estimated. There "
                    f"are: {choices(allowed)}."
                )

    def bounds(self, chart: Chart) -> list[tuple[int, float, float]]:
        """Place, least and largest value of what is bounded."""
        found = []
        for k, name in enumerate(self.names(chart)):
            low, high = self.settings.bounds.get(name.partition(".")[2], (None, None))
            if (low, high) != (None, None) and not name.startswith("v."):
                found.append((k, -np.inf if low is None else low, np.inf if high is None else high))
        return found

    @property
    def start(self) -> np.ndarray:
        """Declared values of inputs and constants, and biases of 0."""
        system, settings = self.model.system, self.settings
        inputs = [float(system.inputs[k].signal.value) for k in self.inputs]
        from_declarations = [declared_number(system, *where) for where in self.constants]
        assert len(settings.constants) == len(from_declarations)
        return np.array([*inputs, *from_declarations, *([0.0] * len(self.biased))])

    def input_values(self, rest: np.ndarray) -> dict[int, float]:
        """Values of the estimated inputs, by their places."""
        return dict(zip(self.inputs, map(float, rest), strict=False))

    def numbers(self, rest: np.ndarray) -> dict[tuple[str, str], float]:
        """Values of the estimated constants."""
        values = rest[len(self.inputs) : len(self.inputs) + len(self.constants)]
        return dict(zip(self.constants, map(float, values), strict=True))

    def first_covariance(self, chart: Chart) -> np.ndarray:
        """Covariance of the start, shape (n, n).

        Deviations of coordinates are taken along the motions that the constraints allow: T T^T diag(s^2) T T^T with T
        an orthonormal basis of them.

        Raises:
            InputError: a given matrix is not positive definite (names the entry), or there is nothing to estimate.
        """
        settings, names = self.settings.initial, self.names(chart)
        if not names:
            raise InputError(
                f"system '{self.model.system.name}' has nothing to estimate: drivers move all its freedoms. Expected a "
                "free motion, a state, or inputs, constants or biases in the settings."
            )
        if settings.covariance is not None:
            return checked_covariance("initial.covariance", names, np.array(settings.covariance, ndmin=2))
        position = self._by_coordinate(settings.position, settings.state, settings.coordinates, "q.")
        velocity = self._by_coordinate(settings.velocity, settings.state, settings.coordinates, "v.")
        P = np.zeros((len(names), len(names)))
        n = len(chart.chosen)
        P[:n, :n], P[n : 2 * n, n : 2 * n] = self._along(chart, position), self._along(chart, velocity)
        at = np.arange(2 * n, chart.size)
        P[at, at] = position[chart.first] ** 2
        at = np.arange(chart.size, len(names))
        P[at, at] = np.array([*self._rest_deviations()]) ** 2
        return checked_covariance("the covariance of the start", names, P)

    def _rest_deviations(self) -> list[float]:
        """At the start, of inputs, constants and biases."""
        s = self.settings
        biases = [s.channels[name].bias.deviation for name in self.biased]  # type: ignore[union-attr]
        return [*(x.deviation for x in s.inputs.values()), *(x.deviation for x in s.constants.values()), *biases]

    def _by_coordinate(self, common: float, first: float, named: dict[str, float], prefix: str) -> np.ndarray:
        """A number for each coordinate: the common one of its order, or its own."""
        found = np.where(self.model.second_order, common, first)
        for name, k in self.model.layout.index.items():
            found[k] = named.get(f"{prefix}{name}", found[k])
        return found

    def _along(self, chart: Chart, deviations: np.ndarray) -> np.ndarray:
        """Covariance of the independent coordinates where all have these deviations along the motions allowed."""
        if not len(chart.chosen):
            return np.zeros((0, 0))
        second = np.flatnonzero(self.model.second_order)
        place = {int(k): i for i, k in enumerate(second)}
        # Motions allowed: the span of N.
        T = np.linalg.qr(chart.N[second])[0]
        whole = T @ (T.T @ np.diag(deviations[second] ** 2) @ T) @ T.T
        at = [place[int(k)] for k in chart.chosen]
        return whole[np.ix_(at, at)]

    def noise(self, chart: Chart, dt: float) -> np.ndarray:
        """Covariance that joins over a time [s], at its end, shape (n, n); inputs and constants are held on the way."""
        s, names = self.settings, self.names(chart)
        Q = np.zeros((len(names), len(names)))
        intensity = self.intensities
        n = len(chart.chosen)
        W = self._along(chart, intensity)
        Q[:n, :n], Q[:n, n : 2 * n] = W * dt**3 / 3.0, W * dt**2 / 2.0
        Q[n : 2 * n, :n], Q[n : 2 * n, n : 2 * n] = W * dt**2 / 2.0, W * dt
        at = np.arange(2 * n, chart.size)
        Q[at, at] = intensity[chart.first] ** 2 * dt
        at = np.arange(chart.size, len(names))
        walks = [s.channels[name].bias.walk for name in self.biased]  # type: ignore[union-attr]
        joined = [x.over(dt)[1] for x in s.inputs.values()]
        Q[at, at] = [*joined, *(x**2 * dt for x in (*(c.walk for c in s.constants.values()), *walks))]
        return Q

    @property
    def intensities(self) -> np.ndarray:
        """Noise that drives each coordinate, per square root of a second, shape (n_q,)."""
        noise = self.settings.noise
        return self._by_coordinate(noise.acceleration, noise.rate, noise.coordinates, "")

    def factors(self, dt: float) -> np.ndarray:
        """Factors of what is estimated beside the state over a time [s], about `start`."""
        inputs = [x.over(dt)[0] for x in self.settings.inputs.values()]
        return np.array([*inputs, *([1.0] * (len(self.constants) + len(self.biased)))])

    def biases(self, channels: list[str]) -> np.ndarray:
        """Reading by rest: 1 where a channel has that bias, shape (channels, rest)."""
        found = np.zeros((len(channels), len(self.rest_names)))
        first = len(self.inputs) + len(self.constants)
        for i, name in enumerate(channels):
            if name in self.biased:
                found[i, first + self.biased.index(name)] = 1.0
        return found

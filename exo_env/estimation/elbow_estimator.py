"""The filter of a worn device: from hinge and cuff to the moment that everything but the device puts on an elbow.

The noise of the channels is that of the device's own data sheet (`tasks/elbow.py`). How fast the unknown moment changes
and how far it goes, and how wrong the device's own model may be, were chosen on patients of `mixed` and `wide`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from dms_core import Model
from dms_core.errors import InputError, SimulationError
from dms_core.estimation import Channel, EstimatedInput, FilterSettings
from dms_core.estimation.compiled.filter import CompiledFilter
from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.charts import chart_at
from dms_core.estimation.settings import InitialDeviations
from exo_env.ecosystem.sensors import FOREARM_IMU
from exo_env.estimation.nominal_elbow import CUFF, GRIP, NET, NominalElbow

ANGLE, RATE = "exo_angle.angle", "exo_angle.rate"
GUIDE_FORCE = f"{CUFF}.Fx"
"""Force of the lower link on the forearm along the link's x axis."""

GYRO = f"{FOREARM_IMU}.angular_velocity.z"
SPECIFIC_FORCE = tuple(f"{FOREARM_IMU}.specific_force.{x}" for x in "xy")
TURNS, MOST_TURN, SMALL = 30, 0.2, 1e-9
"""Steps in which a model is turned to the first reading, the largest one, and the error that is left [rad]."""
USUAL_NET = 0.3
"""Size of the moment that moves an arm, before anything of it is learnt [Nm]."""


class Tuning(NamedTuple):
    """What the filter takes for granted of the unknown; chosen on patients of `mixed` and `wide`."""

    least: float = 0.05
    """Least size of the moment that moves the arm [Nm]; what it is of a patient is learnt."""
    memory: float = 0.1
    """Time over which that size is learnt [s]."""
    net_time: float = 0.05
    """In which the moment that moves the arm forgets [s]."""
    grip: float = 0.3
    """How far the moment between device and others walks in a second [Nm / sqrt s]."""
    grip_share: float = 2.0
    """That walk for each Nm that moves the arm, beside it [1 / sqrt s]."""
    guide: float = 0.5
    """Noise of the cuff's force [N]."""
    specific_force: float = 0.25
    """Noise of the inertial sensor, what it is worn askew included [m/s^2]."""


class Moment(NamedTuple):
    """What a device knows."""

    others: float
    """Moment that all but the device puts on the elbow, into flexion [Nm]."""
    deviation: float
    """Standard deviation of it [Nm]."""


def first_angle(readings: Mapping[str, float]) -> float:
    """The hinge's angle that a filter begins with [rad].

    Raises:
        InputError: it is missing.
    """
    angle = readings.get(ANGLE, math.nan)
    if not math.isfinite(angle):
        raise InputError(f"'{ANGLE}': Expected the angle to begin with [rad], got {angle}.")
    return angle


class ElbowEstimator:
    """Filter of one device on one arm.

    The size of the moment that moves the arm, sigma^2 = E[net^2], differs a hundredfold between patients and is learnt
    on the way: d sigma^2/dt = (net^2 + its variance - sigma^2) / memory.

    Args:
        elbow: what the device takes for granted.
        period: between two readings [s].
        tuning: noise of what is unknown.
        steps: implicit steps of a period.
        imu: whether the inertial sensor on the wrist is read.
        like: an estimator of another body, whose orders of elimination are taken over.
    """

    def __init__(
        self, elbow: NominalElbow, period: float, tuning: Tuning | None = None, steps: int = 1, imu: bool = False,
        like: ElbowEstimator | None = None,
    ) -> None:  # fmt: skip
        self.elbow, self.period, self.tuning = elbow, period, tuning or Tuning()
        known: Model | None = like.filter.kalman.model if like is not None else None
        self.filter: CompiledFilter = CompiledFilter(Model(elbow.system(), like=known), self._settings(steps, imu))
        self.lost = 0
        """Times that the filter began anew."""
        self._power = 0.0

    def _settings(self, steps: int, imu: bool) -> FilterSettings:
        """Settings of the filter."""
        t = self.tuning
        channels = {
            ANGLE: Channel(deviation=2e-4, quantum=1.5e-3), RATE: Channel(deviation=0.02),
            GUIDE_FORCE: Channel(deviation=t.guide),
        }  # fmt: skip
        if imu:
            channels[GYRO] = Channel(deviation=0.02)
            channels |= {name: Channel(deviation=t.specific_force) for name in SPECIFIC_FORCE}
        inputs = {
            NET: EstimatedInput(deviation=USUAL_NET, time_constant=t.net_time),
            GRIP: EstimatedInput(deviation=20.0, walk=t.grip),
        }
        return FilterSettings(
            period=self.period, steps=steps, channels=channels, inputs=inputs,
            initial=InitialDeviations(position=0.01, velocity=0.05),
        )  # fmt: skip

    def reset(self, readings: Mapping[str, float]) -> Moment:
        """Begin with first readings, by channel.

        Raises:
            InputError: the hinge's angle is missing; of every other channel NaN tells nothing.
        """
        kalman, hinge = self.filter.kalman, first_angle(readings)
        start, row = kalman.start(), kalman.estimated.outputs[ANGLE]
        for _ in range(TURNS):
            # Turn the model to the measured angle in steps that a projection follows.
            out, n = kalman.read_out(start), len(start.chart.chosen)
            error, by_angle = math.remainder(hinge - out.y[row], 2.0 * math.pi), out.C[row, :n]
            if abs(error) < SMALL:
                break
            change = np.zeros(len(start.P))
            change[:n] = by_angle / float(by_angle @ by_angle) * float(np.clip(error, -MOST_TURN, MOST_TURN))
            start = self._fresh(kalman.moved(start, start.mean + change))
        self._power = USUAL_NET**2
        self.filter.begin(self._fresh(start))
        return self._taken(readings, self.filter.correct)

    def _fresh(self, belief: Belief) -> Belief:
        """The belief with the covariance of a start, in its own chart."""
        kalman = self.filter.kalman
        chart = chart_at(kalman.model, belief.q, belief.v, 0.0)
        return Belief(0.0, belief.q, belief.v, belief.rest, chart, kalman.estimated.first_covariance(chart))

    def update(self, readings: Mapping[str, float]) -> Moment:
        """Take the readings of the next period, by channel; NaN where there is none.

        Raises:
            InputError: there was no `reset` before.
        """
        if self._power == 0.0:
            raise InputError("elbow estimator: Expected 'reset' with first readings before 'update'.")
        a, t = self.filter.arrays, self.tuning
        k = len(a.P) - len(a.rest)
        power = max(self._power, t.least**2)
        a.Q[k, k] = power * (1.0 - a.factor[0] ** 2)
        a.Q[k + 1, k + 1] = (t.grip + t.grip_share * math.sqrt(power)) ** 2 * self.period
        return self._taken(readings, self.filter.step)

    def _taken(self, readings: Mapping[str, float], take: Callable[[Mapping[str, float]], None]) -> Moment:
        """What is known behind readings."""
        try:
            take(readings)
        except SimulationError:
            self.lost += 1
            self.filter.begin(self._fresh(self.filter.belief()))
        a = self.filter.arrays
        k = len(a.P) - len(a.rest)
        net, grip, P = a.rest[0], a.rest[1], a.P[k : k + 2, k : k + 2]
        self._power += self.period / self.tuning.memory * (net**2 + P[0, 0] - self._power)
        # What moves the arm is its acceleration times an inertia that is not the wearer's.
        variance = P[0, 0] - 2.0 * P[0, 1] + P[1, 1] + (self.elbow.inertia_doubt * net) ** 2
        return Moment(float(net - grip), math.sqrt(max(variance, 0.0)))

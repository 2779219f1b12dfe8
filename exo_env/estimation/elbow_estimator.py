"""The filter of a worn device: from hinge and cuff to the moment that everything but the device puts on an elbow.

The noise of the channels is that of the device's own data sheet (`tasks/elbow.py`). How fast the unknown moment changes
and how far it goes, and how wrong the device's own model may be, were chosen on patients of `mixed`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from dms_core import Model
from dms_core.errors import SimulationError
from dms_core.estimation import Channel, EstimatedInput, FilterSettings, KalmanFilter
from dms_core.estimation.charts import chart_at
from dms_core.estimation.estimated import Belief
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


class Tuning(NamedTuple):
    """What the filter takes for granted of the unknown; chosen on patients of `mixed`."""

    net: float = 0.085
    """Moment that moves the arm, in the long run [Nm]."""
    net_time: float = 0.15
    """In which it forgets [s]."""
    grip: float = 0.3
    """How far the moment between device and others walks in a second [Nm / sqrt s]."""
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


class ElbowEstimator:
    """Filter of one device on one arm.

    Args:
        elbow: what the device takes for granted.
        period: between two readings [s].
        tuning: noise of what is unknown.
        steps: implicit steps of a period.
        imu: whether the inertial sensor on the wrist is read.
    """

    def __init__(
        self, elbow: NominalElbow, period: float, tuning: Tuning | None = None, steps: int = 1, imu: bool = False
    ) -> None:
        self.elbow, self.period, self.tuning = elbow, period, tuning or Tuning()
        self.kalman = KalmanFilter(Model(elbow.system()), self._settings(steps, imu))
        self._belief: Belief | None = None
        self.lost = 0
        """Times that the filter began anew."""

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
            NET: EstimatedInput(deviation=t.net, time_constant=t.net_time),
            GRIP: EstimatedInput(deviation=20.0, walk=t.grip),
        }
        return FilterSettings(
            period=self.period, steps=steps, channels=channels, inputs=inputs,
            initial=InitialDeviations(position=0.01, velocity=0.05),
        )  # fmt: skip

    def reset(self, readings: Mapping[str, float]) -> Moment:
        """Begin with first readings, by channel."""
        start, hinge = self.kalman.start(), readings[ANGLE]
        row = self.kalman.estimated.outputs[ANGLE]
        for _ in range(TURNS):
            # Turn the model to the measured angle in steps that a projection follows.
            out, n = self.kalman.read_out(start), len(start.chart.chosen)
            error, by_angle = math.remainder(hinge - out.y[row], 2.0 * math.pi), out.C[row, :n]
            if abs(error) < SMALL:
                break
            change = np.zeros(len(start.P))
            change[:n] = by_angle / float(by_angle @ by_angle) * float(np.clip(error, -MOST_TURN, MOST_TURN))
            start = self._at(self.kalman.moved(start, start.mean + change))
        self._belief = self._at(start)
        return self.update(readings, first=True)

    def _at(self, belief: Belief) -> Belief:
        """The belief with the covariance of a start, in its own chart."""
        chart = chart_at(self.kalman.model, belief.q, belief.v, 0.0)
        return Belief(0.0, belief.q, belief.v, belief.rest, chart, self.kalman.estimated.first_covariance(chart))

    def update(self, readings: Mapping[str, float], first: bool = False) -> Moment:
        """Take the readings of the next period, by channel; NaN where there is none."""
        assert self._belief is not None
        belief = self._belief
        try:
            if not first:
                belief = self.kalman.predict(belief, belief.t + self.period).belief
            belief = self.kalman.correct(belief, dict(readings)).belief
        except SimulationError:
            self.lost += 1
            belief = self._at(self._belief)
        self._belief = belief
        k = belief.chart.size
        P = belief.P[k : k + 2, k : k + 2]
        deviation = math.sqrt(P[0, 0] - 2.0 * P[0, 1] + P[1, 1])
        return Moment(float(belief.rest[0] - belief.rest[1]), deviation)

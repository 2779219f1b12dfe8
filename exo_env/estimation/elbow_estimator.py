"""The filter of a worn device: from hinge, ropes and cuff to the moment that everything but the device puts on an elbow.

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
from dms_core.estimation.estimated import Belief
from dms_core.estimation.settings import InitialDeviations, MotionNoise
from exo_env.ecosystem.sensors import FOREARM_IMU, tension_sensor
from exo_env.estimation.nominal_elbow import CUFF, HAND, OTHERS, PULLS, SLIP, NominalElbow, tension_input

ANGLE, RATE = "exo_angle.angle", "exo_angle.rate"
GUIDE_FORCE = f"{CUFF}.Fx"
"""Force of the lower link on the forearm along the link's x axis."""


class Tuning(NamedTuple):
    """What the filter takes for granted of the unknown; chosen on patients of `mixed`."""

    deviation: float = 8.0
    """Of the moment of all others in the long run [Nm]."""
    time_constant: float = 0.5
    """In which it forgets [s]."""
    slip: float = 0.5
    """Of the hinge's open moment [Nm]."""
    guide: float = 0.5
    """Of the cuff's force [N], what the nominal body leaves open included."""
    tension_walk: float = 400.0
    """Of a rope's tension [N / sqrt s]."""


class Moment(NamedTuple):
    """What a device knows."""

    others: float
    """Moment that all but the device puts on the elbow, into flexion [Nm]."""
    deviation: float
    """Standard deviation of it [Nm]."""
    angle: float
    """Elbow angle [rad]."""
    rate: float
    """[rad/s]"""


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
            **{tension_sensor(r): Channel(deviation=1.0) for r in self.elbow.device.ropes},
        }  # fmt: skip
        if imu:
            channels[f"{FOREARM_IMU}.angular_velocity.z"] = Channel(deviation=0.02)
            channels |= {f"{FOREARM_IMU}.specific_force.{x}": Channel(deviation=0.2) for x in "xy"}
        inputs = {
            OTHERS: EstimatedInput(deviation=t.deviation, time_constant=t.time_constant),
            SLIP: EstimatedInput(deviation=t.slip, time_constant=1.0),
            **{tension_input(r): EstimatedInput(deviation=50.0, walk=t.tension_walk) for r in self.elbow.device.ropes},
        }
        if self.elbow.load_cell:
            channels |= {f"{pull}_cell.F{x}": Channel(deviation=1.0) for pull, x in zip(PULLS, "xy", strict=True)}
            inputs |= {hand: EstimatedInput(deviation=20.0, walk=100.0) for hand in HAND}
        return FilterSettings(
            period=self.period, steps=steps, channels=channels, inputs=inputs,
            noise=MotionNoise(acceleration=0.02), initial=InitialDeviations(position=0.01, velocity=0.05),
        )  # fmt: skip

    def reset(self, readings: Mapping[str, float]) -> Moment:
        """Begin with first readings, by channel."""
        start = self.kalman.start()
        chart, hinge = start.chart, readings[ANGLE]
        for _ in range(30):
            # Turn the model to the measured angle in steps that a projection follows.
            out = self.kalman.read_out(start)
            row = self.kalman.estimated.outputs[ANGLE]
            error = math.remainder(hinge - out.y[row], 2.0 * math.pi)
            n = len(start.chart.chosen)
            by_angle = out.C[row, :n]
            change = np.zeros(len(start.P))
            change[:n] = by_angle / float(by_angle @ by_angle) * float(np.clip(error, -0.3, 0.3))
            start = self.kalman.moved(start, start.mean + change)
            if abs(error) < 1e-9:
                break
        assert chart is not None
        self._start = self._belief = self._at(start)
        return self.update(readings, first=True)

    def _at(self, belief: Belief) -> Belief:
        """The belief with the covariance of a start, in its own chart."""
        from dms_core.estimation.charts import chart_at

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
        y = self.kalman.read(belief)
        at = self.kalman.estimated.outputs
        return Moment(float(belief.rest[0]), float(belief.deviations[k]), float(y[at[ANGLE]]), float(y[at[RATE]]))

"""PID controller from any sensor to any input, with saturation and anti-windup (paper sect. 3.5, Fig. 3).

With the reading y, the reference psi and the error e = psi - y:

    raw = offset + kp e + I - kd ydot          out = raw within lowest ... highest
    Idot = ki e + (out - raw) / T_t

The last term is back-calculation: while the output is limited, the integral is led back to where raw would just leave
the limit, with the time constant T_t (K. J. Astrom and T. Hagglund (1995), PID Controllers, sect. 3.5). The derivative
acts on the reading alone, so that a reference may jump; ydot is another sensor component, `rate`, or, without one, that
of the reading behind a lag of the time `filter_time`: ydot = (y - x) / T_f = xdot, with x at the reading at rest at the
start.

Reading and output are rates of own coordinates, so that no lag comes in between: v = y, v = out. The limits are sharp.
The input may be read by any force, motor, muscle or further controller; a PID of a position whose output is the
reference of a PID of a current is a cascade.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.control.reading import read_at_rest
from dms_core.model.element import Coordinate, Force, Pattern, Placement
from dms_core.model.places import numbers_at

READING, INTEGRAL, OUTPUT, DERIVATIVE = 0, 1, 2, 3
"""Local coordinates; the last one is there for kd other than 0."""
NONE, SENSED, FILTERED = 0, 1, 2
"""Where ydot comes from."""
UNLIMITED = 1e30


class PidNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    kp: int = 0
    ki: int = 1
    kd: int = 2
    offset: int = 3
    setpoint: int = 4
    lowest: int = 5
    highest: int = 6
    tracking: int = 7
    """1 / T_t [1/s]."""
    filter_time: int = 8


PID = PidNumbers()


@compiled
def _raw(ip, par, q, v, u):
    """(e, raw output, whether it is within its limits)."""
    error = (u[0, 0] if ip[0] > 0 else par[PID.setpoint]) - v[READING]
    raw = par[PID.offset] + par[PID.kp] * error + q[INTEGRAL]
    if ip[1] > 0:
        raw -= par[PID.kd] * v[DERIVATIVE]
    return error, raw, par[PID.lowest] < raw < par[PID.highest]


@compiled
def sensor_pid(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: has a reference, where ydot comes from. The row of the reading is another call's."""
    error, raw, free = _raw(ip, par, q, v, u)
    out = min(max(raw, par[PID.lowest]), par[PID.highest])
    back = par[PID.tracking]
    r[INTEGRAL] = v[INTEGRAL] - par[PID.ki] * error - back * (out - raw)
    r[OUTPUT] = v[OUTPUT] - out
    if ip[1] == FILTERED:
        r[DERIVATIVE] = par[PID.filter_time] * v[DERIVATIVE] + q[DERIVATIVE] - v[READING]
    if level > 0:
        # Derivatives of out and of out - raw by raw.
        slope = 1.0 if free else 0.0
        led = back * (slope - 1.0)
        Jv[INTEGRAL, INTEGRAL] = Jv[OUTPUT, OUTPUT] = 1.0
        Jv[INTEGRAL, READING] = par[PID.ki] + led * par[PID.kp]
        Jv[OUTPUT, READING] = slope * par[PID.kp]
        Jq[INTEGRAL, INTEGRAL], Jq[OUTPUT, INTEGRAL] = -led, -slope
        if ip[1] > 0:
            Jv[INTEGRAL, DERIVATIVE] = led * par[PID.kd]
            Jv[OUTPUT, DERIVATIVE] = slope * par[PID.kd]
        if ip[1] == FILTERED:
            Jv[DERIVATIVE, DERIVATIVE], Jq[DERIVATIVE, DERIVATIVE] = par[PID.filter_time], 1.0
            Jv[DERIVATIVE, READING] = -1.0


@compiled
def sensor_pid_by_input(ip, par, q, v, a, u, Ju):
    """The rows by the reference."""
    if ip[0] > 0:
        slope = 1.0 if _raw(ip, par, q, v, u)[2] else 0.0
        Ju[INTEGRAL, 0, 0] = -par[PID.ki] - par[PID.tracking] * (slope - 1.0) * par[PID.kp]
        Ju[OUTPUT, 0, 0] = -slope * par[PID.kp]


class SensorPid(Force):
    """PID controller from a sensor component to an input, with limits of the output and anti-windup.

    It owns the coordinates 'reading' and 'output', whose rates are the reading and the output, and 'integral'.
    """

    kind: ClassVar[str] = "sensor_pid"
    kernel: ClassVar = sensor_pid
    input_kernel: ClassVar = sensor_pid_by_input
    sensor: str = Field(description="sensor component that is controlled, by its full name, as 'elbow.angle'")
    output: str = Field(description="name of the input that the controller drives; it has no signal of its own")
    reference: str | None = Field(default=None, description="name of the input psi(t) [unit of the reading]")
    setpoint: float = Field(default=0.0, description="psi where there is no reference [unit of the reading]")
    kp: float = Field(default=0.0, description="proportional gain [output over reading]")
    ki: float = Field(default=0.0, description="integral gain [output over reading and s]")
    kd: float = Field(default=0.0, description="derivative gain [output s over reading]")
    rate: str | None = Field(default=None, description="sensor component that is ydot, as 'elbow.rate'")
    filter_time: float | None = Field(default=None, gt=0.0, description="T_f of the derivative without a 'rate' [s]")
    offset: float = Field(default=0.0, description="output without error [unit of the output]")
    lowest: float | None = Field(default=None, description="least output [unit of the output]; default: any")
    highest: float | None = Field(default=None, description="largest output [unit of the output]; default: any")
    tracking_time: float | None = Field(
        default=None, gt=0.0, description="T_t of the anti-windup [s]; default: kp / ki, the time of the integral part"
    )
    start_integral: float = Field(default=0.0, description="I at the start [unit of the output]")
    nominal_reading: float = Field(default=1.0, gt=0.0, description="size of the reading, for tolerances [its unit]")
    nominal_output: float = Field(default=1.0, gt=0.0, description="size of the output, for tolerances [its unit]")

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if self.kp == self.ki == self.kd == 0.0:
            raise ValueError("kp = ki = kd = 0: Expected one gain other than 0")
        if self.kd != 0.0 and (self.rate is None) == (self.filter_time is None):
            raise ValueError(
                f"kd = {self.kd:g}: Expected either 'rate', a sensor component, or 'filter_time' for its derivative"
            )
        if self.kd == 0.0 and (self.rate is not None or self.filter_time is not None):
            raise ValueError("'rate' and 'filter_time' shape the derivative part: Expected a kd other than 0 with them")
        if self.reference is not None and self.setpoint != 0.0:
            raise ValueError(f"reference = '{self.reference}', setpoint = {self.setpoint:g}: Expected one of both")
        low, high = self._limits()
        if not low < high:
            raise ValueError(f"lowest = {low:g}, highest = {high:g}: Expected the lowest output below the highest")
        limited = self.lowest is not None or self.highest is not None
        if self.ki != 0.0 and limited and self.tracking_time is None and self.kp / self.ki <= 0.0:
            raise ValueError(
                f"kp = {self.kp:g}, ki = {self.ki:g}: Expected a tracking_time, as a limited output needs one that is "
                "not kp / ki"
            )
        return self

    def _limits(self) -> tuple[float, float]:
        """Least and largest output."""
        low = -UNLIMITED if self.lowest is None else self.lowest
        return low, UNLIMITED if self.highest is None else self.highest

    def _derivative(self) -> int:
        """Where ydot comes from."""
        return NONE if self.kd == 0.0 else SENSED if self.rate is not None else FILTERED

    def coordinates(self) -> tuple[Coordinate, ...]:
        """Reading, integral and output, and what gives the reading's derivative."""
        y, out = self.nominal_reading, self.nominal_output
        found = [
            Coordinate("reading", 0.0, scale=y, rate_scale=y, differential_rate=False),
            Coordinate("integral", self.start_integral, scale=out, rate_scale=out, differential_rate=False),
            Coordinate("output", 0.0, scale=out, rate_scale=out, differential_rate=False),
        ]
        if self._derivative() == SENSED:
            found.append(Coordinate("rate_reading", 0.0, scale=y, rate_scale=y, differential_rate=False))
        if self._derivative() == FILTERED:
            rate = y / (self.filter_time or 1.0)
            found.append(Coordinate("filtered", 0.0, scale=y, rate_scale=rate, differential_rate=False))
        return tuple(found)

    def input_names(self) -> tuple[str, ...]:
        """The reference, where there is one."""
        return () if self.reference is None else (self.reference,)

    def driven_inputs(self) -> tuple[tuple[str, str], ...]:
        """The controlled input."""
        return ((self.output, "output"),)

    def placements(self, system) -> tuple[Placement, ...]:
        """The reading, ydot where it is another, and the controller's own rows."""
        own = tuple(f"{self.name}.{c.name}" for c in self.coordinates())
        readings = [Placement(coordinates=own[:1], reads=self.sensor)]
        if self.rate is not None:
            readings.append(Placement(coordinates=own[3:], reads=self.rate))
        return (*readings, self.place(system))

    def place(self, system) -> Placement:
        """The own coordinates."""
        own = tuple(f"{self.name}.{c.name}" for c in self.coordinates())
        low, high = self._limits()
        limited = self.ki != 0.0 and (self.lowest is not None or self.highest is not None)
        tracking = 1.0 / (self.tracking_time or self.kp / self.ki) if limited else 0.0
        n = len(own)
        by_q, by_v, none = np.zeros((n, n), bool), np.zeros((n, n), bool), np.zeros((n, n), bool)
        by_q[INTEGRAL:, INTEGRAL] = by_v[INTEGRAL:, READING] = True
        by_v[[INTEGRAL, OUTPUT], [INTEGRAL, OUTPUT]] = True
        by_v[INTEGRAL:, DERIVATIVE:] = True
        by_q[DERIVATIVE:, DERIVATIVE:] = True
        return Placement(
            coordinates=own,
            inputs=self.input_names(),
            integers=(int(self.reference is not None), self._derivative()),
            numbers=numbers_at(
                PID,
                kp=self.kp,
                ki=self.ki,
                kd=self.kd,
                offset=self.offset,
                setpoint=self.setpoint,
                lowest=low,
                highest=high,
                tracking=tracking,
                filter_time=self.filter_time or 0.0,
            ),
            pattern=Pattern(by_q, by_v, none),
        )

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """What is filtered starts at the reading with everything at rest.

        Args:
            system: the declared system.
            q: local coordinates of the sensor at the assembled start.
            u: (value, rate, second derivative) of the sensor's inputs at the start, shape (k, 3).

        Returns:
            One pair (q, v) for each coordinate.
        """
        reading = read_at_rest(system, self.sensor, q, u)
        starts = {"integral": self.start_integral, "filtered": reading}
        rates = {"reading": reading}
        return tuple((starts.get(c.name, 0.0), rates.get(c.name, 0.0)) for c in self.coordinates())

"""Actuator of a rope: its tension follows a command with a first-order lag (paper sect. 3.5, eq. 26).

    T v_tau + q_tau - tau_cmd = 0          q_tau the tension [N], T the time constant [s]

The command is an input, or comes from a controller: from a PID controller with coordinate q_c (eq. 26), or from any
coordinate whose rate v_c is the wanted tension (an impedance controller's), for which kp = 1, ki = kd = 0:

    x = sign authority (ki q_c + kp v_c + kd vdot_c)
    tau_cmd = pretension + P(x)                                              a rope cannot push
    tau_cmd = pretension + P(x) - P(P(x) - (max_tension - pretension))       with a limit

P is the positive part max(x, 0), smoothed over the width w about 0. With s = x / w + 1/2

    P(x) = 0 for s <= 0,   w (s^3 - s^4 / 2) for 0 < s < 1,   x for s >= 1

It is C2 and exact outside the width, and P(x) - P(-x) = x everywhere: an agonist (sign +1) and an antagonist
(sign -1) of the same lever give together exactly the command; smoothing only adds co-contraction, 3 w / 32 at x = 0.

T must be positive. With T = 0 the row would fix q_tau alone; v_tau would be nothing but the numerical derivative of
the tension, the start would have no equation for it, and kd vdot_c would put an acceleration, which is an algebraic
variable of the index-2 system, into the forces that cause it. A small T (1 ms) costs an L-stable method nothing, and
is the lag that limits the gain in the Ziegler-Nichols experiment.
"""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.control.pid import Pid
from dms_core.model.element import Coordinate, Force, Pattern, Placement
from dms_core.model.places import numbers_at

NOMINAL_TENSION = 100.0
"""Size of a rope drive's tension [N], for the error test: a controller of high gain turns angle errors of 1e-8 rad into
tenths of a newton, and a tolerance of a newton's fraction would let that ripple dictate the step."""


class ActuatorNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    time_constant: int = 0
    pretension: int = 1
    limit: int = 2
    """Largest command beyond the pretension [N]; 0: none."""
    width: int = 3
    ki: int = 4
    """Gains of the PID times the sign."""
    kp: int = 5
    kd: int = 6


ACTUATOR = ActuatorNumbers()


@compiled
def positive_part(x, width):
    """P(x) and its derivative P'(x)."""
    s = x / width + 0.5
    if s <= 0.0:
        return 0.0, 0.0
    if s >= 1.0:
        return x, 1.0
    return width * s * s * s * (1.0 - 0.5 * s), s * s * (3.0 - 2.0 * s)


@compiled
def pulled_tension(x, width, limit):
    """P(x), smoothly limited if limit > 0, and its derivative by x."""
    y, slope = positive_part(x, width)
    if limit > 0.0:
        over, cut = positive_part(y - limit, width)
        y -= over
        slope *= 1.0 - cut
    return y, slope


@compiled
def rope_actuator(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: from a controller, has authority."""
    T, pretension, limit = par[ACTUATOR.time_constant], par[ACTUATOR.pretension], par[ACTUATOR.limit]
    tension = 0.0
    if ip[0] == 0:
        # An input is no unknown of Newton's method: it is clipped without smoothing, so that 0 means 0.
        tension = max(u[0, 0], 0.0)
        if limit > 0.0:
            tension = min(tension, limit)
    else:
        authority = u[0, 0] if ip[1] > 0 else 1.0
        x = authority * (par[ACTUATOR.ki] * q[1] + par[ACTUATOR.kp] * v[1] + par[ACTUATOR.kd] * a[1])
        tension, slope = pulled_tension(x, par[ACTUATOR.width], limit)
        if level > 0:
            Jq[0, 1] = -slope * authority * par[ACTUATOR.ki]
            Jv[0, 1] = -slope * authority * par[ACTUATOR.kp]
            Ja[0, 1] = -slope * authority * par[ACTUATOR.kd]
    r[0] = T * v[0] + q[0] - pretension - tension
    if level > 0:
        Jq[0, 0] = 1.0
        Jv[0, 0] = T


@compiled
def rope_actuator_by_input(ip, par, q, v, a, u, Ju):
    """The row by the command or the authority; a command outside its limits moves nothing."""
    limit = par[ACTUATOR.limit]
    if ip[0] == 0:
        inside = u[0, 0] > 0.0 and (limit <= 0.0 or u[0, 0] < limit)
        Ju[0, 0, 0] = -1.0 if inside else 0.0
    elif ip[1] > 0:
        command = par[ACTUATOR.ki] * q[1] + par[ACTUATOR.kp] * v[1] + par[ACTUATOR.kd] * a[1]
        Ju[0, 0, 0] = -pulled_tension(u[0, 0] * command, par[ACTUATOR.width], limit)[1] * command


class RopeActuator(Force):
    """A motor that pulls a rope: owns the coordinate 'tension' [N], which ropes read.

    Give one source of the command: an input, a PID controller, or a coordinate of another controller.
    """

    kind: ClassVar[str] = "rope_actuator"
    kernel: ClassVar = rope_actuator
    input_kernel: ClassVar = rope_actuator_by_input
    command: str | None = Field(default=None, description="name of the input that commands a tension [N]")
    pid: str | None = Field(default=None, description="name of the PID controller that commands the tension")
    rate_of: str | None = Field(
        default=None, description="coordinate of a controller whose rate is the wanted tension [N], by its full name"
    )
    sign: Literal[1, -1] = Field(
        default=1, description="+1 pulls for a positive PID command (agonist), -1 antagonist [-]"
    )
    time_constant: float = Field(gt=0.0, description="T of the first-order lag [s]")
    pretension: float = Field(default=0.0, ge=0.0, description="tension without a command [N]")
    max_tension: float | None = Field(default=None, gt=0.0, description="largest commanded tension [N]; None: no limit")
    width: float = Field(default=1.0, gt=0.0, description="width w over which the positive part is smoothed [N]")
    authority: str | None = Field(
        default=None, description="name of the input, 0 to 1, that scales the PID command [-]"
    )
    start_tension: float | None = Field(
        default=None, ge=0.0, description="tension at the start [N]; None: that of the command without any error"
    )

    @model_validator(mode="after")
    def _one_source(self):
        if sum(x is not None for x in (self.command, self.pid, self.rate_of)) != 1:
            raise ValueError("give one of 'command' (an input), 'pid' and 'rate_of' (of controllers), and no other")
        if self.command is not None and (self.authority is not None or self.sign != 1):
            raise ValueError(
                "'authority' and 'sign' shape a controller's command; an input commands the tension itself"
            )
        if self.max_tension is not None and self.max_tension - self.pretension < self.width:
            raise ValueError(
                f"max_tension = {self.max_tension} N must exceed pretension = {self.pretension} N by at least the "
                f"width = {self.width} N of the smoothing"
            )
        if self.max_tension is not None and (self.start_tension or 0.0) > self.max_tension:
            raise ValueError(
                f"start_tension = {self.start_tension} N: Expected at most max_tension = {self.max_tension} N"
            )
        return self

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The tension, a first-order state; its nominal size is NOMINAL_TENSION, and that in T."""
        start = self.pretension if self.start_tension is None else self.start_tension
        rate_scale = NOMINAL_TENSION / self.time_constant
        return (Coordinate("tension", start, scale=NOMINAL_TENSION, rate_scale=rate_scale, differential_rate=False),)

    def input_names(self) -> tuple[str, ...]:
        """The command or the authority."""
        return tuple(name for name in (self.command, self.authority) if name is not None)

    def place(self, system) -> Placement:
        """The tension, and the PID's coordinate with its gains."""
        limit = 0.0 if self.max_tension is None else self.max_tension - self.pretension
        own = f"{self.name}.tension"
        flags = (int(self.command is None), int(self.authority is not None))
        if self.command is not None:
            one = np.ones((1, 1), bool)
            pattern = Pattern(one, one, ~one)
            return Placement((), (own,), self.input_names(), flags, self._numbers(limit, 0.0, 0.0, 0.0), pattern)
        source, (ki, kp, kd) = self._controller(system)
        row = np.array([[True, True], [False, False]])
        return Placement(
            coordinates=(own, source),
            inputs=self.input_names(),
            integers=flags,
            numbers=self._numbers(limit, ki, kp, kd),
            pattern=Pattern(row, row, np.array([[False, kd > 0.0], [False, False]])),
        )

    def _controller(self, system) -> tuple[str, tuple[float, float, float]]:
        """Coordinate that commands, and the gains ki, kp, kd on its value, rate and second derivative."""
        if self.rate_of is not None:
            return self.rate_of, (0.0, 1.0, 0.0)
        gains = system.element(self.pid, Pid)
        return f"{self.pid}.error_integral", (gains.ki, gains.kp, gains.kd)

    def _numbers(self, limit: float, ki: float, kp: float, kd: float) -> tuple[float, ...]:
        return numbers_at(
            ACTUATOR, time_constant=self.time_constant, pretension=self.pretension, limit=limit, width=self.width,
            ki=self.sign * ki, kp=self.sign * kp, kd=self.sign * kd,
        )  # fmt: skip

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Start of each owned coordinate: the tension, without change.

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (n,).
            u: (value, rate, second derivative) of each local input at the start, shape (k, 3).

        Returns:
            One pair (q, v) [N, N/s]; v is a guess, since the row itself fixes the rate.
        """
        if self.start_tension is not None:
            return ((self.start_tension, 0.0),)
        if self.command is None:
            return ((self.pretension + positive_part(0.0, self.width)[0], 0.0),)
        tension = self.pretension + max(float(u[0, 0]), 0.0)
        return ((tension if self.max_tension is None else min(tension, self.max_tension), 0.0),)

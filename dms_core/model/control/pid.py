"""PID controller of a joint angle inside the DAE (paper sect. 3.5, eq. 21-26).

With the error e = psi(t) + q_f - theta(q) the controller owns one coordinate q_c, the integral of e, and one row

    vdot_c - psidot - v_f + theta_q v + k_d (v_c - e) = 0

so that v_c = e and vdot_c = edot. psi is an input, q_f the (optional) setpoint of a reference filter: a jump of the
wish must not reach psidot. The command that actuators read is ki q_c + kp v_c + kd vdot_c.

e is integrated, not measured: with drift_gain k_d = 0, as in the paper, v_c may leave e by the error of integration;
k_d > 0 [1/s] pulls it back with time constant 1 / k_d (Baumgarte 1972) and changes nothing on the exact solution.
k_d may be far above 1 / h, since the implicit method damps stiff decay: 1e3 to 1e4 cost no steps. On the pendulum of
the tests, 1.8 s at rtol 1e-5, the drift is 8e-5 rad with k_d = 0, 8e-7 with 1e3 and 8e-8 with 1e4.

Start: q_c = 0, v_c = e(0). theta is the principal value in (-pi, pi], which e(0) and the drift term use; without
drift feedback a joint may turn further, since only theta_q enters.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import Coordinate, Force, Pattern, Placement, Vector
from dms_core.model.geometry.angle import add_angle_gradient, add_angle_rate_gradient, angle_rate, joint_angle
from dms_core.model.geometry.rotations import vec
from dms_core.model.geometry.sensed_angle import sensed_angle
from dms_core.model.places import numbers_at

OWN, FILTER = 14, 15
"""Local coordinates: two bodies, then q_c, then q_f if there is one."""


class PidNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    drift_gain: int = 9
    """[1/s]"""


PID = PidNumbers()


@compiled
def pid(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: has reference, has filter."""
    f, g, h, drift_gain = vec(par, PID.f), vec(par, PID.g), vec(par, PID.h), par[PID.drift_gain]
    psi, psi_rate = 0.0, 0.0
    if ip[0] > 0:
        psi, psi_rate = u[0, 0], u[0, 1]
    if ip[1] > 0:
        psi += q[FILTER]
        psi_rate += v[FILTER]
    error = psi - joint_angle(0, 7, f, g, h, q)
    r[OWN] = a[OWN] - psi_rate + angle_rate(0, 7, f, g, h, q, v) + drift_gain * (v[OWN] - error)
    if level > 0:
        add_angle_rate_gradient(OWN, 0, 7, f, g, h, q, v, 1.0, Jq)
        add_angle_gradient(OWN, 0, 7, f, g, h, q, drift_gain, Jq)
        add_angle_gradient(OWN, 0, 7, f, g, h, q, 1.0, Jv)
        Jv[OWN, OWN] = drift_gain
        Ja[OWN, OWN] = 1.0
        if ip[1] > 0:
            Jq[OWN, FILTER] = -drift_gain
            Jv[OWN, FILTER] = -1.0


@compiled
def pid_by_input(ip, par, q, v, a, u, Ju):
    """The row by psi and psidot."""
    if ip[0] > 0:
        Ju[OWN, 0, 0] = -par[PID.drift_gain]
        Ju[OWN, 0, 1] = -1.0


class Pid(Force):
    """PID controller of the angle of a revolute joint. It exerts no force; actuators read its command.

    The gains are here, once, and each actuator that names this controller uses them.
    """

    kind: ClassVar[str] = "pid"
    kernel: ClassVar = pid
    input_kernel: ClassVar = pid_by_input
    reads_input_rates: ClassVar[bool] = True
    joint: str = Field(description="name of the revolute joint whose angle theta is controlled")
    reference: str | None = Field(default=None, description="name of the input psi(t) [rad]; None means 0")
    offset: str | None = Field(
        default=None, description="coordinate q_f added to psi [rad], for example 'filter.setpoint'"
    )
    kp: float = Field(ge=0.0, description="proportional gain [N/rad]")
    ki: float = Field(default=0.0, ge=0.0, description="integral gain [N/(rad s)]")
    kd: float = Field(default=0.0, ge=0.0, description="derivative gain [N s/rad]")
    drift_gain: float = Field(default=0.0, ge=0.0, description="feedback of the drift v_c - e [1/s]; 0 as in the paper")
    pointer_i: Vector | None = Field(default=None, description="direction of angle 0 in the frame of body_i [-]")
    pointer_j: Vector | None = Field(
        default=None, description="direction in the frame of body_j that lies along pointer_i at angle 0 [-]"
    )

    @model_validator(mode="after")
    def _something_to_follow(self):
        if self.reference is None and self.offset is None:
            raise ValueError(
                "nothing to follow; name an input as 'reference', a filter's setpoint as 'offset', or both"
            )
        return self

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The integral of the error [rad s], whose rate is the error [rad]."""
        return (Coordinate("error_integral", 0.0),)

    def input_names(self) -> tuple[str, ...]:
        """The reference."""
        return () if self.reference is None else (self.reference,)

    def place(self, system) -> Placement:
        """Both bodies of the joint, q_c, and the filter's setpoint."""
        who = f"{self.kind} '{self.name}'"
        bodies, frame = sensed_angle(system, who, self.joint, self.pointer_i, self.pointer_j)
        if self.offset is not None:
            self._check_order(system)
        own = f"{self.name}.error_integral"
        return Placement(
            bodies=bodies,
            coordinates=(own,) if self.offset is None else (own, self.offset),
            inputs=self.input_names(),
            integers=(int(self.reference is not None), int(self.offset is not None)),
            numbers=numbers_at(PID, f=frame[:3], g=frame[3:6], h=frame[6:], drift_gain=self.drift_gain),
            pattern=_pattern(self.offset is not None, self.drift_gain > 0.0),
        )

    def _check_order(self, system) -> None:
        """Start states are set in the order of declaration, and e(0) needs that of the filter."""
        owner = (self.offset or "").rpartition(".")[0]
        names = [force.name for force in system.forces]
        if owner in names[names.index(self.name) :]:
            raise ModelError(
                f"{self.kind} '{self.name}': offset = '{self.offset}': '{owner}' is declared behind the controller, "
                f"whose start depends on it; declare '{owner}' first."
            )

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Start of each owned coordinate: q_c = 0, v_c = e(0).

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (n,); the filter's setpoint in it
                must already have its own start.
            u: (value, rate, second derivative) of each local input at the start, shape (k, 3).

        Returns:
            One pair (q, v) [rad s, rad].
        """
        _, frame = sensed_angle(system, self.name, self.joint, self.pointer_i, self.pointer_j)
        error = -joint_angle(0, 7, frame[0:3], frame[3:6], frame[6:9], q)
        if self.reference is not None:
            error += u[0, 0]
        if self.offset is not None:
            error += q[FILTER]
        return ((0.0, float(error)),)


def _pattern(filtered: bool, coupled: bool) -> Pattern:
    """One row: Euler parameters of both bodies, q_c and the filter."""
    n = FILTER + int(filtered)
    by_q, by_v, by_a = (np.zeros((n, n), bool) for _ in range(3))
    by_q[OWN, [*range(3, 7), *range(10, 14)]] = True
    by_v[OWN] = by_q[OWN]
    by_v[OWN, OWN] = coupled
    by_a[OWN, OWN] = True
    by_q[OWN, FILTER:] = coupled
    by_v[OWN, FILTER:] = True
    return Pattern(by_q, by_v, by_a)

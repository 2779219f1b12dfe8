"""Direct-current motor on a revolute joint, with a gear (paper Fig. 3, electromechanical coordinates).

With the current i, the voltage u, the gear ratio n (turns of the rotor for one of the joint) and w = n thetadot:

    L di/dt + R i + k_e w - u = 0
    M = n (k_t i - b w - c tanh(w / w_c) - J wdot)        on body_j, -M on body_i, about the joint's axis

R, L are those of the armature, k_e and k_t the constants of back voltage and torque (in SI units one number), b and c
viscous and Coulomb friction and J the inertia of the rotor, all seen from the rotor. The gear is rigid and without
loss. The rotor turns with n thetadot against body_i about the joint's axis: its reaction counts, its gyroscopic
moment where body_i turns about other axes does not, and its mass is that of body_i.

Source: N. Mohan (2003), Electric Drives, ch. 7.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement, Vector
from dms_core.model.forces.joint.joint_moment import put_joint_moment
from dms_core.model.geometry.angle import add_angle_gradient, add_angle_rate_gradient, angle_rate
from dms_core.model.geometry.rotations import vec
from dms_core.model.geometry.sensed_angle import sensed_angle
from dms_core.model.places import numbers_at
from dms_core.model.sensors.angle import add_angle_acceleration_gradient, angle_acceleration

CURRENT = 14
"""Local coordinate: two bodies, then the current."""


class MotorNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    resistance: int = 9
    inductance: int = 10
    torque_constant: int = 11
    back_voltage: int = 12
    gear_ratio: int = 13
    viscous: int = 14
    coulomb: int = 15
    coulomb_speed: int = 16
    inertia: int = 17


MOTOR = MotorNumbers()


@compiled
def dc_motor(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Moment about the joint, and the row of the current."""
    f, g, h, n = vec(par, MOTOR.f), vec(par, MOTOR.g), vec(par, MOTOR.h), par[MOTOR.gear_ratio]
    R, L, k_e = par[MOTOR.resistance], par[MOTOR.inductance], par[MOTOR.back_voltage]
    inertia, drive = n * n * par[MOTOR.inertia], n * par[MOTOR.torque_constant]
    rate = angle_rate(0, 7, f, g, h, q, v)
    rough = math.tanh(n * rate / par[MOTOR.coulomb_speed])
    M = n * (par[MOTOR.viscous] * n * rate + par[MOTOR.coulomb] * rough) - drive * q[CURRENT]
    if inertia > 0.0:
        M += inertia * angle_acceleration(0, 7, f, g, h, q, v, a)
    by_rate = n * n * (par[MOTOR.viscous] + par[MOTOR.coulomb] * (1.0 - rough * rough) / par[MOTOR.coulomb_speed])
    put_joint_moment(f, g, h, q, v, M, 0.0, by_rate, level, r, Jq, Jv)
    r[CURRENT] = L * v[CURRENT] + R * q[CURRENT] + k_e * n * rate - u[0, 0]
    if level == 0:
        return
    # The row of the current holds, one after the other, what the moment needs and what it is itself.
    add_angle_gradient(CURRENT, 0, 7, f, g, h, q, 1.0, Ja)
    if inertia > 0.0:
        add_angle_acceleration_gradient(CURRENT, 0, 7, f, g, h, q, v, a, Jq)
        add_angle_rate_gradient(CURRENT, 0, 7, f, g, h, q, v, 2.0, Jv)
        for i in range(14):
            for j in range(14):
                Jq[i, j] += inertia * Ja[CURRENT, i] * Jq[CURRENT, j]
                Jv[i, j] += inertia * Ja[CURRENT, i] * Jv[CURRENT, j]
                Ja[i, j] = inertia * Ja[CURRENT, i] * Ja[CURRENT, j]
    for i in range(14):
        Jq[i, CURRENT] = -drive * Ja[CURRENT, i]
        Jv[CURRENT, i] = k_e * n * Ja[CURRENT, i]
        Jq[CURRENT, i] = Ja[CURRENT, i] = 0.0
    add_angle_rate_gradient(CURRENT, 0, 7, f, g, h, q, v, k_e * n, Jq)
    Jq[CURRENT, CURRENT] = R
    Jv[CURRENT, CURRENT] = L


@compiled
def dc_motor_by_input(ip, par, q, v, a, u, Ju):
    """The row of the current by the voltage."""
    Ju[CURRENT, 0, 0] = -1.0


class DcMotor(Force):
    """Direct-current motor with a gear on a revolute joint; owns the coordinate 'current' [A].

    A current loop is a `sensor_pid` from a sensor of that coordinate to the voltage.
    """

    kind: ClassVar[str] = "dc_motor"
    kernel: ClassVar = dc_motor
    input_kernel: ClassVar = dc_motor_by_input
    joint: str = Field(description="joint with an angle, as a revolute, that the motor turns")
    voltage: str = Field(description="name of the input u(t) [V]")
    resistance: float = Field(gt=0.0, description="R [ohm]")
    inductance: float = Field(gt=0.0, description="L [H]")
    torque_constant: float = Field(gt=0.0, description="k_t [N m/A]")
    back_voltage: float | None = Field(
        default=None, ge=0.0, description="k_e [V s/rad]; default: the number of k_t, as in a motor without loss"
    )
    gear_ratio: float = Field(
        default=1.0, description="n, turns of the rotor for one of the joint [-]; below 0 the gear reverses the sense"
    )
    rotor_inertia: float = Field(default=0.0, ge=0.0, description="J [kg m^2]")
    viscous_friction: float = Field(default=0.0, ge=0.0, description="b [N m s/rad]")
    coulomb_friction: float = Field(default=0.0, ge=0.0, description="c [N m]")
    coulomb_speed: float = Field(
        default=1.0, gt=0.0, description="w_c, speed of the rotor at which Coulomb friction is 76 % of c [rad/s]"
    )
    start_current: float = Field(default=0.0, description="i at the start [A]")
    nominal_current: float = Field(default=1.0, gt=0.0, description="size of the current, for tolerances [A]")
    pointer_i: Vector | None = Field(default=None, description="direction of angle 0 in the frame of body_i [-]")
    pointer_j: Vector | None = Field(
        default=None, description="direction in the frame of body_j that lies along pointer_i at angle 0 [-]"
    )

    @model_validator(mode="after")
    def _geared(self) -> Self:
        if self.gear_ratio == 0.0:
            raise ValueError("gear_ratio = 0: Expected a number other than 0; without a gear it is 1")
        return self

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The current, a first-order state."""
        size = self.nominal_current
        rate = size * self.resistance / self.inductance
        return (Coordinate("current", self.start_current, scale=size, rate_scale=rate, differential_rate=False),)

    def input_names(self) -> tuple[str, ...]:
        """The voltage."""
        return (self.voltage,)

    def place(self, system) -> Placement:
        """Both bodies of the joint, and the current."""
        who = f"{self.kind} '{self.name}'"
        bodies, frame = sensed_angle(system, who, self.joint, self.pointer_i, self.pointer_j)
        p = np.append(np.arange(14) % 7 >= 3, False)
        by_q = np.outer(p, p)
        by_q[CURRENT, p] = by_q[p, CURRENT] = by_q[CURRENT, CURRENT] = True
        by_v = by_q.copy()
        by_v[p, CURRENT] = False
        by_a = np.outer(p, p) if self.rotor_inertia > 0.0 else np.zeros((15, 15), bool)
        return Placement(
            bodies=bodies,
            coordinates=(f"{self.name}.current",),
            inputs=self.input_names(),
            numbers=numbers_at(
                MOTOR,
                f=frame[:3],
                g=frame[3:6],
                h=frame[6:],
                resistance=self.resistance,
                inductance=self.inductance,
                torque_constant=self.torque_constant,
                back_voltage=self.torque_constant if self.back_voltage is None else self.back_voltage,
                gear_ratio=self.gear_ratio,
                viscous=self.viscous_friction,
                coulomb=self.coulomb_friction,
                coulomb_speed=self.coulomb_speed,
                inertia=self.rotor_inertia,
            ),
            pattern=Pattern(by_q, by_v, by_a),
        )

"""Impedance controller of a joint angle: a compliant law that ropes pull (Hogan 1985, J. Dyn. Syst. Meas. Control 107).

    M = K (theta_0 - theta) - D thetadot + s M_g(theta),     M_g = m_c cos(theta) + m_s sin(theta)

K, D and s are inputs. The spring's zero theta_0 rests, or follows the angle with a time constant T_0:

    T_0 thetadot_0 + theta_0 - theta = 0          spring and damper in series, a Maxwell element of damping K T_0
    thetadot_0 = 0                                without T_0

A zero that is set to the measured angle every P seconds, the spring being slack each time, resists a motion with a mean
moment of K P / 2 times its rate: that is the slow limit of T_0 = P / 2, without a moment that jumps.

Each rope j of the joint is asked for the tension that alone would give M, with its moment arm r_j(theta), positive
where it pulls theta up:

    v_j - M / r_j = 0,     r_j = -dl_j / dtheta = (b cos(theta) - a sin(theta)) / l_j,
                           l_j^2 = c - 2 (a cos(theta) + b sin(theta))

for a straight rope from a point of one body to a point of the other. q_j, its integral [N s], is never read; motors
read v_j (`RopeActuator.rate_of`) and pull where it is positive, so that the rope whose way M goes pulls, and the other
is slack. With K, D >= 0 and s = 0 the law takes up energy only: what is in the spring comes from the joint.

A law whose tensions follow with a lag T about a mass of inertia J is stable where D, and what else damps the joint, is
above K T.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.control.actuator import NOMINAL_TENSION
from dms_core.model.element import Coordinate, Force, Pattern, Placement, Vector
from dms_core.model.geometry.angle import add_angle_gradient, add_angle_rate_gradient, angle_rate, joint_angle
from dms_core.model.geometry.frames import unit
from dms_core.model.geometry.rotations import vec
from dms_core.model.geometry.sensed_angle import sensed_angle
from dms_core.model.places import numbers_at
from dms_core.model.ropes.rope_force import RopeForce

OWN = 14
"""Local coordinates: two bodies, then theta_0, then the integral of each rope's tension."""
STIFFNESS, DAMPING, SHARE = 0, 1, 2
"""Local inputs."""


class ImpedanceNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    f: int = 0
    """Frame of the angle, see dms_core.model.geometry.angle."""
    g: int = 3
    h: int = 6
    relaxation: int = 9
    """T_0 [s]."""
    carried_cos: int = 10
    """m_c and m_s [Nm]."""
    carried_sin: int = 11
    least: int = 12
    """Least moment arm [m]."""
    ropes: int = 13
    """a, b, c [m^2] and the sign of the moment arm, for each rope."""


IMPEDANCE = ImpedanceNumbers()
PER_ROPE = 4


@compiled
def moment_arm(par, k, angle):
    """r of rope k [m] and its slope dr/dtheta; no nearer to 0 than the least moment arm, and constant there."""
    j = IMPEDANCE.ropes + PER_ROPE * k
    a, b, c, sign = par[j], par[j + 1], par[j + 2], par[j + 3]
    cos, sin = math.cos(angle), math.sin(angle)
    length = math.sqrt(max(c - 2.0 * (a * cos + b * sin), 1e-12))
    r = (b * cos - a * sin) / length
    if sign * r < par[IMPEDANCE.least]:
        return sign * par[IMPEDANCE.least], 0.0
    return r, (r * r - a * cos - b * sin) / length


@compiled
def impedance_controller(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: number of ropes, whether the zero follows."""
    f, g, h, T = vec(par, IMPEDANCE.f), vec(par, IMPEDANCE.g), vec(par, IMPEDANCE.h), par[IMPEDANCE.relaxation]
    angle, rate = joint_angle(0, 7, f, g, h, q), angle_rate(0, 7, f, g, h, q, v)
    K, D, s = u[STIFFNESS, 0], u[DAMPING, 0], u[SHARE, 0]
    by_cos, by_sin = s * par[IMPEDANCE.carried_cos], s * par[IMPEDANCE.carried_sin]
    M = K * (q[OWN] - angle) - D * rate + by_cos * math.cos(angle) + by_sin * math.sin(angle)
    M_angle = -K - by_cos * math.sin(angle) + by_sin * math.cos(angle)
    r[OWN] = T * v[OWN] + q[OWN] - angle if ip[1] > 0 else v[OWN]
    if level > 0:
        Jv[OWN, OWN] = T
        if ip[1] > 0:
            Jq[OWN, OWN] = 1.0
            add_angle_gradient(OWN, 0, 7, f, g, h, q, -1.0, Jq)
    for k in range(ip[0]):
        row = OWN + 1 + k
        arm, slope = moment_arm(par, k, angle)
        r[row] = v[row] - M / arm
        if level > 0:
            Jq[row, OWN] = -K / arm
            add_angle_gradient(row, 0, 7, f, g, h, q, (M * slope / arm - M_angle) / arm, Jq)
            add_angle_rate_gradient(row, 0, 7, f, g, h, q, v, D / arm, Jq)
            add_angle_gradient(row, 0, 7, f, g, h, q, D / arm, Jv)
            Jv[row, row] = 1.0


@compiled
def impedance_controller_by_input(ip, par, q, v, a, u, Ju):
    """The rows of the ropes by stiffness, damping and share."""
    f, g, h = vec(par, IMPEDANCE.f), vec(par, IMPEDANCE.g), vec(par, IMPEDANCE.h)
    angle, rate = joint_angle(0, 7, f, g, h, q), angle_rate(0, 7, f, g, h, q, v)
    carried = par[IMPEDANCE.carried_cos] * math.cos(angle) + par[IMPEDANCE.carried_sin] * math.sin(angle)
    for k in range(ip[0]):
        arm, _ = moment_arm(par, k, angle)
        Ju[OWN + 1 + k, STIFFNESS, 0] = (angle - q[OWN]) / arm
        Ju[OWN + 1 + k, DAMPING, 0] = rate / arm
        Ju[OWN + 1 + k, SHARE, 0] = -carried / arm


class ImpedanceController(Force):
    """Impedance controller of the angle of a revolute joint. It exerts no force; actuators read its commands.

    Name three inputs, and the ropes, each a straight one between the two bodies of the joint.
    """

    kind: ClassVar[str] = "impedance_controller"
    kernel: ClassVar = impedance_controller
    input_kernel: ClassVar = impedance_controller_by_input
    joint: str = Field(description="name of the revolute joint whose angle theta is controlled")
    ropes: tuple[str, ...] = Field(min_length=1, description="names of the ropes that are to give the moment")
    stiffness: str = Field(description="name of the input K(t) [Nm/rad]")
    damping: str = Field(description="name of the input D(t) [N m s/rad]")
    share: str = Field(description="name of the input s(t), the share of M_g that is given [-]")
    relaxation_time: float | None = Field(
        default=None, gt=0.0, description="T_0 with which the spring's zero follows the angle [s]; None: it rests"
    )
    carried_cos: float = Field(default=0.0, description="m_c of the moment M_g [Nm]")
    carried_sin: float = Field(default=0.0, description="m_s of the moment M_g [Nm]")
    least_leverage: float = Field(
        default=1e-3, gt=0.0, description="moment arm that none counts below, for ropes that lose theirs [m]"
    )
    pointer_i: Vector | None = Field(default=None, description="direction of angle 0 in the frame of body_i [-]")
    pointer_j: Vector | None = Field(
        default=None, description="direction in the frame of body_j that lies along pointer_i at angle 0 [-]"
    )

    def coordinates(self) -> tuple[Coordinate, ...]:
        """The spring's zero [rad], and for each rope an impulse [N s] whose rate is the wanted tension [N]."""
        quickest = 1.0 if self.relaxation_time is None else 1.0 / self.relaxation_time
        return (
            Coordinate("zero", 0.0, rate_scale=quickest, differential_rate=False),
            *(
                Coordinate(
                    f"{rope}_impulse", 0.0, scale=NOMINAL_TENSION, rate_scale=NOMINAL_TENSION, differential_rate=False
                )
                for rope in self.ropes
            ),
        )

    def input_names(self) -> tuple[str, ...]:
        """Stiffness, damping and share."""
        return self.stiffness, self.damping, self.share

    def place(self, system) -> Placement:
        """Both bodies of the joint, the zero, then each rope."""
        bodies, frame = self._angle(system)
        numbers = numbers_at(
            IMPEDANCE, f=frame[:3], g=frame[3:6], h=frame[6:], relaxation=self.relaxation_time or 1.0,
            carried_cos=self.carried_cos, carried_sin=self.carried_sin, least=self.least_leverage,
            ropes=np.concatenate([self._rope_numbers(system, rope, np.array(frame)) for rope in self.ropes]),
        )  # fmt: skip
        return Placement(
            bodies=bodies,
            coordinates=tuple(f"{self.name}.{c.name}" for c in self.coordinates()),
            inputs=self.input_names(),
            integers=(len(self.ropes), int(self.relaxation_time is not None)),
            numbers=numbers,
            pattern=_pattern(len(self.ropes), self.relaxation_time is not None),
        )

    def _angle(self, system) -> tuple[tuple[str, str], tuple[float, ...]]:
        who = f"{self.kind} '{self.name}'"
        return sensed_angle(system, who, self.joint, self.pointer_i, self.pointer_j)

    def _rope_numbers(self, system, rope: str, frame: np.ndarray) -> np.ndarray:
        """a, b, c of a rope [m^2], and the sign of its moment arm at the start.

        Raises:
            ModelError: it is no straight rope between the joint's two bodies.
        """
        joint, path = system.element(self.joint, Revolute), system.element(rope, RopeForce).path
        ends = {p.body: np.array(p.point) for p in path}
        if len(path) != 2 or ends.keys() != {joint.body_i, joint.body_j}:
            raise ModelError(
                f"{self.kind} '{self.name}': rope '{rope}' runs through {', '.join(p.body for p in path)}; expected "
                f"two points, one on each body of '{self.joint}', {joint.body_i} and {joint.body_j}."
            )
        axis_i = unit(joint.axis_i, "axis_i")
        axis_j, point_j = joint.axis_j, joint.point_j
        if axis_j is None:
            axis_j = system.start_direction(joint.body_i, axis_i, joint.body_j)
        if point_j is None:
            point_j = system.start_point(joint.body_i, joint.point_i, joint.body_j)
        f, g, h = frame[:3], frame[3:6], frame[6:]
        axis_j = unit(axis_j, "axis_j")
        h = unit(h - axis_j * (axis_j @ h), "pointer_j")
        x, y = ends[joint.body_i] - np.array(joint.point_i), ends[joint.body_j] - np.array(point_j)
        at_0, across = y @ h, y @ np.cross(axis_j, h)
        a, b = (x @ f) * at_0 + (x @ g) * across, (x @ g) * at_0 - (x @ f) * across
        c = x @ x + y @ y - 2.0 * (x @ axis_i) * (y @ axis_j)
        angle = self._start_angle(system, frame)
        return np.array([a, b, c, math.copysign(1.0, b * math.cos(angle) - a * math.sin(angle))])

    def _start_angle(self, system, frame: np.ndarray) -> float:
        """Angle of the joint in the declared poses [rad]."""
        joint, blocks = system.element(self.joint, Revolute), []
        for body in (joint.body_i, joint.body_j):
            blocks.append(system.start_pose(body)[1])
        d = blocks[1] @ frame[6:]
        return math.atan2((blocks[0] @ frame[3:6]) @ d, (blocks[0] @ frame[:3]) @ d)

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Start of each owned coordinate: a slack spring, and no impulse.

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (n,).
            u: (value, rate, second derivative) of each local input at the start, shape (3, 3).

        Returns:
            One pair (q, v) each; v is a guess, since the rows themselves fix the rates.
        """
        _, frame = self._angle(system)
        angle = float(joint_angle(0, 7, frame[0:3], frame[3:6], frame[6:9], q))
        return ((angle, 0.0), *((0.0, 0.0) for _ in self.ropes))


def _pattern(ropes: int, follows: bool) -> Pattern:
    """Each row knows the Euler parameters of both bodies; those of the ropes also the zero and their own rate."""
    n = OWN + 1 + ropes
    by_q, by_v, none = (np.zeros((n, n), bool) for _ in range(3))
    turns = [*range(3, 7), *range(10, 14)]
    by_q[OWN, OWN] = follows
    by_q[OWN, turns] = follows
    by_v[OWN, OWN] = True
    by_q[OWN + 1 :, [*turns, OWN]] = True
    by_v[OWN + 1 :, turns] = True
    own = np.arange(OWN + 1, n)
    by_v[own, own] = True
    return Pattern(by_q, by_v, none)

"""Floating frame of a modal body: q = [r (3), p (4), eta (n)], r its origin, with the invariants of modal_data.py.

With z = A^T r_tt, omega = 2 G p_t, alpha = 2 G p_tt, c, J, R at eta and their rates, Lagrange's equations are

    r      m r_tt + A (alpha x c + P eta_tt + omega x (omega x c) + 2 omega x P eta_t)
    p      2 G^T (c x z + J alpha + R eta_tt + Rdot eta_t + Jdot omega + omega x (J omega + R eta_t))
    eta_a  P_a.z + R_a.alpha + m_a eta_a_tt + (Rdot_a - R1_a eta_t).omega - omega.J_a omega / 2
           + k_a eta_a + d_a eta_a_t

with J_a = J1_a + 2 eta_b J2_ab the derivative of J. Nothing but the modes is linearised: T is that of modal_data.py.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.bodies.pose import pose_coordinates
from dms_core.model.element import Body, Coordinate, Pattern, Placement, Quaternion, Vector
from dms_core.model.flexible.modal.frame_sums import (
    FRAME,
    MODE,
    PAIR,
    ZERO,
    combined,
    inertia_by,
    inertia_rate_times,
    inertia_times,
    mode_at,
    motion,
    pair_at,
    rotation_by,
    rotation_of,
    rotation_rate,
    rotations_times,
    spin,
    spin_pull,
    sym_times,
)
from dms_core.model.flexible.modal.modal_data import ModalData
from dms_core.model.geometry.frames import euler_rates
from dms_core.model.geometry.quaternions import PARAMETERS, conjugate
from dms_core.model.geometry.rotations import (
    AXES,
    add,
    bilinear,
    cross,
    dot,
    euler_parameters,
    rotated,
    scale,
    sub,
    vec,
)
from dms_core.model.places import numbers_at


@compiled
def frame_force(par, n, a, s):
    """What the row of r has besides m r_tt, in body axes."""
    f = add(cross(s.alpha, s.c), combined(par, n, MODE.translation, a))
    return add(f, add(cross(s.omega, cross(s.omega, s.c)), scale(2.0, cross(s.omega, s.c_t))))


@compiled
def frame_moment(par, n, q, v, a, s):
    """Moment about the origin in body axes."""
    t = add(cross(s.c, s.z), add(inertia_times(par, n, q, s.alpha), rotations_times(par, n, q, a)))
    for k in range(n):
        t = add(t, scale(v[7 + k], rotation_rate(par, n, k, v)))
    return add(t, add(inertia_rate_times(par, n, q, v, s.omega), cross(s.omega, s.Jo)))


@compiled
def mode_row(par, n, k, q, v, a, s):
    """Row of mode k."""
    at = mode_at(k)
    gyro = sub(rotation_rate(par, n, k, v), rotation_by(par, n, k, v))
    return (
        dot(vec(par, at + MODE.translation), s.z) + dot(rotation_of(par, n, k, q), s.alpha)
        + par[at + MODE.mass] * a[7 + k] + dot(gyro, s.omega)
        - 0.5 * dot(s.omega, inertia_by(par, n, k, q, s.omega))
        + par[at + MODE.stiffness] * q[7 + k] + par[at + MODE.damping] * v[7 + k]
    )  # fmt: skip


@compiled
def _put(J, column, q, f, t):
    """Force and moment in body axes into the rows of r and p of one column."""
    g, h = rotated(q, 0, f), spin_pull(euler_parameters(q, 0), t)
    for i in range(3):
        J[i, column] += g[i]
    for i in range(4):
        J[3 + i, column] += h[i]


@compiled
def _put_motion(par, n, q, v, s, dz, dw, da, J, column):
    """Derivative along changes of z, omega, alpha into one column."""
    f = add(cross(da, s.c), add(cross(dw, cross(s.omega, s.c)), cross(s.omega, cross(dw, s.c))))
    f = add(f, scale(2.0, cross(dw, s.c_t)))
    t = add(cross(s.c, dz), add(inertia_times(par, n, q, da), inertia_rate_times(par, n, q, v, dw)))
    t = add(t, add(cross(dw, s.Jo), cross(s.omega, inertia_times(par, n, q, dw))))
    _put(J, column, q, f, t)
    for k in range(n):
        gyro = sub(rotation_rate(par, n, k, v), rotation_by(par, n, k, v))
        J[7 + k, column] += (
            dot(vec(par, mode_at(k) + MODE.translation), dz) + dot(rotation_of(par, n, k, q), da)
            + dot(gyro, dw) - dot(dw, inertia_by(par, n, k, q, s.omega))
        )  # fmt: skip


@compiled
def _frame_derivatives(par, n, q, v, a, s, f, t, Jq, Jv, Ja):
    """Columns of r, p and their rates."""
    p, back = euler_parameters(q, 0), conjugate(euler_parameters(q, 0))
    for i in range(3):
        Ja[i, i] += par[FRAME.mass]
        _put_motion(par, n, q, v, s, bilinear(back, back, AXES[i]), ZERO, ZERO, Ja, i)
    for i in range(4):
        e = PARAMETERS[i]
        dz = scale(2.0, bilinear(back, conjugate(e), vec(a, 0)))
        dw, da = spin(e, euler_parameters(v, 0)), spin(e, euler_parameters(a, 0))
        _put_motion(par, n, q, v, s, dz, dw, da, Jq, 3 + i)
        g, h = scale(2.0, bilinear(p, e, f)), spin_pull(e, t)
        for k in range(3):
            Jq[k, 3 + i] += g[k]
        for k in range(4):
            Jq[3 + k, 3 + i] += h[k]
        w = spin(p, e)
        _put_motion(par, n, q, v, s, ZERO, w, ZERO, Jv, 3 + i)
        _put_motion(par, n, q, v, s, ZERO, ZERO, w, Ja, 3 + i)


@compiled
def _mode_derivatives(par, n, k, q, v, a, s, Jq, Jv, Ja):
    """Columns of mode k and its rates."""
    at, column, w = mode_at(k), 7 + k, s.omega
    P, R = vec(par, at + MODE.translation), rotation_of(par, n, k, q)
    # By eta_k.
    f = add(cross(s.alpha, P), cross(w, cross(w, P)))
    t = add(cross(P, s.z), add(inertia_by(par, n, k, q, s.alpha), rotation_by(par, n, k, a)))
    t = add(t, cross(w, add(inertia_by(par, n, k, q, w), rotation_by(par, n, k, v))))
    for b in range(n):
        both = pair_at(n, k, b)
        curved = sym_times(par, both + PAIR.inertia, w)
        t = add(t, scale(2.0 * v[7 + b], curved))
        R1 = vec(par, both + PAIR.rotation)
        Jq[7 + b, column] += dot(R1, s.alpha) - dot(w, curved)
        # By its rate.
        Jv[7 + b, column] += dot(sub(R1, vec(par, pair_at(n, b, k) + PAIR.rotation)), w)
    Jq[column, column] += par[at + MODE.stiffness]
    _put(Jq, column, q, f, t)
    t = add(rotation_rate(par, n, k, v), rotation_by(par, n, k, v))
    t = add(t, add(inertia_by(par, n, k, q, w), cross(w, R)))
    Jv[column, column] += par[at + MODE.damping]
    _put(Jv, column, q, scale(2.0, cross(w, P)), t)
    Ja[column, column] += par[at + MODE.mass]
    _put(Ja, column, q, P, R)


@compiled
def floating_frame(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: number of modes."""
    n = ip[0]
    s = motion(par, n, q, v, a)
    f, t = frame_force(par, n, a, s), frame_moment(par, n, q, v, a, s)
    g, h = rotated(q, 0, f), spin_pull(euler_parameters(q, 0), t)
    for i in range(3):
        r[i] += par[FRAME.mass] * a[i] + g[i]
    for i in range(4):
        r[3 + i] += h[i]
    for k in range(n):
        r[7 + k] += mode_row(par, n, k, q, v, a, s)
    if level > 0:
        _frame_derivatives(par, n, q, v, a, s, f, t, Jq, Jv, Ja)
        for k in range(n):
            _mode_derivatives(par, n, k, q, v, a, s, Jq, Jv, Ja)


def modes_of(frame: str, data: ModalData) -> tuple[str, ...]:
    """Full names of the modal coordinates of a floating frame."""
    return tuple(f"{frame}.mode{k}" for k in range(data.size))


class FloatingFrame(Body):
    """Frame of a modal body, which its modes deform; declared by `modal_body`. Joints may attach to it like to a body.

    Its coordinates are its origin, its Euler parameters, and the modal coordinates `mode0`, `mode1`, ...
    """

    kind: ClassVar[str] = "floating_frame"
    kernel: ClassVar = floating_frame
    data: ModalData = Field(description="invariants")
    damping_ratio: float = Field(default=0.0, ge=0.0, description="of each mode, for itself [-]")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="origin at the start [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="Euler parameters at the start, scalar first [-]; normalised"
    )
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="of the origin at the start, ground axes [m/s]")
    angular_velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start, ground axes [rad/s]")

    @model_validator(mode="before")
    @classmethod
    def _unit(cls, values):
        p = values.get("orientation", (1.0, 0.0, 0.0, 0.0))
        length = float(np.linalg.norm(p))
        if not length > 1e-6:
            raise ValueError(f"orientation = {p}: Expected Euler parameters of a length above 0")
        return {**values, "orientation": tuple(float(x) / length for x in p)}

    @property
    def mass(self) -> float:
        """Of the body [kg]."""
        return self.data.mass

    @property
    def modes(self) -> tuple[str, ...]:
        """Full names of the modal coordinates."""
        return modes_of(self.name, self.data)

    def coordinates(self) -> tuple[Coordinate, ...]:
        """Origin [m], Euler parameters [-] and modal coordinates, undeformed at the start."""
        p_rate = euler_rates(self.orientation, self.angular_velocity)
        rigid = pose_coordinates(self.position, self.orientation, self.velocity, p_rate)
        modal = zip(self.data.modal_mass, self.data.modal_stiffness, strict=True)
        # A mode of mass 1 kg moves by 1 m at eta = 1; its nominal size is a hundredth of that.
        sizes = [(0.01 * (self.mass / m) ** 0.5, (k / m) ** 0.5) for m, k in modal]
        return rigid + tuple(
            Coordinate(f"mode{k}", 0.0, 0.0, size, size * max(w, 1.0)) for k, (size, w) in enumerate(sizes)
        )

    def mass_moments(self, system) -> dict[str, np.ndarray]:
        """c_0, then the columns of P."""
        return {self.name: np.array([self.data.mass_moment, *self.data.translation])}

    def place(self, system) -> Placement:
        """The frame with its modes, and the invariants."""
        d = self.data
        rows = zip(d.modal_mass, d.modal_stiffness, d.translation, d.rotation, d.inertia_rate, strict=True)
        blocks = [
            numbers_at(
                MODE, mass=m, stiffness=k, damping=2.0 * self.damping_ratio * (k * m) ** 0.5, translation=P, rotation=R,
                inertia=J,
            )
            for m, k, P, R, J in rows
        ]  # fmt: skip
        pairs = [
            numbers_at(PAIR, rotation=R, inertia=J)
            for one in zip(d.rotation_rate, d.inertia_curvature, strict=True)
            for R, J in zip(*one, strict=True)
        ]
        numbers = numbers_at(
            FRAME, mass=d.mass, moment=d.mass_moment, inertia=d.inertia, modes=np.concatenate([*blocks, *pairs])
        )
        full = np.ones((7 + d.size, 7 + d.size), bool)
        by_state, by_acceleration = full.copy(), full.copy()
        by_state[:, :3] = False
        by_acceleration[:3, :3] = np.eye(3, dtype=bool)
        return Placement(
            bodies=(self.name,), coordinates=self.modes, integers=(d.size,), numbers=numbers,
            pattern=Pattern(by_state, by_state, by_acceleration),
        )  # fmt: skip

"""Invariants of a modal body as its kernel uses them: where they stand, and their sums over modes (modal_data.py)."""

from __future__ import annotations

from typing import NamedTuple

from dms_core.compiled.jit import compiled
from dms_core.model.geometry.quaternions import conjugate, product
from dms_core.model.geometry.rotations import add, bilinear, combination, euler_parameters, scale, vec


class FrameNumbers(NamedTuple):
    """Places of the kernel's numbers: then come n blocks of ModeNumbers and n x n of PairNumbers."""

    mass: int = 0
    moment: int = 1
    inertia: int = 4
    modes: int = 10


class ModeNumbers(NamedTuple):
    """Places within the block of one mode."""

    mass: int = 0
    stiffness: int = 1
    damping: int = 2
    translation: int = 3
    rotation: int = 6
    inertia: int = 9
    """J1."""


class PairNumbers(NamedTuple):
    """Places within the block of two modes a, b, at number a n + b."""

    rotation: int = 0
    """R1_a of mode b."""
    inertia: int = 3
    """J2_ab."""


FRAME, MODE, PAIR = FrameNumbers(), ModeNumbers(), PairNumbers()
MODE_SIZE, PAIR_SIZE = 15, 9
ZERO = (0.0, 0.0, 0.0)


class Motion(NamedTuple):
    """Velocities and accelerations of the frame, in its axes, and what follows from the modes' state."""

    z: tuple
    omega: tuple
    alpha: tuple
    c: tuple
    c_t: tuple
    """P eta_t."""
    Jo: tuple
    """J omega + R eta_t."""


@compiled
def mode_at(a):
    """Place of the block of mode a."""
    return FRAME.modes + MODE_SIZE * a


@compiled
def pair_at(n, a, b):
    """Place of the block of the modes a, b out of n."""
    return FRAME.modes + MODE_SIZE * n + PAIR_SIZE * (a * n + b)


@compiled
def spin(p, x):
    """2 G(p) x."""
    c = product(conjugate(p), x)
    return (2.0 * c[1], 2.0 * c[2], 2.0 * c[3])


@compiled
def spin_pull(p, t):
    """2 G(p)^T t."""
    c = product(p, (0.0, t[0], t[1], t[2]))
    return (2.0 * c[0], 2.0 * c[1], 2.0 * c[2], 2.0 * c[3])


@compiled
def sym_times(par, at, w):
    """J w for the six numbers of J from `at`."""
    return (
        par[at] * w[0] + par[at + 3] * w[1] + par[at + 4] * w[2],
        par[at + 3] * w[0] + par[at + 1] * w[1] + par[at + 5] * w[2],
        par[at + 4] * w[0] + par[at + 5] * w[1] + par[at + 2] * w[2],
    )


@compiled
def combined(par, n, place, x):
    """Sum over modes of their triple at `place` times x[7 + a]: P or R_0 times rates, or c less c_0."""
    return combination(ZERO, par, mode_at(0) + place, MODE_SIZE, n, x, 7)


@compiled
def rotation_of(par, n, a, q):
    """R_a at eta."""
    R_0 = vec(par, mode_at(a) + MODE.rotation)
    return combination(R_0, par, pair_at(n, 0, a) + PAIR.rotation, PAIR_SIZE * n, n, q, 7)


@compiled
def rotation_rate(par, n, a, x):
    """Sum over b of x[7 + b] R1_b of mode a: Rdot_a for the rates."""
    return combination(ZERO, par, pair_at(n, 0, a) + PAIR.rotation, PAIR_SIZE * n, n, x, 7)


@compiled
def rotation_by(par, n, a, x):
    """Sum over b of R1_a of mode b times x[7 + b]: derivative of R x by eta_a."""
    return combination(ZERO, par, pair_at(n, a, 0) + PAIR.rotation, PAIR_SIZE, n, x, 7)


@compiled
def inertia_by(par, n, a, q, w):
    """J_a w, J_a the derivative of J by eta_a at eta."""
    s = sym_times(par, mode_at(a) + MODE.inertia, w)
    for b in range(n):
        s = add(s, scale(2.0 * q[7 + b], sym_times(par, pair_at(n, a, b) + PAIR.inertia, w)))
    return s


@compiled
def inertia_times(par, n, q, w):
    """J w at eta."""
    s = sym_times(par, FRAME.inertia, w)
    for a in range(n):
        s = add(s, scale(q[7 + a], sym_times(par, mode_at(a) + MODE.inertia, w)))
        for b in range(n):
            s = add(s, scale(q[7 + a] * q[7 + b], sym_times(par, pair_at(n, a, b) + PAIR.inertia, w)))
    return s


@compiled
def inertia_rate_times(par, n, q, v, w):
    """Jdot w."""
    s = ZERO
    for a in range(n):
        s = add(s, scale(v[7 + a], inertia_by(par, n, a, q, w)))
    return s


@compiled
def rotations_times(par, n, q, x):
    """R x, x the modal part of v or a."""
    s = ZERO
    for a in range(n):
        s = add(s, scale(x[7 + a], rotation_of(par, n, a, q)))
    return s


@compiled
def motion(par, n, q, v, a):
    """The state as the equations need it."""
    p, r_tt = euler_parameters(q, 0), vec(a, 0)
    back = conjugate(p)
    omega = spin(p, euler_parameters(v, 0))
    return Motion(
        bilinear(back, back, r_tt), omega, spin(p, euler_parameters(a, 0)),
        add(vec(par, FRAME.moment), combined(par, n, MODE.translation, q)), combined(par, n, MODE.translation, v),
        add(inertia_times(par, n, q, omega), rotations_times(par, n, q, v)),
    )  # fmt: skip

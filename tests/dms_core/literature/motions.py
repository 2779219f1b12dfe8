"""Rigid motions with references good to twelve digits, none of them from this project's solver.

Each is a model, times, and all its coordinates there: from a closed form, or from equations in minimal coordinates that
scipy's DOP853 solves at 1e-13.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk, ellipkinc

from dms_core import Model
from dms_core.model import Gravity, RigidBody, Spherical, System
from dms_core.model.geometry.frames import g_matrix, rotation_matrix
from tests.arm26 import REFERENCE
from tests.dms_core.literature.chain import G, chain


@dataclass(frozen=True)
class Motion:
    """A model and where it is at given times."""

    model: Callable[[], Model]
    times: np.ndarray
    """Ascending [s]; the last one is the end of the run."""
    positions: Callable[[np.ndarray], np.ndarray]
    """All coordinates at these times, shape (k, n_q)."""


def solved(rates: Callable, start: list[float], times: np.ndarray) -> np.ndarray:
    """States of ydot = rates(t, y) at the times, shape (k, n)."""
    grid = np.unique(np.concatenate([[0.0], times]))
    y = solve_ivp(rates, (0.0, grid[-1]), start, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=grid).y.T
    return y[np.searchsorted(grid, times)]


def pendulum_positions(times: np.ndarray) -> np.ndarray:
    """All coordinates of the chain of two rods at whole seconds: a double's rounding would grow to 2e-9 in 10 s."""
    rows = np.array(json.loads((REFERENCE / "dae" / "double_pendulum.json").read_text())["reference"]["rows"])
    angles, q = rows[np.searchsorted(rows[:, 0], times), 1:], np.zeros((len(times), 14))
    way = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    q[:, 0:2], q[:, 7:9] = way[:, 0], 2.0 * way[:, 0] + way[:, 1]
    q[:, [3, 10]], q[:, [6, 13]] = np.cos(angles / 2.0), np.sin(angles / 2.0)
    return q


BODY = np.array([0.02, 0.03, 0.045])
"""Principal moments of inertia of the free body [kg m^2]."""
SPIN = np.array([0.02, 2.0, 0.02])
"""Its angular velocity at the start, about the middle axis but for a hundredth [rad/s]."""


def tumbling_spin(times: np.ndarray, spin: np.ndarray = SPIN) -> np.ndarray:
    """Angular velocity in body axes: Jacobi's elliptic functions (Landau and Lifshitz, Mechanics, sect. 37).

    For 2 E J2 < L^2 it turns about the third axis: omega = (w1 cn, w2 sn, w3 dn), with the phase of the start.
    """
    J1, J2, J3 = BODY
    E2, L2 = BODY @ spin**2, ((BODY * spin) ** 2).sum()
    assert L2 > E2 * J2
    w1 = np.sqrt((E2 * J3 - L2) / (J1 * (J3 - J1)))
    w2 = np.sqrt((E2 * J3 - L2) / (J2 * (J3 - J2)))
    w3 = np.sqrt((L2 - E2 * J1) / (J3 * (J3 - J1)))
    rate = np.sqrt((J3 - J2) * (L2 - E2 * J1) / (J1 * J2 * J3))
    m = (J2 - J1) * (E2 * J3 - L2) / ((J3 - J2) * (L2 - E2 * J1))
    phase = _inverse_sn(spin[1] / w2, spin[0], m)
    sn, cn, dn, _ = ellipj(rate * times + phase, m)
    return np.column_stack([w1 * cn, w2 * sn, w3 * dn])


def _inverse_sn(value: float, cosine: float, m: float) -> float:
    """u with sn(u) = value and cn(u) of the sign of `cosine`."""
    u = float(ellipkinc(np.arcsin(value), m))
    return u if cosine > 0.0 else 2.0 * float(ellipk(m)) - u


def tumbling_positions(times: np.ndarray, spin: np.ndarray = SPIN, start=(1.0, 0.0, 0.0, 0.0)) -> np.ndarray:
    """Place and Euler parameters of the free body: its attitude follows from the closed form of its spin."""

    def rates(t, p):  # noqa: ANN001, ANN202
        return 0.5 * g_matrix(p).T @ tumbling_spin(np.array([t]), spin)[0]

    p = solved(rates, list(start), times)
    return np.column_stack([np.zeros((len(times), 3)), p])


def tumbling_body() -> Model:
    """No force, no constraint but the norm of the Euler parameters."""
    body = RigidBody(name="body", mass=1.0, inertia=tuple(BODY), angular_velocity=tuple(SPIN))
    return Model(System("tumbling body", bodies=[body]))


TOP_MASS, TOP_INERTIA, TOP_SPIN = 15.0, np.array([0.234375, 0.46875, 0.234375]), (0.0, 150.0, -4.61538)
ARM = np.array([0.0, 1.0, 0.0])
"""From the fixed point to the centre of mass [m], in the body."""


def heavy_top() -> Model:
    """The fast top of Geradin and Cardona (2001), as in Bruls, Cardona and Arnold (2012), on a spherical joint."""
    body = RigidBody(name="top", mass=TOP_MASS, inertia=tuple(TOP_INERTIA), position=tuple(ARM),
                     velocity=tuple(np.cross(TOP_SPIN, ARM)), angular_velocity=TOP_SPIN)  # fmt: skip
    joint = Spherical(name="tip", body_j="top", point_j=tuple(-ARM))
    return Model(System("heavy top", bodies=[body], constraints=[joint],
                        forces=[Gravity(name="gravity", acceleration=(0.0, 0.0, -G))]))  # fmt: skip


def top_positions(times: np.ndarray) -> np.ndarray:
    """Euler's equations about the fixed point."""
    J = np.diag(TOP_INERTIA) + TOP_MASS * (np.eye(3) - np.outer(ARM, ARM))

    def rates(_t, y):  # noqa: ANN001, ANN202
        p, w = y[:4], y[4:]
        weight = rotation_matrix(p / np.linalg.norm(p)).T @ np.array([0.0, 0.0, -TOP_MASS * G])
        return [*(0.5 * g_matrix(p).T @ w), *np.linalg.solve(J, np.cross(ARM, weight) - np.cross(w, J @ w))]

    p = solved(rates, [1.0, 0.0, 0.0, 0.0, *TOP_SPIN], times)[:, :4]
    p /= np.linalg.norm(p, axis=1)[:, None]
    return np.column_stack([[rotation_matrix(x) @ ARM for x in p], p])


SECONDS = np.arange(1.0, 11.0)
MOTIONS = {
    "double pendulum": Motion(lambda: Model(chain(2)), SECONDS, pendulum_positions),
    "tumbling body": Motion(tumbling_body, SECONDS, tumbling_positions),
    "heavy top": Motion(heavy_top, SECONDS / 5.0, top_positions),
}

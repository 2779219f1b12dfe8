"""Interface frame held to a node of a modal body: six rows, of the frame (r, p), its modes eta, the interface (s, o).

    s - r - A (x + Psi eta) = 0                                     (3)   Psi, Theta: displacement and small rotation
    2 G(p) o - (p.o) Theta eta = 0                                  (3)   of the node in each mode, in the frame's axes

For unit Euler parameters conj(p) o is (c, e) with 2 e = c Theta eta: the interface is turned from the frame about
Theta eta by an angle whose tangent of a half is half its length.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.element import Constraint, ConstraintPattern, Placement, Vector
from dms_core.model.flexible.modal.floating_frame import FloatingFrame
from dms_core.model.geometry.quaternions import PARAMETERS, conjugate, inner4, product
from dms_core.model.geometry.rotations import (
    AXES,
    add,
    add_hessian,
    add_row_hessian,
    columns,
    combination,
    dot,
    euler_parameters,
    point,
    rotated,
    rotated_rate,
    vec,
)

FIRST = 14
"""First modal coordinate among the local ones."""


class NodeNumbers(NamedTuple):
    """Places of the kernel's numbers: x, then the displacement and the rotation in each mode."""

    x: int = 0
    shapes: int = 3


NODE = NodeNumbers()


@compiled
def shape(par, k, rotation):
    """Displacement (0) or rotation (1) of the node in mode k."""
    return vec(par, NODE.shapes + 6 * k + 3 * rotation)


@compiled
def shapes_times(par, n, rotation, x):
    """Psi or Theta times the modal part of q or v."""
    return combination((0.0, 0.0, 0.0), par, NODE.shapes + 3 * rotation, 6, n, x, FIRST)


@compiled
def vector_part(c):
    """(c1, c2, c3) of a 4-tuple."""
    return (c[1], c[2], c[3])


@compiled
def relative(p, o):
    """conj(p) o."""
    return product(conjugate(p), o)


@compiled
def modal_node(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """ip: number of modes."""
    n = ip[0]
    s, theta = add(vec(par, NODE.x), shapes_times(par, n, 0, q)), shapes_times(par, n, 1, q)
    p, o = euler_parameters(q, 0), euler_parameters(q, 7)
    at, c, by_p = point(q, 0, s), relative(p, o), columns(q, 0, s)
    for i in range(3):
        phi[i] = q[7 + i] - at[i]
        phi[3 + i] = 2.0 * c[1 + i] - c[0] * theta[i]
        G[i, 7 + i] += 1.0
        G[i, i] -= 1.0
        for k in range(4):
            G[i, 3 + k] -= by_p[k][i]
            G[3 + i, 3 + k] += 2.0 * relative(PARAMETERS[k], o)[1 + i] - o[k] * theta[i]
            G[3 + i, 10 + k] += 2.0 * relative(p, PARAMETERS[k])[1 + i] - p[k] * theta[i]
    for k in range(n):
        moved, turned = rotated(q, 0, shape(par, k, 0)), shape(par, k, 1)
        for i in range(3):
            G[i, FIRST + k] -= moved[i]
            G[3 + i, FIRST + k] -= c[0] * turned[i]
    if level > 0:
        _rates(par, n, s, theta, q, v, W)
        _curvature(par, n, s, theta, q, (lam[0], lam[1], lam[2]), (lam[3], lam[4], lam[5]), H)


@compiled
def _rates(par, n, s, theta, q, v, W):
    """(phi_q v)_q."""
    p, o, p_t, o_t = euler_parameters(q, 0), euler_parameters(q, 7), euler_parameters(v, 0), euler_parameters(v, 7)
    theta_t, deforming = shapes_times(par, n, 1, v), columns(q, 0, shapes_times(par, n, 0, v))
    rate = inner4(p_t, o) + inner4(p, o_t)
    for i in range(3):
        add_row_hessian(W, i, 0, v, AXES[i], s, -1.0)
        for k in range(4):
            e = PARAMETERS[k]
            W[i, 3 + k] -= deforming[k][i]
            W[3 + i, 3 + k] += 2.0 * relative(e, o_t)[1 + i] - o_t[k] * theta[i] - o[k] * theta_t[i]
            W[3 + i, 10 + k] += 2.0 * relative(p_t, e)[1 + i] - p_t[k] * theta[i] - p[k] * theta_t[i]
    for k in range(n):
        turning, turned = rotated_rate(q, v, 0, shape(par, k, 0)), shape(par, k, 1)
        for i in range(3):
            W[i, FIRST + k] -= turning[i]
            W[3 + i, FIRST + k] -= rate * turned[i]


@compiled
def _curvature(par, n, s, theta, q, force, moment, H):
    """(phi_q^T lam)_q."""
    p, o, along = euler_parameters(q, 0), euler_parameters(q, 7), dot(moment, theta)
    add_hessian(H, 0, force, s, -1.0)
    for k in range(4):
        for m in range(4):
            h = 2.0 * dot(moment, vector_part(relative(PARAMETERS[k], PARAMETERS[m]))) - (along if k == m else 0.0)
            H[3 + k, 10 + m] += h
            H[10 + m, 3 + k] += h
    for k in range(n):
        by_p, turned = columns(q, 0, shape(par, k, 0)), dot(moment, shape(par, k, 1))
        for m in range(4):
            h, g = -dot(by_p[m], force) - o[m] * turned, -p[m] * turned
            H[3 + m, FIRST + k] += h
            H[FIRST + k, 3 + m] += h
            H[10 + m, FIRST + k] += g
            H[FIRST + k, 10 + m] += g


class ModalNode(Constraint):
    """Interface frame on a node of a modal body; declared by `modal_body`."""

    kind: ClassVar[str] = "modal_node"
    kernel: ClassVar = modal_node
    frame: str = Field(description="floating frame")
    interface: str = Field(description="interface frame")
    point: Vector = Field(description="node in the floating frame, undeformed [m]")
    translations: tuple[Vector, ...] = Field(description="displacement of the node in each mode [m]")
    rotations: tuple[Vector, ...] = Field(description="rotation of the node in each mode [rad]")

    @model_validator(mode="after")
    def _alike(self) -> Self:
        if len(self.rotations) != len(self.translations):
            raise ValueError(
                f"rotations: Expected {len(self.translations)} items, as many as translations, got "
                f"{len(self.rotations)}"
            )
        return self

    def rows(self) -> tuple[str, ...]:
        """Coincidence in ground axes, then rotation in axes of the frame."""
        return ("x", "y", "z", "turn_x", "turn_y", "turn_z")

    def place(self, system) -> Placement:
        """Frame, interface and modes."""
        frame = system.element(self.frame, FloatingFrame)
        n = len(self.translations)
        numbers = np.concatenate([self.point, np.hstack([self.translations, self.rotations]).ravel()])
        G, H = np.ones((6, FIRST + n), bool), np.ones((FIRST + n, FIRST + n), bool)
        G[:3, 10:14] = G[3:, :3] = G[3:, 7:10] = False
        G[:3, :3] = G[:3, 7:10] = np.eye(3, dtype=bool)
        W = G.copy()
        W[:, :3] = W[:, 7:10] = False
        H[:3] = H[7:10] = False
        H[:, :3] = H[:, 7:10] = False
        H[10:14, 10:14] = H[FIRST:, FIRST:] = False
        return Placement(
            bodies=(self.frame, self.interface), coordinates=frame.modes, integers=(n,),
            numbers=tuple(map(float, numbers)), pattern=ConstraintPattern(G, W, H),
        )  # fmt: skip

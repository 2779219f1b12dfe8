"""Intrabody equation of a rigid body (paper eq. 9): p^T p - 1 = 0. One row, added by the system itself."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Constraint, ConstraintPattern, Placement


@compiled
def euler_norm(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H):
    """p^T p - 1."""
    phi[0] = -1.0
    for k in range(3, 7):
        phi[0] += q[k] * q[k]
        G[0, k] = 2.0 * q[k]
        if level > 0:
            W[0, k] = 2.0 * v[k]
            H[k, k] = 2.0 * lam[0]


class EulerNorm(Constraint):
    """Unit length of a body's Euler parameters."""

    kind: ClassVar[str] = "euler_norm"
    kernel: ClassVar = euler_norm
    body: str = Field(description="rigid body")

    def rows(self) -> tuple[str, ...]:
        """One."""
        return ("norm",)

    def place(self, system) -> Placement:
        """One body, no numbers."""
        p = np.arange(7) >= 3
        return Placement(bodies=(self.body,), pattern=ConstraintPattern(p[None, :], p[None, :], np.diag(p)))

"""Load of a bushing, as a sensor in the rubber would tell it: its six components by the bushing's own law.

    F_k = curve_k(y_k) + c_k ydot_k       (bushing.py)

They follow from positions and rates alone, so that a controller may read them: a compliant cuff is its own load cell.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor
from dms_core.model.forces.bushing import BUSHING, Bushing, add_second, put_deflections
from dms_core.model.forces.load_curve import curve_load


@compiled(makes_arrays=True)
def bushing_load(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Tables of the bushing."""
    deflection, G = np.zeros(6), np.zeros((6, 14))
    put_deflections(par, q, v, deflection, G)
    for k in range(6):
        load, stiffness = curve_load(par, ip[k], deflection[k])
        c, rate = par[BUSHING.damping + k], 0.0
        for j in range(14):
            rate += G[k, j] * v[j]
        y[k] = load + c * rate
        if level > 0:
            for j in range(14):
                Yq[k, j], Yv[k, j] = stiffness * G[k, j], c * G[k, j]
    if level > 0:
        W = np.zeros((6, 14))
        add_second(par, q, v, np.zeros(6), W, np.zeros((14, 14)))
        for k in range(6):
            for j in range(14):
                Yq[k, j] += par[BUSHING.damping + k] * W[k, j]


class BushingLoad(Sensor):
    """Forces along and moments about the axes of a bushing, above 0 where its deflections are: it pulls body_j back.

    Unlike a `force_load`, whose moments are about a point of a body, controllers may read it.
    """

    kind: ClassVar[str] = "bushing_load"
    kernel: ClassVar = bushing_load
    bushing: str = Field(description="name of the bushing")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Forces [N] and moments [Nm]."""
        return tuple((f"{c}{axis}", unit) for c, unit in (("F", "N"), ("M", "Nm")) for axis in "xyz")

    def place(self, system) -> Placement:
        """Bodies and numbers of the bushing."""
        own = system.element(self.bushing, Bushing).place(system)
        return Placement(bodies=own.bodies, integers=own.integers, numbers=own.numbers)

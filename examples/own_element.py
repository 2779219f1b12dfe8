"""How do I add a force of my own to the arm? An element is a declaration and a kernel; an ecosystem takes it in."""

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from dms_core.kernels import compiled
from dms_core.model.element import Force, Placement
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.envs.elbow_lift import ElbowLiftEnv


@compiled
def drag(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """F = -c v on the centre of mass: r is M vdot - f, so +c v."""
    for i in range(3):
        r[i] += par[0] * v[i]
        if level > 0:
            Jv[i, i] += par[0]


class Drag(Force):
    """Viscous drag on a body."""

    kind: ClassVar[str] = "drag"
    kernel: ClassVar = drag
    body: str = Field(description="that is dragged")
    c: float = Field(ge=0.0, description="[N s/m]")

    def place(self, system):
        return Placement(bodies=(self.body,), numbers=(self.c,))


class Water:
    def bodies(self, flexion):
        return []

    def joints(self):
        return []

    def forces(self):
        return [Drag(name="water", body="forearm", c=30.0)]


class InWater(Ecosystem):
    def more_parts(self, arm, worn):
        return [Water()]


class InWaterEnv(ElbowLiftEnv):
    ecosystem_type: ClassVar = InWater


for env_type in (ElbowLiftEnv, InWaterEnv):
    env = env_type(patient={"maximum_activation_flexors": 0.0}, load=1.0)
    env.reset(seed=0)
    for _ in range(15):
        env.step(np.array([-1.0, -1.0]))  # both ropes slack: the arm falls
    print(f"{env_type.__name__:12} {math.degrees(env.readings()['elbow_angle.rate']):7.1f} deg/s")

"""Small systems of the estimation tests."""

from __future__ import annotations

import math

from dms_core.model import (
    Constant,
    Input,
    JointAngle,
    JointSpringDamper,
    LineGuide,
    LumpedLoad,
    Point,
    PointMass,
    Spherical,
    SpringDamper,
    System,
)
from tests.dms_core.analyses.mechanisms import four_bar, hinge, rod


def masses(n: int = 2, stiffness: float = 40.0, damping: float = 0.4) -> System:
    """Masses on a track, the first on a spring at the wall, each other at the one before; a force on the last."""
    names = [f"m{k}" for k in range(n)]
    bodies = [PointMass(name=name, mass=1.0 + 0.3 * k, position=(1.0 + k, 0.0, 0.0)) for k, name in enumerate(names)]
    at = [(0.0, 0.0, 0.0)]
    springs = [
        SpringDamper(
            name=f"spring{k}", body_i=names[k - 1] if k else "ground", body_j=name, point_i=at[0],
            stiffness=stiffness, damping=damping, free_length=1.0,
        )
        for k, name in enumerate(names)
    ]  # fmt: skip
    push = LumpedLoad(name="push", body=names[-1], force=(1.0, 0.0, 0.0), input="force")
    return System(
        "masses", bodies=bodies,
        constraints=[LineGuide(name=f"track{k}", body_j=name, axis_i=(1.0, 0.0, 0.0)) for k, name in enumerate(names)],
        forces=[*springs, push], sensors=[Point(name=f"at{k}", body=name) for k, name in enumerate(names)],
        inputs=[Input(name="force", signal=Constant(value=0.0))],
    )  # fmt: skip


def slider_crank(force: float = 0.0) -> System:
    """A crank of 0.1 m, a rod of 0.3 m and a piston along x, pushed by a force."""
    crank, long, turn = 0.1, 0.3, 0.7
    pin = (crank * math.cos(turn), crank * math.sin(turn), 0.0)
    lean = -math.asin(pin[1] / long)
    end = pin[0] + long * math.cos(lean)
    return System(
        "slider-crank",
        bodies=[
            rod("crank", crank, 1.0, angle=turn),
            rod("rod", long, 0.5, pin, lean), PointMass(name="piston", mass=0.4, position=(end, 0.0, 0.0)),
        ],
        constraints=[
            hinge("main", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            hinge("pin", "crank", "rod", (crank, 0.0, 0.0), (0.0, 0.0, 0.0)),
            LineGuide(name="bore", body_j="piston", axis_i=(1.0, 0.0, 0.0)),
            Spherical(name="wrist", body_i="rod", body_j="piston", point_i=(long, 0.0, 0.0)),
        ],
        forces=[
            JointSpringDamper(name="friction", joint="main", damping=0.02),
            LumpedLoad(name="gas", body="piston", force=(1.0, 0.0, 0.0), input="force"),
        ],
        sensors=[JointAngle(name="encoder", joint="main"), Point(name="piston_at", body="piston")],
        inputs=[Input(name="force", signal=Constant(value=force))],
    )  # fmt: skip


def driven_four_bar(torque: float = 0.0) -> System:
    """A four-bar whose crank is turned by an unknown moment, with friction."""
    return four_bar(
        (0.1, 0.25, 0.22, 0.3), None, crank_angle=0.8,
        forces=[
            JointSpringDamper(name="friction", joint="main_bearing", damping=0.05),
            LumpedLoad(name="shaft", body="crank", moment=(0.0, 0.0, 1.0), input="torque"),
        ],
        inputs=[Input(name="torque", signal=Constant(value=torque))],
    )  # fmt: skip

"""One mechanism with an element of every kind in it, and states at which to differentiate it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.assembly.layout import Layout
from dms_core.assembly.model import Model
from dms_core.model import (
    AngleDriver,
    Belt,
    Bushing,
    Constant,
    Cylindrical,
    Distance,
    DrumRope,
    FirstOrder,
    Fixed,
    Gear,
    Gravity,
    Harmonic,
    Input,
    JointMotor,
    JointSpringDamper,
    JointStop,
    JointTerm,
    LinearCoupling,
    LineGuide,
    LumpedLoad,
    MinimumJerk,
    PathPoint,
    Pid,
    Planar,
    PlaneGuide,
    PointMass,
    PositionDriver,
    Rack,
    ReferenceFilter,
    Revolute,
    RigidBody,
    RopeActuator,
    RopeForce,
    RopeLength,
    Screw,
    SecondOrder,
    Slider,
    Spherical,
    SpringDamper,
    System,
    ThelenMuscle,
    TorsionSpring,
    TurnCounter,
    Universal,
)
from dms_core.model.element import Constraint, DynamicElement

INERTIA = (0.02, 0.03, 0.025, 0.002, -0.003, 0.004)

BODIES = (
    RigidBody(name="upper", mass=1.8, inertia=INERTIA, centre_of_mass=(0.0, -0.2, 0.02)),
    RigidBody(
        name="lower",
        mass=1.5,
        inertia=INERTIA,
        centre_of_mass=(0.01, -0.18, 0.0),
        position=(0.0, -0.4, 0.0),
        orientation=(0.9, 0.2, -0.1, 0.3),
    ),
    RigidBody(name="plate", mass=0.4, inertia=(0.01, 0.01, 0.012), position=(0.1, -0.6, 0.1)),
    RigidBody(name="ball", mass=0.6, inertia=(0.004, 0.004, 0.005), position=(0.3, -0.7, 0.1)),
    PointMass(name="bob", mass=0.3, position=(0.4, -1.0, 0.2)),
    PointMass(name="bead", mass=0.2, position=(0.05, -0.7, 0.05)),
    RigidBody(name="wheel", mass=2.0, inertia=(0.02, 0.02, 0.04), position=(1.0, 0.0, 0.0)),
    RigidBody(name="weight", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.5, -1.0, 0.2)),
    RigidBody(name="lift", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(-1.0, 0.0, 0.2)),
    *(
        RigidBody(name=name, mass=1.0, inertia=(0.1, 0.12, 0.15), position=place)
        for name, place in (
            ("cog", (3.0, 0.0, 0.0)),
            ("pinion", (3.3, 0.0, 0.0)),
            ("pulley", (3.6, 0.0, 0.0)),
            ("rod_of_rack", (3.0, 0.5, 0.0)),
            ("nut", (4.0, 0.0, 0.0)),
            ("sleeve", (4.5, 0.0, 0.0)),
            ("puck", (5.0, 0.0, 0.0)),
            ("propeller", (4.0, 0.0, 0.5)),
        )
    ),
    PointMass(name="bucket", mass=0.5, position=(3.7, -1.0, 0.0)),
)


def _path(*points: tuple) -> tuple[PathPoint, ...]:
    return tuple(PathPoint(body=body, point=point) for body, point in points)


CONSTRAINTS: tuple[Constraint, ...] = (
    Revolute(name="shoulder", body_j="upper", axis_i=(0.1, -0.2, 1.0)),
    Revolute(name="elbow", body_i="upper", body_j="lower", point_i=(0.0, -0.4, 0.0), axis_i=(0.05, 0.04, 1.0)),
    Fixed(name="weld", body_i="lower", body_j="plate", point_i=(0.0, -0.2, 0.0)),
    Spherical(name="socket", body_i="plate", body_j="ball", point_i=(0.1, 0.0, 0.0)),
    PlaneGuide(name="plane", body_j="ball", normal_i=(0.2, 0.3, 1.0), point_i=(0.3, -0.75, 0.05)),
    Distance(name="rod", body_i="ball", body_j="bob", point_i=(0.02, -0.05, 0.0)),
    LineGuide(name="wire", body_i="lower", body_j="bead", axis_i=(0.1, 1.0, 0.2), point_i=(0.02, -0.2, 0.03)),
    Revolute(name="axle", body_j="wheel", point_i=(1.0, 0.0, 0.0), axis_i=(0.0, 0.3, 1.0)),
    AngleDriver(name="motor", joint="axle", input="turn"),
    Slider(name="rail", body_j="weight", axis_i=(0.0, 1.0, 0.1)),
    RopeLength(
        name="cord",
        path=_path(
            ("weight", (0.0, 0.1, 0.0)),
            ("ground", (1.4, 0.5, 0.2)),
            ("upper", (0.1, 0.1, 0.1)),
            ("lower", (0.1, -0.1, 0.0)),
        ),
    ),
    Slider(name="shaft", body_j="lift", axis_i=(0.0, 1.0, 0.0)),
    PositionDriver(name="winch", body_j="lift", axis_i=(0.1, 1.0, 0.0), input="height"),
    Revolute(name="cog_axle", body_j="cog", point_i=(3.0, 0.0, 0.0)),
    Revolute(name="pinion_axle", body_j="pinion", point_i=(3.3, 0.0, 0.0)),
    Revolute(name="pulley_axle", body_j="pulley", point_i=(3.6, 0.0, 0.0)),
    Gear(name="gear", joint_i="cog_axle", joint_j="pinion_axle", ratio=-2.0),
    Belt(name="belt", joint_i="pinion_axle", joint_j="pulley_axle", radius_i=0.1, radius_j=0.2),
    Slider(name="bed", body_j="rod_of_rack", axis_i=(1.0, 0.0, 0.0)),
    Rack(name="rack", pinion="cog_axle", rail="bed", radius=-0.1),
    Screw(name="spindle", body_j="nut", point_i=(4.0, 0.0, 0.0), lead=0.3),
    Universal(
        name="cross", body_i="nut", body_j="propeller", point_i=(0.0, 0.0, 0.2), axis_i=(1.0, 0.0, 0.0),
        axis_j=(0.0, 1.0, 0.1),
    ),
    Cylindrical(name="tube", body_j="sleeve", point_i=(4.5, 0.0, 0.0)),
    LinearCoupling(
        name="differential",
        coordinates=(
            JointTerm(joint="spindle", factor=0.5),
            JointTerm(joint="tube", factor=1.0),
            JointTerm(joint="tube", coordinate="slide", factor=3.0),
        ),
    ),
    Planar(name="table", body_j="puck", axis_i=(0.1, 1.0, 0.2)),
    DrumRope(
        name="line", joint="pulley_axle", radius=0.1, path=_path(("ground", (3.7, 0.0, 0.0)), ("bucket", (0.0,) * 3))
    ),
)  # fmt: skip

FORCES: tuple[DynamicElement, ...] = (
    Gravity(name="gravity"),
    LumpedLoad(
        name="push", body="lower", point=(0.1, 0.2, 0.3), force=(3.0, -4.0, 5.0), moment=(1.0, 2.0, -3.0), axes="body"
    ),
    LumpedLoad(name="blow", body="plate", point=(0.1, 0.0, 0.0), force=(3.0, -4.0, 5.0), input="factor"),
    SpringDamper(
        name="spring",
        body_i="upper",
        body_j="plate",
        point_i=(0.1, 0.0, 0.1),
        stiffness=90.0,
        damping=4.0,
        free_length=0.2,
    ),
    JointSpringDamper(name="stop", joint="elbow", stiffness=8.0, damping=0.7),
    JointStop(name="end", joint="elbow", lowest=1.0, highest=1.1, stiffness=5.0, dissipation=0.05),
    Bushing(
        name="cushion",
        body_j="puck",
        point_i=(5.1, 0.0, 0.1),
        stiffness=(50.0, 60.0, 70.0, 2.0, 3.0, 4.0),
        damping=(2.0, 1.0, 3.0, 0.2, 0.1, 0.3),
        orientation_j=(1.0, 0.1, -0.2, 0.1),
    ),
    TorsionSpring(name="coil", joint="cog_axle", stiffness=3.0, damping=0.2),
    JointMotor(name="servo", joint="tube", input="factor"),
    TurnCounter(name="turns", joint="tube"),
    FirstOrder(name="lag", time_constant=0.1, gain=2.0, input="factor", start=0.4),
    SecondOrder(name="oscillator", mass=2.0, damping=0.3, stiffness=40.0, input="factor", start=0.2, start_rate=0.5),
    RopeForce(
        name="pull",
        path=_path(("ground", (0.3, 0.4, 0.1)), ("upper", (0.2, -0.1, 0.0)), ("plate", (0.1, 0.0, 0.2))),
        input="factor",
    ),
    ReferenceFilter(name="filter", input="wish", frequency=7.0, damping=0.8),
    Pid(name="pid", joint="elbow", reference="psi", offset="filter.setpoint", kp=40.0, ki=15.0, kd=3.0, drift_gain=2.0),
    RopeActuator(name="drum", pid="pid", time_constant=0.03, width=30.0, pretension=5.0),
    RopeForce(
        name="cable", path=_path(("upper", (0.1, -0.1, 0.0)), ("lower", (0.12, -0.05, 0.1))), coordinate="drum.tension"
    ),
    ThelenMuscle(
        name="biceps",
        path=_path(("ground", (0.05, 0.1, 0.02)), ("upper", (0.04, -0.1, 0.0)), ("lower", (0.05, -0.1, 0.02))),
        excitation="command",
        max_isometric_force=600.0,
        optimal_fibre_length=0.25,
        tendon_slack_length=0.25,
        pennation_angle=0.2,
    ),
)

INPUTS = (
    Input(name="turn", signal=Harmonic(amplitude=0.5, frequency=1.3, phase=0.4)),
    Input(name="height", signal=MinimumJerk(times=(0.0, 1.0), values=(0.0, 0.2))),
    Input(name="factor", signal=Constant(value=12.0)),
    Input(name="wish", signal=Constant(value=0.3)),
    Input(name="psi", signal=Harmonic(amplitude=0.2, frequency=0.7)),
    Input(name="command", signal=Constant(value=0.6)),
)


def specimen(*sensors) -> Model:
    """The compiled mechanism."""
    return Model(
        System("specimen", bodies=BODIES, constraints=CONSTRAINTS, forces=FORCES, sensors=sensors, inputs=INPUTS)
    )


class Point(NamedTuple):
    """A state, shapes (n_q,) three times and (n_phi,)."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    lam: np.ndarray


def scales(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Nominal sizes of q and v."""
    pairs = np.array([(c.scale, c.rate_scale) for c in model.layout.coordinates])
    return pairs[:, 0], pairs[:, 1]


def random_point(model: Model, seed: int) -> Point:
    """About the start, off the constraints; the fibre shortens, and no kink of its curves is near these draws."""
    rng = np.random.default_rng([seed, 1])
    by_q, by_v = scales(model)
    n = model.n_q
    q = model.start.q + 0.02 * by_q * rng.uniform(-1.0, 1.0, n)
    v, a = (by_v * rng.uniform(-1.0, 1.0, n) for _ in range(2))
    v[model.layout.index["biceps.fibre_length"]] = -0.1 * by_v[model.layout.index["biceps.fibre_length"]]
    q[model.layout.index["biceps.activation"]] = 0.4
    return Point(q, v, a, 10.0 * rng.uniform(-1.0, 1.0, model.n_phi))


def constraint_rows(layout: Layout, name: str) -> slice:
    """Rows of phi that belong to the constraint of that name."""
    return next(slice(c.row, c.row + c.rows) for c in layout.constraints if c.element.name == name)

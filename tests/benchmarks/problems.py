"""The systems that are timed."""

from __future__ import annotations

import math

import numpy as np

from dms_core import Model, Simulation
from dms_core.model import (
    Beam,
    BeamSection,
    Constant,
    Gravity,
    Input,
    JointMotor,
    LineGuide,
    PointMass,
    Revolute,
    RigidBody,
    Spherical,
    System,
)
from dms_core.model.geometry.frames import quaternion
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.bare_arm import bare_arm
from exo_env.paper.scenarios import build, load_scenarios
from tests.benchmarks import flexible_reference as flexible
from tests.benchmarks.chain_reference import TIP

ARM_TASKS = {
    "co-contract": (1.0, {"TRI": 0.10, "BIC": 0.15, "BRA": 0.15}),
    "flex": (0.5, {"TRI": 0.02, "BIC": 0.08, "BRA": 0.08}),
}
"""Start angle [rad], excitations by the beginning of the muscle's name."""
START_ACTIVATION = 0.02
ANGLE = "elbow_angle.angle"


def chain(links: int) -> System:
    """The chain of chain_reference.py in redundant coordinates."""
    bodies = [
        RigidBody(name=f"link{i}", mass=1.0, inertia=(1e-3, 1 / 12, 1 / 12), position=(i + 0.5, 0.0, 0.0))
        for i in range(links)
    ]
    hinges = [
        Revolute(name=f"hinge{i}", body_i=f"link{i - 1}" if i else "ground", body_j=f"link{i}",
                 point_i=(0.5, 0.0, 0.0) if i else (0.0, 0.0, 0.0), point_j=(-0.5, 0.0, 0.0))
        for i in range(links)
    ]  # fmt: skip
    return System("chain", bodies=bodies, constraints=hinges, forces=[Gravity(name="g", acceleration=(0, -9.81, 0))])


def chain_error(simulation: Simulation, links: int) -> float:
    """Distance of the last link's free end from where it is at 1 s [m]."""
    q = simulation.state.q[7 * (links - 1) : 7 * links]
    angle = 2.0 * math.atan2(q[6], q[3])
    return float(np.hypot(*(q[:2] + 0.5 * np.array([math.cos(angle), math.sin(angle)]) - TIP[links])))


def chain_gap(simulation: Simulation) -> float:
    """Largest |phi| now [m or -]."""
    state = simulation.state
    return float(np.abs(simulation.model.constraint_jacobian(state.q, state.v, simulation.time)[0]).max())


def section(of: flexible.RoundSection) -> BeamSection:
    """A round section as ours."""
    return BeamSection(
        youngs_modulus=of.E, shear_modulus=of.G, area=of.area, inertia_y=of.inertia, inertia_z=of.inertia,
        torsion_constant=2.0 * of.inertia, shear_factor_y=of.shear_factor, shear_factor_z=of.shear_factor,
        density=of.density,
    )  # fmt: skip


def beam(elements: int) -> System:
    """The beam of flexible_reference.py."""
    boom = Beam(name="boom", section=section(flexible.RUBBER), length=flexible.BEAM_LENGTH, elements=elements)
    return System(
        "beam", compositions=[boom], constraints=[Revolute(name="hinge", body_j=boom.node(0))],
        forces=[Gravity(name="g", acceleration=(0, -flexible.GRAVITY, 0))],
    )  # fmt: skip


def slider_crank(elements: int) -> System:
    """The slider-crank of flexible_reference.py; the rod has an even number of elements."""
    pin, angle = flexible.rod_start()
    rod = Beam(
        name="rod", section=section(flexible.STEEL), length=flexible.ROD, elements=elements, position=(*pin, 0.0),
        orientation=tuple(quaternion((0.0, 0.0, 1.0), angle)),
    )  # fmt: skip
    J = flexible.CRANK_INERTIA
    crank = RigidBody(
        name="crank", mass=0.1, inertia=(J, J, J), orientation=tuple(quaternion((0.0, 0.0, 1.0), flexible.START))
    )
    far = pin[0] + flexible.ROD * math.cos(angle)
    slider = PointMass(name="slider", mass=flexible.SLIDER_MASS, position=(far, 0.0, 0.0))
    joints = [
        Revolute(name="bearing", body_j="crank"),
        Revolute(name="pin", body_i="crank", body_j=rod.node(0), point_i=(flexible.CRANK, 0.0, 0.0)),
        Spherical(name="wrist", body_i=rod.node(-1), body_j="slider"),
        LineGuide(name="guide", body_j="slider", axis_i=(1.0, 0.0, 0.0)),
    ]
    return System(
        "slider-crank", compositions=[rod], bodies=[crank, slider], constraints=joints,
        forces=[JointMotor(name="motor", joint="bearing", input="moment")],
        inputs=[Input(name="moment", signal=Constant(value=flexible.MOMENT))],
    )  # fmt: skip


def node_error(simulation: Simulation, node: str, where: tuple[float, float]) -> float:
    """Distance of a node from a place of the plane [m]."""
    o = simulation.model.layout.offset[node]
    return float(np.hypot(*(simulation.state.q[o : o + 2] - where)))


def arm(task: str) -> Model:
    """arm26 alone, elbow free, six muscles."""
    start, excitations = ARM_TASKS[task]
    return Model(bare_arm(start, {m: Constant(value=excitations[m[:3]]) for m in Arm().muscles}, START_ACTIVATION))


def whole_system() -> tuple[Model, float]:
    """Subject, exoskeleton and gym machine of scenario 3, and how long the exercise takes [s]."""
    exercise, scenarios = load_scenarios()
    return build(scenarios[2], exercise)[0], exercise.duration

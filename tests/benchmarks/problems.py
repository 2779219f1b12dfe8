"""The systems that are timed."""

from __future__ import annotations

import math

import numpy as np

from dms_core import Model, Simulation, System
from dms_core.model import Constant, Gravity, Revolute, RigidBody
from exo_env.ecosystem.arm import Arm
from exo_env.ecosystem.bare_arm import bare_arm
from exo_env.paper.scenarios import build, load_scenarios
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


def arm(task: str) -> Model:
    """arm26 alone, elbow free, six muscles."""
    start, excitations = ARM_TASKS[task]
    return Model(bare_arm(start, {m: Constant(value=excitations[m[:3]]) for m in Arm().muscles}, START_ACTIVATION))


def whole_system() -> tuple[Model, float]:
    """Subject, exoskeleton and gym machine of scenario 3, and how long the exercise takes [s]."""
    exercise, scenarios = load_scenarios()
    return build(scenarios[2], exercise)[0], exercise.duration

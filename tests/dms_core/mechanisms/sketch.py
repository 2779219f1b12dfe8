"""A mechanism as a sketch: joints in the ground frame between named links; bodies and start velocities follow."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dms_core import Model, System
from dms_core.linear.null_space import null_space
from dms_core.model import Gravity, Revolute, RigidBody, Slider, Spherical
from dms_core.model.element import GROUND

SPEED = 2.0
"""Root mean square of the start speeds of the centres of mass [m/s]: about that of a fall through 0.2 m."""


@dataclass
class Sketch:
    """Joints between links; all links have the axes of the ground at the start."""

    family: str
    joints: list[tuple[str, str, str, np.ndarray, np.ndarray]] = field(default_factory=list)
    """Kind, first and second link, point and axis in the ground frame."""

    def revolute(self, i: str, j: str, point, axis) -> None:  # noqa: ANN001
        """A hinge about an axis through a point."""
        self.joints.append(("revolute", i, j, np.array(point, float), np.array(axis, float)))

    def slider(self, i: str, j: str, point, axis) -> None:  # noqa: ANN001
        """A prismatic joint along an axis through a point."""
        self.joints.append(("slider", i, j, np.array(point, float), np.array(axis, float)))

    def spherical(self, i: str, j: str, point) -> None:  # noqa: ANN001
        """A ball joint at a point."""
        self.joints.append(("spherical", i, j, np.array(point, float), np.zeros(3)))

    @property
    def links(self) -> list[str]:
        """Names of the moving links."""
        return list(dict.fromkeys(name for joint in self.joints for name in joint[1:3] if name != GROUND))

    def turned(self, R: np.ndarray) -> Sketch:
        """The same mechanism turned by R, so that gravity acts in any direction."""
        return Sketch(self.family, [(k, i, j, R @ p, R @ a) for k, i, j, p, a in self.joints])

    def system(self, rng: np.random.Generator) -> System:
        """Links with random masses and inertias, gravity, at rest."""
        points = {name: np.array([p for _, i, j, p, _ in self.joints if name in (i, j)]) for name in self.links}
        centre = {GROUND: np.zeros(3), **{name: x.mean(axis=0) for name, x in points.items()}}
        bodies = []
        for name, x in points.items():
            size = max(0.2, float(np.linalg.norm(x - centre[name], axis=1).max()))
            mass = rng.uniform(0.5, 2.0)
            inertia = mass * (0.4 * size) ** 2 * rng.uniform(0.7, 1.3, 3)
            bodies.append(RigidBody(name=name, mass=mass, inertia=tuple(inertia), position=tuple(centre[name])))
        joints: list = []
        for k, (kind, i, j, p, a) in enumerate(self.joints):
            place = {"name": f"J{k}", "body_i": i, "body_j": j, "point_i": tuple(p - centre[i])}
            if kind == "spherical":
                joints.append(Spherical(**place))
            else:
                joints.append((Revolute if kind == "revolute" else Slider)(**place, axis_i=tuple(a)))
        gravity = Gravity(name="g", acceleration=(0.0, -9.81, 0.0))
        return System(self.family, bodies=bodies, constraints=joints, forces=[gravity])


def moving(model: Model, rng: np.random.Generator) -> np.ndarray:
    """Random start velocities that the joints of a model at rest allow, shape (n_q,)."""
    free = null_space(model.constraint_jacobian(model.start.q)[2])
    v = free @ rng.normal(size=free.shape[1])
    places = v.reshape(-1, 7)[:, :3]
    return v * SPEED / np.sqrt(np.mean(np.sum(places**2, axis=1)))


def started(model: Model, v: np.ndarray) -> System:
    """The system of a model with these start velocities, shape (n_q,)."""
    system, q = model.system, model.start.q
    bodies = []
    for k, body in enumerate(system.bodies):
        r, p, dp = q[7 * k : 7 * k + 3], q[7 * k + 3 : 7 * k + 7], v[7 * k + 3 : 7 * k + 7]
        # omega = 2 E(p) dp/dt in ground axes.
        omega = 2.0 * (p[0] * dp[1:] - dp[0] * p[1:] + np.cross(p[1:], dp[1:]))
        bodies.append(
            body.model_copy(
                update={
                    "position": tuple(r), "orientation": tuple(p), "velocity": tuple(v[7 * k : 7 * k + 3]),
                    "angular_velocity": tuple(omega),
                }
            )
        )  # fmt: skip
    return System(system.name, bodies=bodies, constraints=system.constraints, forces=system.forces)

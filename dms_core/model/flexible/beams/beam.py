"""A beam of n elements: its nodes, which are rigid bodies, and the elastic elements between them, declared as one."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.element import Composition, Parts, Quaternion, Vector
from dms_core.model.flexible.beams.beam_element import BeamElement
from dms_core.model.flexible.beams.section import BeamSection
from dms_core.model.geometry.frames import quaternion, quaternion_product, rotation_matrix

STRAIGHT = 1e-9
"""Turn of an arc [rad] below which its closed form is that of a straight line."""


def arc(curvature: np.ndarray, s: float) -> tuple[np.ndarray, np.ndarray]:
    """End of an arc of constant curvature [rad/m] and length s [m] that sets out along x: position, Euler parameters.

    r(s) = integral of exp(s kappa) e_1: along kappa it goes on straight, across it a circle.
    """
    k = float(np.linalg.norm(curvature))
    if k * s < STRAIGHT:
        return np.array([s, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])
    n, e = curvature / k, np.array([1.0, 0.0, 0.0])
    across = e - n * n[0]
    position = s * n[0] * n + np.sin(k * s) / k * across + (1.0 - np.cos(k * s)) / k * np.cross(n, e)
    return position, quaternion(n, k * s)


class Beam(Composition):
    """Elastic beam, straight or an arc, of a given section: large displacements and rotations, small strains.

    It has elements + 1 nodes, the rigid bodies `<name>.node0`, ..., whose x axes lie along it and to which joints,
    forces and sensors attach like to any body; the beam elements `<name>.element0`, ... are between them.
    """

    kind: ClassVar[str] = "beam"
    section: BeamSection = Field(description="cross-section and material")
    length: float = Field(gt=0.0, description="along the beam [m]")
    elements: int = Field(ge=1, le=10000, description="number of elements")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="first node at the start [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="Euler parameters of the first node at the start, its x axis along the beam [-]; normalised",
    )
    curvature: Vector = Field(
        default=(0.0, 0.0, 0.0), description="twist and two curvatures at rest, in section axes [rad/m]"
    )
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="of the first node at the start [m/s]")
    angular_velocity: Vector = Field(
        default=(0.0, 0.0, 0.0), description="of the beam, as one rigid body, at the start, ground axes [rad/s]"
    )
    damping_time: float = Field(
        default=0.0, ge=0.0, description="tau [s]: section loads are stiffness times (strain + tau strain rate)"
    )
    mass: Literal["lumped", "consistent"] = Field(
        default="consistent", description="at the nodes alone, or that of the cubic between them, which is more exact"
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if not np.linalg.norm(self.orientation) > 1e-6:
            raise ValueError(f"orientation = {self.orientation}: Expected Euler parameters of a length above 0")
        turn = float(np.linalg.norm(self.curvature)) * self.element_length
        if turn >= np.pi:
            raise ValueError(
                f"curvature = {self.curvature}: an element turns by {np.degrees(turn):.0f} degrees: Expected less than "
                "180, with more elements or less curvature"
            )
        return self

    def node(self, k: int) -> str:
        """Name of node k, from 0; negative numbers count from the end."""
        return f"{self.name}.node{k % (self.elements + 1)}"

    @property
    def element_length(self) -> float:
        """Length of one element [m]."""
        return self.length / self.elements

    def parts(self) -> Parts:
        """Nodes and elements, in order along the beam."""
        nodes = tuple(self._node(k) for k in range(self.elements + 1))
        return Parts(bodies=nodes, forces=tuple(self._element(k) for k in range(self.elements)))

    def _node(self, k: int) -> RigidBody:
        """Node k with the mass of half the elements beside it."""
        at, turn = arc(np.array(self.curvature), k * self.element_length)
        p = np.array(self.orientation) / np.linalg.norm(self.orientation)
        lever = rotation_matrix(p) @ at
        share = self.element_length * (0.5 if k in (0, self.elements) else 1.0)
        return RigidBody(
            name=self.node(k),
            mass=self.section.mass_per_length * share,
            inertia=tuple(share * x for x in self.section.inertia_per_length),
            position=tuple(np.array(self.position) + lever),
            orientation=tuple(quaternion_product(p, turn)),
            velocity=tuple(np.array(self.velocity) + np.cross(self.angular_velocity, lever)),
            angular_velocity=self.angular_velocity,
        )

    def _element(self, k: int) -> BeamElement:
        """Element k, at rest in the declared shape."""
        return BeamElement(
            name=f"{self.name}.element{k}", body_i=self.node(k), body_j=self.node(k + 1), section=self.section,
            length=self.element_length, damping_time=self.damping_time, mass=self.mass,
        )  # fmt: skip

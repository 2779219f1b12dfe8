"""Modal body: a flexible part of given modes on a floating frame, with frames at the nodes to which joints attach."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.errors import ModelError
from dms_core.model.element import Composition, Parts, Quaternion, Vector
from dms_core.model.flexible.modal.floating_frame import FloatingFrame, modes_of
from dms_core.model.flexible.modal.interface_frame import InterfaceFrame
from dms_core.model.flexible.modal.load_distribution import LoadDistribution
from dms_core.model.flexible.modal.modal_data import ModalData, nested
from dms_core.model.flexible.modal.modal_node import ModalNode
from dms_core.model.geometry.frames import euler_rates, rotation_matrix
from dms_core.validation import Checked


class Interface(Checked):
    """Node of a modal body to which joints, forces and sensors attach."""

    wrong = ModelError
    name: str = Field(min_length=1, description="its frame is the body '<name of the modal body>.<name>'")
    point: Vector = Field(description="node in the floating frame, undeformed [m]")
    translations: tuple[Vector, ...] = Field(description="displacement of the node in each mode [m]")
    rotations: tuple[Vector, ...] = Field(description="rotation of the node in each mode [rad]")


class ModalBody(Composition):
    """Flexible body of small deformation: floating frame with modes, exact in the rigid motion of the frame.

    Its parts are the body `<name>.frame` and, for each interface, the body `<name>.<interface>`, a frame without mass
    that moves with the node. A weight acts on it through `gravity` or `distributed_load`.

    Modes do not know that a load along the body stiffens or softens it: where it spins as fast as it vibrates, or bears
    a good part of its buckling load, a `beam` is right.
    """

    kind: ClassVar[str] = "modal_body"
    data: ModalData = Field(description="invariants of mass, stiffness and modes")
    interfaces: tuple[Interface, ...] = Field(default=(), description="nodes to which something attaches")
    distributions: tuple[LoadDistribution, ...] = Field(
        default=(), description="its length or its volume, for loads by these; its mass is in `data`"
    )
    damping_ratio: float = Field(default=0.0, ge=0.0, description="of each mode, for itself [-]")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="origin of the floating frame at the start [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="Euler parameters at the start, scalar first [-]; normalised"
    )
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="of the origin at the start, ground axes [m/s]")
    angular_velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="at the start, ground axes [rad/s]")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if not np.linalg.norm(self.orientation) > 1e-6:
            raise ValueError(f"orientation = {self.orientation}: Expected Euler parameters of a length above 0")
        for node in self.interfaces:
            for what in ("translations", "rotations"):
                if len(getattr(node, what)) != self.data.size:
                    raise ValueError(
                        f"interface '{node.name}': {what}: Expected {self.data.size} items, as many as modes, got "
                        f"{len(getattr(node, what))}"
                    )
        for one in self.distributions:
            if len(one.translation) != self.data.size:
                raise ValueError(
                    f"distributions: {one.measure}: translation: Expected {self.data.size} items, as many as modes, "
                    f"got {len(one.translation)}"
                )
        measures = [one.measure for one in self.distributions]
        if len(set(measures)) < len(measures):
            raise ValueError(f"distributions: Expected each measure once, got {', '.join(measures)}")
        return self

    @property
    def frame(self) -> str:
        """Name of the floating frame."""
        return f"{self.name}.frame"

    @property
    def modes(self) -> tuple[str, ...]:
        """Full names of the modal coordinates."""
        return modes_of(self.frame, self.data)

    def parts(self) -> Parts:
        """Floating frame, then each interface with the constraint that holds it."""
        p = np.array(self.orientation) / np.linalg.norm(self.orientation)
        frame = FloatingFrame(
            name=self.frame, data=self.data, damping_ratio=self.damping_ratio, position=self.position,
            orientation=tuple(p), velocity=self.velocity, angular_velocity=self.angular_velocity,
        )  # fmt: skip
        nodes = tuple(
            ModalNode(
                name=f"{self.name}.{i.name}_node", frame=self.frame, interface=f"{self.name}.{i.name}", point=i.point,
                translations=i.translations, rotations=i.rotations,
            )
            for i in self.interfaces
        )  # fmt: skip
        return Parts(bodies=(frame, *(self._interface(i, p) for i in self.interfaces)), constraints=nodes)

    def _interface(self, interface: Interface, p: np.ndarray) -> InterfaceFrame:
        """The frame at a node of the undeformed body."""
        lever = rotation_matrix(p) @ np.array(interface.point)
        return InterfaceFrame(
            name=f"{self.name}.{interface.name}",
            position=tuple(np.array(self.position) + lever),
            orientation=tuple(p),
            velocity=tuple(np.array(self.velocity) + np.cross(self.angular_velocity, lever)),
            euler_rates=tuple(euler_rates(p, self.angular_velocity)),
        )

    @classmethod
    def of(
        cls, name: str, nodes: np.ndarray, mass: np.ndarray, stiffness: np.ndarray, modes: np.ndarray,
        interfaces: Mapping[str, int] | None = None,
        loads: Mapping[Literal["length", "volume"], np.ndarray] | None = None, **settings: Any,
    ) -> ModalBody:  # fmt: skip
        """The modal body of a finite-element model.

        Args:
            name: of the body.
            nodes: positions in the floating frame [m], shape (k, 3).
            mass: M, shape (d, d), d = 6 k, or 3 k for nodes without rotations.
            stiffness: K, shape (d, d).
            modes: Phi, shape (d, n), orthogonal in both and free of rigid motions, as `craig_bampton` gives them.
            interfaces: number of the node for each name of an interface.
            loads: nodal loads of 1 per length or volume along x, y and z, shape (d, 3), for each of these measures
                that a `distributed_load` uses; their intensity need not be the same everywhere.
            settings: further keys of the class.

        Raises:
            ModelError: see ModalData.of and LoadDistribution.of; or an interface names no node, or one without
                rotations.
        """
        who, data = f"modal_body '{name}'", ModalData.of(nodes, mass, stiffness, modes)
        x, per = np.asarray(nodes, float), len(modes) // len(nodes)
        found = []
        for key, k in (interfaces or {}).items():
            if not 0 <= k < len(x):
                raise ModelError(f"{who}: interface '{key}': Expected a node from 0 to {len(x) - 1}, got {k}.")
            if per == 3:
                raise ModelError(
                    f"{who}: interface '{key}': Expected a node with rotations; a model of displacements alone needs a "
                    "node that averages those of a face."
                )
            shapes = np.asarray(modes, float)[per * k : per * (k + 1)].T
            found.append(
                Interface(
                    name=key, point=tuple(x[k]), translations=nested(shapes[:, :3], np.abs(shapes[:, :3]).max()),
                    rotations=nested(shapes[:, 3:], np.abs(shapes[:, 3:]).max()),
                )
            )  # fmt: skip
        spread = tuple(LoadDistribution.of(key, x, modes, B) for key, B in (loads or {}).items())
        return cls(name=name, data=data, interfaces=tuple(found), distributions=spread, **settings)

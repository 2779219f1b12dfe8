"""Examples of flexible bodies."""

from __future__ import annotations

import numpy as np

from dms_core.model.bodies import RigidBody
from dms_core.model.flexible import (
    Beam,
    BeamElement,
    BeamLoad,
    BeamSection,
    DistributedLoad,
    Interface,
    LoadDistribution,
    ModalBody,
    ModalData,
)
from dms_core.model.geometry.frames import quaternion
from dms_core.model.signals import Input
from dms_core.model.system import System
from tests.example_elements import Example
from tests.example_elements.pair import pair

SECTION = BeamSection(
    youngs_modulus=30.0, shear_modulus=13.0, area=0.7, inertia_y=0.3, inertia_z=0.2, torsion_constant=0.25,
    shear_factor_y=0.8, density=2.0,
)  # fmt: skip
"""Soft, so that no part of the force is lost beside the others."""


def _node(name: str, position, orientation) -> RigidBody:
    return RigidBody(name=name, mass=1.0, inertia=(0.2, 0.1, 0.1), position=position, orientation=tuple(orientation))


def _beam(sensor: bool = False, **settings) -> Example:
    nodes = [
        _node("one", (0.1, 0.2, -0.1), quaternion((0.3, 0.2, 0.5), 0.4)),
        _node("two", (0.72, 0.51, -0.18), quaternion((0.3, 0.1, 0.6), 0.6)),
    ]
    beam = BeamElement(name="beam", body_i="one", body_j="two", section=SECTION, **settings)
    gauge = BeamLoad(name="gauge", element="beam")
    return Example(System(bodies=nodes, forces=[beam], sensors=[gauge]), gauge if sensor else beam)


def beam() -> Example:
    """At rest where it starts, lumped mass."""
    return _beam()


def damped_beam() -> Example:
    """With every number of its own."""
    return _beam(
        length=0.7, rest_strain=(0.01, 0.02, -0.01), rest_curvature=(0.2, -0.3, 0.1), damping_time=0.4,
        mass="consistent",
    )  # fmt: skip


def gauge() -> Example:
    """Without damping."""
    return _beam(sensor=True)


def damped_gauge() -> Example:
    """With damping, whose rates the loads depend on."""
    return _beam(sensor=True, damping_time=0.4)


def load_on_beam() -> Example:
    """Fixed, growing along a beam, scaled by an input."""
    beam = Beam(name="boom", section=SECTION, length=1.0, elements=2)
    load = DistributedLoad(name="load", body="boom", per_length=(0.3, -2.0, 1.0), end_factor=3.0, input="pull")
    return Example(System(compositions=[beam], forces=[load], inputs=[Input(name="pull")]), load)


def load_on_line() -> Example:
    """Following, on a line of a rigid body, scaled by an input."""
    load = DistributedLoad(
        name="load", body="lower", per_length=(3.0, -2.0, 1.0), end_factor=0.5, start=(0.1, 0.0, 0.2),
        end=(0.1, 0.4, 0.3), axes="body", input="pull",
    )  # fmt: skip
    return Example(pair(forces=[load], inputs=["pull"]), load)


def _random(rng: np.random.Generator, *shape: int) -> tuple:
    """Random numbers as nested tuples."""
    x = rng.uniform(-1.0, 1.0, shape)
    return tuple(map(float, x)) if len(shape) == 1 else tuple(_random(rng, *shape[1:]) for _ in range(shape[0]))


def modal_data(n: int = 3) -> ModalData:
    """Invariants of no body in particular: every coefficient counts."""
    rng = np.random.default_rng(1)
    curvature = np.array(_random(rng, n, n, 6))
    symmetric = curvature + curvature.swapaxes(0, 1)
    return ModalData(
        mass=2.0, mass_moment=_random(rng, 3), inertia=_random(rng, 6), modal_mass=tuple(1.0 + 0.5 * np.arange(n)),
        modal_stiffness=tuple(3.0 + 2.0 * np.arange(n)), translation=_random(rng, n, 3), rotation=_random(rng, n, 3),
        inertia_rate=_random(rng, n, 6), rotation_rate=_random(rng, n, n, 3),
        inertia_curvature=tuple(tuple(map(tuple, row)) for row in symmetric),
    )  # fmt: skip


def modal_body() -> ModalBody:
    """A modal body with one interface."""
    rng, data = np.random.default_rng(2), modal_data()
    tip = Interface(name="tip", point=(0.4, 0.1, -0.2), translations=_random(rng, 3, 3), rotations=_random(rng, 3, 3))
    length = LoadDistribution(measure="length", total=1.3, moment=_random(rng, 3), translation=_random(rng, 3, 3))
    return ModalBody(name="link", data=data, interfaces=(tip,), distributions=(length,), damping_ratio=0.2)


def modal_system(**more) -> System:
    """That body alone."""
    return System(compositions=[modal_body()], **more)


def frame() -> Example:
    """Three modes, damped."""
    system = modal_system()
    return Example(system, system.element("link.frame"))


def interface() -> Example:
    """Without any rows."""
    system = modal_system()
    return Example(system, system.element("link.tip"))


def node() -> Example:
    """Three modes that displace and turn it."""
    system = modal_system()
    return Example(system, system.element("link.tip_node"))


def load_on_modes() -> Example:
    """Per mass, following, scaled by an input."""
    load = DistributedLoad(name="load", body="link", per_mass=(0.3, -2.0, 1.0), axes="body", input="pull")
    return Example(modal_system(forces=[load], inputs=[Input(name="pull")]), load)


def weight_on_modes() -> Example:
    """Per mass, fixed."""
    load = DistributedLoad(name="load", body="link", per_mass=(0.3, -2.0, 1.0))
    return Example(modal_system(forces=[load]), load)


def length_of_modes() -> Example:
    """Per length, following."""
    load = DistributedLoad(name="load", body="link", per_length=(0.3, -2.0, 1.0), axes="body")
    return Example(modal_system(forces=[load]), load)


EXAMPLES = {
    "floating_frame": (frame,),
    "interface_frame": (interface,),
    "modal_node": (node,),
    "beam_element": (beam, damped_beam),
    "beam_load": (gauge, damped_gauge),
    "distributed_load": (load_on_beam, load_on_line, load_on_modes, weight_on_modes, length_of_modes),
}

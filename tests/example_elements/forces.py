"""Examples of forces."""

from __future__ import annotations

from dms_core.model.element import Force
from dms_core.model.flexible import Beam, BeamSection
from dms_core.model.forces import (
    Bushing,
    BushingCurves,
    BushingLoad,
    FirstOrder,
    Gravity,
    JointMotor,
    JointSpringDamper,
    JointStop,
    LoadCurve,
    LumpedLoad,
    SecondOrder,
    SpringDamper,
    TorsionSpring,
    TurnCounter,
)
from dms_core.model.system import System
from tests.example_elements import Example
from tests.example_elements.constraints import HINGE
from tests.example_elements.flexible import modal_system
from tests.example_elements.pair import pair

LOAD = {"body": "lower", "point": (0.03, -0.1, 0.05), "force": (3.0, -20.0, 5.0), "moment": (0.4, -0.6, 2.0)}
ENDS = {"body_i": "upper", "body_j": "lower", "point_i": (0.03, -0.3, 0.05), "point_j": (0.2, 0.0, -0.1)}


def _force(element: Force, *inputs: str) -> Example:
    return Example(pair(constraints=[HINGE], forces=[element], inputs=inputs), element)


def gravity() -> Example:
    """All three bodies, gravity along no axis."""
    return _force(Gravity(name="weight_of_all", acceleration=(1.0, -9.0, 2.0)))


def weight_of_beam() -> Example:
    """Nodes about which the beam's mass has a moment."""
    section = BeamSection(
        youngs_modulus=1.0, shear_modulus=1.0, area=0.5, inertia_y=0.1, inertia_z=0.1, torsion_constant=0.1, density=3.0
    )
    beam = Beam(name="boom", section=section, length=1.0, elements=1)
    element = Gravity(name="weight", acceleration=(1.0, -9.0, 2.0))
    return Example(System(compositions=[beam], forces=[element]), element)


def weight_of_modes() -> Example:
    """A floating frame, whose modes move its mass."""
    element = Gravity(name="weight", acceleration=(1.0, -9.0, 2.0))
    return Example(modal_system(forces=[element]), element)


def load() -> Example:
    """Constant, ground axes."""
    return _force(LumpedLoad(name="load", **LOAD))


def following_load() -> Example:
    """Body axes, scaled by an input."""
    return _force(LumpedLoad(name="load", axes="body", input="pull", **LOAD), "pull")


def pure_moment() -> Example:
    """Body axes, no force: the tighter pattern."""
    return _force(LumpedLoad(name="load", body="lower", moment=(0.4, -0.6, 2.0), axes="body"))


def spring() -> Example:
    """Stiffness, damping and preload."""
    return _force(SpringDamper(name="spring", stiffness=200.0, damping=15.0, free_length=0.2, preload=12.0, **ENDS))


def undamped_spring() -> Example:
    """No damping: the tighter pattern."""
    return _force(SpringDamper(name="spring", stiffness=200.0, **ENDS))


def joint_spring() -> Example:
    """Stiffness and damping about the hinge."""
    return _force(JointSpringDamper(name="spring", joint="hinge", stiffness=8.0, damping=0.7, rest_angle=0.4))


def joint_spring_without_damping() -> Example:
    """No damping: the tighter pattern."""
    return _force(JointSpringDamper(name="spring", joint="hinge", stiffness=8.0))


def stop() -> Example:
    """Beyond the highest angle: the hinge of the pair starts at -2.02 rad."""
    return _force(JointStop(name="stop", joint="hinge", lowest=-3.7, highest=-3.5, stiffness=8.0, dissipation=0.05))


def lower_stop_without_dissipation() -> Example:
    """Below the lowest angle, the tighter pattern."""
    return _force(JointStop(name="stop", joint="hinge", lowest=-0.6, highest=-0.4, stiffness=8.0))


def lag() -> Example:
    """Driven by an input."""
    return _force(FirstOrder(name="lag", time_constant=0.04, gain=3.0, input="u", start=0.2), "u")


def free_lag() -> Example:
    """No input."""
    return _force(FirstOrder(name="lag", time_constant=0.04))


def oscillator() -> Example:
    """Driven by an input."""
    return _force(SecondOrder(name="mode", mass=2.0, damping=0.3, stiffness=50.0, gain=4.0, input="u"), "u")


def free_oscillator() -> Example:
    """No input."""
    return _force(SecondOrder(name="mode", stiffness=50.0))


CUSHION = {
    "body_i": "upper", "body_j": "lower", "point_i": (0.03, -0.3, 0.05), "orientation_i": (0.9, 0.3, -0.2, 0.1),
    "orientation_j": (0.8, -0.1, 0.5, 0.2),
}  # fmt: skip


def cushion() -> Example:
    """Six stiffnesses and dampings, frames along no axes."""
    return _force(
        Bushing(
            name="cushion",
            stiffness=(200.0, 300.0, 150.0, 4.0, 7.0, 5.0),
            damping=(3.0, 2.0, 4.0, 0.2, 0.1, 0.3),
            **CUSHION,
        )
    )


def cushion_with_curves() -> Example:
    """A force and a moment by table, no damping, undeformed at the start: the tighter pattern."""
    force = LoadCurve(deflections=(-1.5, -0.4, 0.0, 0.3, 1.6), loads=(-900.0, -40.0, 0.0, 30.0, 1200.0))
    moment = LoadCurve(deflections=(-0.5, 0.0, 1.5), loads=(-6.0, 0.0, 40.0))
    curves = BushingCurves(y=force, turn_z=moment)
    stiffness = (200.0, 0.0, 150.0, 4.0, 7.0, 0.0)
    return _force(Bushing(name="cushion", body_i="upper", body_j="lower", stiffness=stiffness, curves=curves))


def _gauged(example: Example) -> Example:
    """The sensor of an example's bushing."""
    gauge = BushingLoad(name="gauge", bushing="cushion")
    return Example(pair(forces=[example.element], sensors=[gauge]), gauge)


def gauge() -> Example:
    """Six stiffnesses and dampings."""
    return _gauged(cushion())


def gauge_with_curves() -> Example:
    """By table, without damping."""
    return _gauged(cushion_with_curves())


def wound_spring() -> Example:
    """A curve of several turns, with damping."""
    curve = LoadCurve(deflections=(-20.0, -2.0, 0.0, 5.0, 30.0), loads=(-60.0, -3.0, 0.0, 9.0, 80.0))
    return _force(TorsionSpring(name="spring", joint="hinge", curve=curve, damping=0.4, rest_angle=-9.0))


def straight_wound_spring() -> Example:
    """A stiffness, no damping: the tighter pattern."""
    return _force(TorsionSpring(name="spring", joint="hinge", stiffness=3.0, pointer_i=(1.0, 0.2, 0.0)))


def counter() -> Example:
    """Of the hinge."""
    return _force(TurnCounter(name="turns", joint="hinge"))


def motor() -> Example:
    """A moment on the hinge."""
    return _force(JointMotor(name="motor", joint="hinge", input="moment"), "moment")


EXAMPLES = {
    "bushing": (cushion, cushion_with_curves),
    "bushing_load": (gauge, gauge_with_curves),
    "joint_motor": (motor,),
    "torsion_spring": (wound_spring, straight_wound_spring),
    "turn_counter": (counter,),
    "gravity": (
        gravity,
        weight_of_beam,
        weight_of_modes,
    ),
    "lumped_load": (load, following_load, pure_moment),
    "spring_damper": (spring, undamped_spring),
    "joint_spring_damper": (joint_spring, joint_spring_without_damping),
    "joint_stop": (stop, lower_stop_without_dissipation),
    "first_order": (lag, free_lag),
    "second_order": (oscillator, free_oscillator),
}

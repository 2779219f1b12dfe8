"""Examples of controllers and actuators."""

from __future__ import annotations

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.control.actuator import RopeActuator
from dms_core.model.control.delayed_error import DelayedError
from dms_core.model.control.impedance import ImpedanceController
from dms_core.model.control.pid import Pid
from dms_core.model.control.reference_filter import ReferenceFilter
from dms_core.model.element import GROUND
from dms_core.model.geometry.frames import quaternion
from dms_core.model.geometry.path import PathPoint
from dms_core.model.ropes.rope_force import RopeForce
from dms_core.model.signals import Input
from dms_core.model.system import System
from tests.example_elements import Example

INPUTS = ("psi", "wish", "pull", "authority", "stiffness", "damping", "share")


def controlled(*forces, sensors=(), body_i: str = "upper") -> System:
    """A hinge with an axis that is none of the coordinate axes, far from angle pi, and controllers around it."""
    upper = RigidBody(
        name="upper", mass=1.0, inertia=(0.02, 0.03, 0.025), orientation=tuple(quaternion((1, 2, 3), 0.7))
    )
    lower = RigidBody(
        name="lower",
        mass=1.0,
        inertia=(0.02, 0.03, 0.025),
        centre_of_mass=(0.1, -0.2, 0.05),
        orientation=tuple(quaternion((1, 2, 2), 0.4)),
    )
    hinge = Revolute(name="hinge", body_i=body_i, body_j="lower", axis_i=(0.3, -0.2, 0.9))
    inputs = [Input(name=name) for name in INPUTS]
    return System(bodies=[upper, lower], constraints=[hinge], forces=forces, sensors=sensors, inputs=inputs)


def _filter() -> ReferenceFilter:
    return ReferenceFilter(name="filter", input="wish", frequency=7.0, damping=0.8)


def _pid(**changes) -> Pid:
    return Pid(**{"name": "pid", "joint": "hinge", "reference": "psi", "kp": 40.0, "ki": 15.0, "kd": 3.0, **changes})


def pid_plain() -> Example:
    """As in the paper: an input as reference, no feedback of the drift."""
    pid = _pid()
    return Example(controlled(pid), pid)


def pid_filtered() -> Example:
    """A filter instead of an input, feedback of the drift, the joint on the ground."""
    pid = _pid(reference=None, offset="filter.setpoint", drift_gain=2.5)
    return Example(controlled(_filter(), pid, body_i=GROUND), pid)


def pid_both() -> Example:
    """Input and filter together, own pointers."""
    pid = _pid(offset="filter.setpoint", drift_gain=2.5, pointer_i=(1.0, 0.0, 0.2), pointer_j=(1.0, 0.3, 0.1))
    return Example(controlled(_filter(), pid), pid)


def delayed_chain() -> Example:
    """Three lags behind an input."""
    element = DelayedError(name="reflex", joint="hinge", reference="psi", delay=0.06)
    return Example(controlled(element), element)


def delayed_once() -> Example:
    """One lag, own pointers, the joint on the ground."""
    pointers = {"pointer_i": (1.0, 0.0, 0.2), "pointer_j": (1.0, 0.3, 0.1)}
    element = DelayedError(name="reflex", joint="hinge", reference="psi", delay=0.06, lags=1, **pointers)
    return Example(controlled(element, body_i=GROUND), element)


def reference_filter() -> Example:
    """Off resonance and underdamped."""
    element = _filter()
    return Example(controlled(element), element)


def actuator_input() -> Example:
    """An input within the limits."""
    motor = RopeActuator(name="motor", command="pull", time_constant=0.03, pretension=4.0, max_tension=100.0)
    return Example(controlled(motor), motor, u={"pull": (5.0, 90.0)})


def _actuator_pid(error: tuple[float, float], **changes) -> Example:
    motor = RopeActuator(**{"name": "motor", "pid": "pid", "time_constant": 0.03, **changes})
    small = (-0.1, 0.1)
    return Example(
        controlled(_pid(), motor),
        motor,
        q={"pid.error_integral": small},
        v={"pid.error_integral": error},
        u={"authority": (0.3, 1.0)},
    )


def actuator_linear() -> Example:
    """Agonist far above the smoothing."""
    return _actuator_pid((1.0, 3.0), width=0.5, pretension=2.0)


def actuator_blend() -> Example:
    """Antagonist inside the smoothing, with a limit that is far away."""
    return _actuator_pid((-1.0, 1.0), sign=-1, width=200.0, max_tension=500.0, authority="authority")


def actuator_limit() -> Example:
    """Inside the smoothing of the limit."""
    return _actuator_pid((1.5, 3.0), width=80.0, max_tension=90.0)


def _rope(name: str, upper, lower, body_i: str = "upper") -> RopeForce:
    ends = (PathPoint(body=body_i, point=upper), PathPoint(body="lower", point=lower))
    return RopeForce(name=name, path=ends, tension=1.0)


UP, DOWN = ((0.4, 0.5, 0.1), (0.3, -0.2, 0.0)), ((0.5, -0.4, 0.0), (-0.1, 0.4, 0.1))
"""Ends of two ropes that turn the hinge both ways."""


def _impedance(body_i: str = "upper", **changes) -> Example:
    ropes = [_rope(name, *ends, body_i) for name, ends in (("up", UP), ("down", DOWN))]
    element = ImpedanceController(
        **{
            "name": "soft", "joint": "hinge", "ropes": ("up", "down"), "stiffness": "stiffness", "damping": "damping",
            "share": "share", "carried_cos": 0.7, "carried_sin": 2.5, "least_leverage": 1e-6, **changes,
        }
    )  # fmt: skip
    gains = {"stiffness": (5.0, 30.0), "damping": (0.5, 4.0), "share": (0.0, 2.0)}
    return Example(controlled(*ropes, element, body_i=body_i), element, u=gains)


def impedance_fixed() -> Example:
    """A zero that rests, two ropes."""
    return _impedance()


def impedance_following() -> Example:
    """A zero that follows, own pointers, the joint on the ground."""
    pointers = {"pointer_i": (1.0, 0.0, 0.2), "pointer_j": (1.0, 0.3, 0.1)}
    return _impedance(GROUND, ropes=("down",), relaxation_time=0.2, **pointers)


def impedance_without_leverage() -> Example:
    """Ropes that count with the least moment arm."""
    return _impedance(least_leverage=2.0)


def actuator_rate() -> Example:
    """The rate of an impedance controller's coordinate, inside the smoothing."""
    soft = _impedance()
    motor = RopeActuator(name="motor", rate_of="soft.up_impulse", time_constant=0.03, width=20.0, max_tension=100.0)
    system = controlled(*soft.system.forces, motor)
    return Example(system, motor, v={"soft.up_impulse": (-8.0, 8.0)})


EXAMPLES = {
    "delayed_error": (delayed_chain, delayed_once),
    "impedance_controller": (impedance_fixed, impedance_following, impedance_without_leverage),
    "pid": (pid_plain, pid_filtered, pid_both),
    "reference_filter": (reference_filter,),
    "rope_actuator": (actuator_input, actuator_linear, actuator_blend, actuator_limit, actuator_rate),
}

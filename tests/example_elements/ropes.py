"""Examples of ropes and of sensors on ropes."""

from __future__ import annotations

from dms_core.model.constraints.rope_length import RopeLength
from dms_core.model.control.actuator import RopeActuator
from dms_core.model.element import GROUND
from dms_core.model.geometry.path import PathPoint
from dms_core.model.ropes.elastic_rope import ElasticRope
from dms_core.model.ropes.rope_force import RopeForce
from dms_core.model.ropes.winch import Winch
from dms_core.model.sensors.rope import RopeSensor
from dms_core.model.sensors.winch import WinchSensor
from tests.example_elements import Example
from tests.example_elements.constraints import HINGE
from tests.example_elements.pair import pair

ALL = ("length", "rate", "tension")


def _path(*points) -> tuple[PathPoint, ...]:
    return tuple(PathPoint(body=body, point=point) for body, point in points)


WINDING = _path(
    (GROUND, (0.3, 1.2, 0.4)),
    (GROUND, (0.2, 0.9, -0.3)),
    ("upper", (0.1, 0.3, 0.2)),
    ("upper", (-0.1, 0.2, 0.4)),
    ("lower", (0.2, -0.3, 0.1)),
    ("upper", (0.3, -0.1, -0.2)),
    ("weight", (0.0, 0.2, 0.1)),
)
"""Ground, several points of one body, a body visited twice."""
SHORT = _path(("upper", (0.1, 0.3, 0.2)), ("lower", (0.2, -0.3, 0.1)))


def rope_constant() -> Example:
    """Constant tension along a winding path."""
    rope = RopeForce(name="rope", path=WINDING, tension=35.0)
    return Example(pair(forces=[rope]), rope)


def rope_input() -> Example:
    """Tension from an input."""
    rope = RopeForce(name="rope", path=SHORT, input="pull")
    return Example(pair(forces=[rope], inputs=["pull"]), rope, u={"pull": (5.0, 80.0)})


def rope_coordinate() -> Example:
    """Tension that is the state of an actuator."""
    motor = RopeActuator(name="motor", command="pull", time_constant=0.03)
    rope = RopeForce(name="rope", path=WINDING, coordinate="motor.tension")
    return Example(pair(forces=[motor, rope], inputs=["pull"]), rope, q={"motor.tension": (5.0, 80.0)})


def length_kept() -> Example:
    """The length of the start."""
    rope = RopeLength(name="rope", path=WINDING)
    return Example(pair(constraints=[rope]), rope)


def length_driven() -> Example:
    """A winch."""
    rope = RopeLength(name="rope", path=SHORT, input="winch")
    return Example(pair(constraints=[rope], inputs=["winch"]), rope)


def sensor_of_force() -> Example:
    """A rope pulled by an input."""
    rope = RopeForce(name="rope", path=WINDING, input="pull")
    sensor = RopeSensor(name="cell", rope="rope", components=ALL)
    return Example(pair(forces=[rope], sensors=[sensor], inputs=["pull"]), sensor, u={"pull": (5.0, 80.0)})


def sensor_of_coordinate() -> Example:
    """A rope pulled by an actuator; the tension alone."""
    motor = RopeActuator(name="motor", command="pull", time_constant=0.03)
    rope = RopeForce(name="rope", path=WINDING, coordinate="motor.tension")
    sensor = RopeSensor(name="cell", rope="rope", components=("tension",))
    return Example(pair(forces=[motor, rope], sensors=[sensor], inputs=["pull"]), sensor)


def sensor_of_constraint() -> Example:
    """The multiplier is the tension."""
    rope = RopeLength(name="rope", path=WINDING, input="winch")
    sensor = RopeSensor(name="cell", rope="rope", components=ALL)
    return Example(pair(constraints=[rope], sensors=[sensor], inputs=["winch"]), sensor)


def sensor_of_path() -> Example:
    """A measuring tape."""
    sensor = RopeSensor(name="tape", path=SHORT, components=("rate", "length"))
    return Example(pair(sensors=[sensor]), sensor)


def _elastic(**numbers) -> Example:
    rope = ElasticRope(name="rope", **{"path": WINDING, "axial_stiffness": 300.0, "free_length": 1.1, **numbers})
    return Example(pair(forces=[rope]), rope)


def elastic() -> Example:
    """Taut, without damping."""
    return _elastic()


def elastic_damped() -> Example:
    """Taut, with a damper that is nowhere limited."""
    return _elastic(damping=1.5)


def elastic_damped_hard() -> Example:
    """A damper that is limited: the tension is twice the elastic one, or 0."""
    return _elastic(damping=1e6)


def elastic_slack() -> Example:
    """Slack."""
    return _elastic(free_length=90.0)


def sensor_of_elastic() -> Example:
    """A rope that stretches."""
    rope = ElasticRope(name="rope", path=WINDING, axial_stiffness=300.0, free_length=1.1, damping=1.5)
    sensor = RopeSensor(name="cell", rope="rope", components=ALL)
    return Example(pair(forces=[rope], sensors=[sensor]), sensor)


def _winch(**numbers) -> Example:
    law = {"path": WINDING, "axial_stiffness": 300.0, "free_length": 1.1, "radius": 0.2, "winds": -1}
    drum = Winch(name="drum", joint="hinge", **{**law, **numbers})
    return Example(pair(constraints=[HINGE], forces=[drum]), drum, q={"drum.free_length": (0.7, 1.4)})


def winch_taut() -> Example:
    """Taut and damped; the joint's bodies are on the path."""
    return _winch(damping=1.5)


def winch_beside() -> Example:
    """The joint's first body is not on the path; no damping."""
    return _winch(path=_path((GROUND, (0.1, 3.0, 0.2)), ("weight", (0.2, -0.3, 0.1))), winds=1)


def winch_slack() -> Example:
    """Slack."""
    return _winch(free_length=90.0)._replace(q={"drum.free_length": (80.0, 90.0)})


def sensor_of_winch() -> Example:
    """All components."""
    of = winch_taut()
    sensor = WinchSensor(name="sense", winch="drum")
    system = pair(constraints=[HINGE], forces=[of.element], sensors=[sensor])
    return Example(system, sensor, q=of.q)


EXAMPLES = {
    "elastic_rope": (elastic, elastic_damped, elastic_damped_hard, elastic_slack),
    "rope_force": (rope_constant, rope_input, rope_coordinate),
    "rope_length": (length_kept, length_driven),
    "rope_sensor": (sensor_of_force, sensor_of_coordinate, sensor_of_constraint, sensor_of_path, sensor_of_elastic),
    "winch": (winch_taut, winch_beside, winch_slack),
    "winch_sensor": (sensor_of_winch,),
}

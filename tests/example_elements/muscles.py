"""Examples of muscles and of their sensor.

The curves have kinks, which no difference formula can cross: fibre length 1 (passive force sets in), fibre velocity 0,
tendon strain 0, excitation equal to activation. Each example stays on one side, and together they see every branch.
Bodies are strewn over metres, so tendons are either ordinary (then on their straight part), or as soft as a spring of
metres (then in the toe), or metres too long (then slack).
"""

from __future__ import annotations

from dms_core.model.element import GROUND
from dms_core.model.forces.first_order import FirstOrder
from dms_core.model.geometry.path import PathPoint
from dms_core.model.muscles.muscle import ThelenMuscle
from dms_core.model.muscles.thelen_curves import ThelenCurves
from dms_core.model.sensors.muscle import UNITS, MuscleSensor
from tests.example_elements import Example, Range
from tests.example_elements.pair import pair

L0 = 0.13
VMAX = 10.0 * L0
ARM26 = {"active_shape": 0.5, "passive_shape": 4.0, "velocity_shape": 0.3, "lengthening_force": 1.8}
PATH = tuple(
    PathPoint(body=body, point=point)
    for body, point in (
        (GROUND, (0.3, 1.2, 0.4)),
        ("upper", (0.1, 0.3, 0.2)),
        ("upper", (-0.1, 0.2, 0.4)),
        ("lower", (0.2, -0.3, 0.1)),
    )
)


def _muscle(*, slack: float = 0.143, tendon_strain: float = 0.033, pennation: float = 0.2, **more) -> ThelenMuscle:
    return ThelenMuscle(
        name="biceps",
        path=PATH,
        excitation="command",
        max_isometric_force=798.52,
        optimal_fibre_length=L0,
        tendon_slack_length=slack,
        pennation_angle=pennation,
        curves=ThelenCurves(**ARM26, tendon_strain=tendon_strain),
        **more,
    )


def _moving(
    muscle: ThelenMuscle, fibre: Range, velocity: Range, *, activation: Range = (0.1, 0.5), command: Range = (0.6, 0.9)
):
    """Ranges over optimal length and maximum velocity."""
    q = {"biceps.fibre_length": (fibre[0] * L0, fibre[1] * L0)}
    if muscle.activation_dynamics:
        q["biceps.activation"] = activation
    v = {"biceps.fibre_length": (velocity[0] * VMAX, velocity[1] * VMAX)}
    return {"q": q, "v": v, "u": {"command": command}}


def _example(muscle: ThelenMuscle, **ranges) -> Example:
    return Example(pair(forces=[muscle], inputs=["command"]), muscle, **ranges)


def shortening() -> Example:
    """Short fibre, rising activation."""
    muscle = _muscle()
    return _example(muscle, **_moving(muscle, (0.6, 0.95), (-0.2, -0.02)))


def lengthening() -> Example:
    """Long fibre in the toe of the tendon, falling activation."""
    muscle = _muscle(slack=0.5, tendon_strain=20.0)
    return _example(muscle, **_moving(muscle, (1.05, 1.5), (0.02, 0.15), activation=(0.5, 0.9), command=(0.1, 0.4)))


def fast_shortening() -> Example:
    """Beyond the velocity at which no active force is left; no pennation."""
    muscle = _muscle(pennation=0.0)
    return _example(muscle, **_moving(muscle, (0.6, 0.95), (-2.0, -1.1)))


def fast_lengthening() -> Example:
    """On the tangent that continues the force-velocity curve, tendon slack, excitation at its limit."""
    muscle = _muscle(slack=50.0)
    return _example(muscle, **_moving(muscle, (1.05, 1.5), (1.0, 2.0), command=(1.2, 2.0)))


def steep_pennation() -> Example:
    """At the limit of the pennation angle."""
    muscle = _muscle(pennation=1.2)
    return _example(muscle, **_moving(muscle, (0.5, 0.9), (-0.2, -0.02)))


def on_the_stop() -> Example:
    """A fibre within the stop, 0.01 to 0.02 L0, and beyond it: to the left of its kink; tendon slack."""
    muscle = _muscle(slack=50.0, pennation=0.0)
    return _example(muscle, **_moving(muscle, (0.0090, 0.0198), (-0.2, -0.02)))


def on_the_stop_by_pennation() -> Example:
    """As above where the steepest pennation asks for a longer fibre, at the height of the fibre and below."""
    muscle = _muscle(slack=50.0)
    least = muscle.smallest_fibre_length / L0
    return _example(muscle, **_moving(muscle, (0.99 * least, 0.9999 * least), (-0.2, -0.02)))


def activation_given() -> Example:
    """The input is the activation, without a coordinate of its own."""
    muscle = _muscle(activation_dynamics=False)
    return _example(muscle, **_moving(muscle, (1.05, 1.4), (-0.2, -0.02)))


def _reflex(level: Range) -> Example:
    """An excitation of 0.3 and a reflex of 0.8 times a coordinate."""
    muscle = _muscle(reflex="reflex.x", reflex_gain=0.8)
    system = pair(forces=[FirstOrder(name="reflex", time_constant=0.1), muscle], inputs=["command"])
    ranges = _moving(muscle, (0.6, 0.95), (-0.2, -0.02), activation=(0.1, 0.2), command=(0.3, 0.35))
    return Example(system, muscle, **{**ranges, "q": {**ranges["q"], "reflex.x": level}})


def reflex_rising() -> Example:
    """Excitation and reflex inside the limits."""
    return _reflex((0.1, 0.5))


def reflex_limited() -> Example:
    """The reflex silences the muscle."""
    return _reflex((-3.0, -1.0))


def sensor() -> Example:
    """All components, with activation dynamics."""
    muscle, sensor = _muscle(), MuscleSensor(name="probe", muscle="biceps", components=tuple(UNITS))
    system = pair(forces=[muscle], sensors=[sensor], inputs=["command"])
    return Example(system, sensor, **_moving(muscle, (1.05, 1.4), (-0.2, -0.02)))


def sensor_activation_given() -> Example:
    """The input is the activation; components in an order of their own; tendon in its toe."""
    muscle = _muscle(activation_dynamics=False, slack=0.5, tendon_strain=20.0)
    sensor = MuscleSensor(name="probe", muscle="biceps", components=("tendon_force", "active_force", "activation"))
    system = pair(forces=[muscle], sensors=[sensor], inputs=["command"])
    return Example(system, sensor, **_moving(muscle, (0.6, 0.95), (0.02, 0.15)))


def sensor_steep() -> Example:
    """Pennation at its limit, and one component alone."""
    muscle, sensor = _muscle(pennation=1.2), MuscleSensor(name="probe", muscle="biceps", components=("pennation",))
    system = pair(forces=[muscle], sensors=[sensor], inputs=["command"])
    return Example(system, sensor, **_moving(muscle, (0.5, 0.9), (-0.2, -0.02)))


EXAMPLES = {
    "thelen_muscle": (
        shortening,
        lengthening,
        fast_shortening,
        fast_lengthening,
        steep_pennation,
        on_the_stop,
        on_the_stop_by_pennation,
        activation_given,
        reflex_rising,
        reflex_limited,
    ),
    "muscle_sensor": (sensor, sensor_activation_given, sensor_steep),
}

"""Examples of electromechanical elements."""

from __future__ import annotations

from dms_core.model.electric import DcMotor
from tests.example_elements import Example
from tests.example_elements.constraints import HINGE
from tests.example_elements.pair import pair

ARMATURE = {"joint": "hinge", "voltage": "volts", "resistance": 1.3, "inductance": 0.4, "torque_constant": 0.6}


def _motor(**numbers) -> Example:
    motor = DcMotor(name="motor", **ARMATURE, **numbers)
    return Example(pair(constraints=[HINGE], forces=[motor], inputs=["volts"]), motor, q={"motor.current": (-3.0, 3.0)})


def motor() -> Example:
    """Without friction and rotor: the tighter pattern."""
    return _motor()


def geared_motor() -> Example:
    """Everything."""
    return _motor(
        gear_ratio=-7.0, rotor_inertia=0.03, viscous_friction=0.02, coulomb_friction=0.4, coulomb_speed=6.0,
        back_voltage=0.7, pointer_i=(1.0, 0.2, 0.1),
    )  # fmt: skip


EXAMPLES = {"dc_motor": (motor, geared_motor)}

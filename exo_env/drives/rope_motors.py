"""Motors of the ropes that follow commands of tension: what drives of commanded tensions share.

A command's rate is limited, and the motor follows it with a first-order lag inside the system of equations. The PID's
states are coordinates of the system as well, but no rope listens to them.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from dms_core.errors import InputError, choices
from dms_core.model import RopeActuator
from dms_core.model.element import Force
from exo_env.drives.drive import Command, Drive
from exo_env.ecosystem.ecosystem import ASSISTANCE, REFERENCE
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import WornExoskeleton, motor_name


def command_name(rope: str) -> str:
    """Name of the input that commands a rope's tension."""
    return f"{rope}_command"


class RopeMotors(Drive):
    """Base of the drives whose ropes have motors with a lag and a largest tension of the drive's own."""

    time_constant: float = Field(
        default=0.02, ge=0.001, le=0.5, description="lag of the tension [s]; assumed: 8 Hz, of a series elastic drive"
    )
    max_tension: tuple[float, ...] = Field(
        default=(200.0, 100.0), min_length=1,
        description="largest command of each rope, agonist and antagonist [N]; assumed: 200 N hold 2 kg in a limp arm, "
        "and gravity extends the elbow anyway",
    )  # fmt: skip

    @model_validator(mode="after")
    def _pulling(self):
        if not all(1.0 < x <= 1500.0 for x in self.max_tension):
            raise ValueError(f"max_tension = {list(self.max_tension)}: expected numbers above 1 and up to 1500 N")
        return self

    def largest(self, device: Exoskeleton) -> dict[str, float]:
        """Largest command of each rope [N].

        Raises:
            InputError: there are not as many as the device has ropes.
        """
        if len(self.max_tension) != len(device.ropes):
            raise InputError(
                f"drive_settings: max_tension has {len(self.max_tension)} numbers; expected one for each of the "
                f"device's {len(device.ropes)} ropes: {choices(device.ropes)}."
            )
        return dict(zip(device.ropes, self.max_tension, strict=True))


class CommandedTensions(RopeMotors):
    """Base of the drives whose commands are the tensions of the ropes."""

    rate_limit: float = Field(default=2000.0, gt=0.0, description="largest change of a command [N/s]; assumed")

    def commands(self, device: Exoskeleton) -> tuple[Command, ...]:
        """The tension of each rope [N]; the rope that lifts holds the arm at the start."""
        return tuple(
            Command(
                command_name(rope), self.rate_limit, holds=most if rope == device.lifting_rope else 0.0,
                motor=motor_name(rope),
            )
            for rope, most in self.largest(device).items()
        )  # fmt: skip

    def forces(self, worn: WornExoskeleton, start: np.ndarray) -> list[Force]:
        """The device with motors that follow the commands.

        Raises:
            InputError: there are not as many commands as the device has ropes.
        """
        if len(start) != len(worn.device.ropes):
            commands = ", ".join(c.name for c in self.commands(worn.device))
            raise InputError(
                f"{type(self).__name__}: {len(start)} commands ({commands}); expected one for each of the device's "
                f"{len(worn.device.ropes)} ropes: {choices(worn.device.ropes)}."
            )
        held = dict(zip(worn.device.ropes, start, strict=True))
        motors = {motor_name(rope): self._motor(rope, float(x), worn.device) for rope, x in held.items()}
        return [motors.get(f.name, f) for f in worn.forces(REFERENCE, ASSISTANCE)]

    def _motor(self, rope: str, start: float, device: Exoskeleton) -> RopeActuator:
        """A motor that follows the command of its rope."""
        return RopeActuator(
            name=motor_name(rope), command=command_name(rope), time_constant=self.time_constant,
            max_tension=self.largest(device)[rope], start_tension=start,
        )  # fmt: skip

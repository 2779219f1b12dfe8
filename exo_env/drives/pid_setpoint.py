"""The device's own PID holds psi + offset: a_0 shifts its setpoint, a_1 sets its share of authority.

The shift passes a second-order filter inside the system of equations, since psi must be C1 for the controller; the rate
of the authority is limited. Where the arm begins apart from psi, the setpoint begins where the arm is, and what parts
it from psi dies out within RETURN (drive.py).
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner
from dms_core.model import ReferenceFilter
from dms_core.model.element import Force
from exo_env.drives.drive import Command, Drive, affine, still_apart
from exo_env.ecosystem.ecosystem import ASSISTANCE, REFERENCE
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import WornExoskeleton
from exo_env.tables import DRIVE, WORLD

SETPOINT, FILTER = "setpoint", "setpoint_filter"


@compiled
def shifted_setpoint(w):
    """Setpoint change and authority of the action, the first beside what the arm's start is still apart from psi."""
    affine(w)
    floats(inner(w, WORLD.drive), DRIVE.wanted)[0] += still_apart(w)


class PidSetpoint(Drive):
    """Drive of action mode 'pid_setpoint'."""

    kernel: ClassVar[Any] = shifted_setpoint
    rtol: ClassVar[float] = 0.2
    """Keeps the elbow about as near to the exact solution as that of rope tensions: within 0.9e-3 rad in half of the
    patients, 1.2e-3 in nine of ten. The error that is left is in the motors' tensions, and the controller keeps it from
    the elbow."""
    setpoint_range: float = Field(default=0.2, gt=0.0, le=1.0, description="largest setpoint change [rad]; assumed")
    filter_frequency: float = Field(default=20.0, gt=0.0, le=200.0, description="of the setpoint filter [rad/s]")
    filter_damping: float = Field(default=1.0, gt=0.0, le=5.0, description="damping ratio of the filter [-]")
    authority_rate: float = Field(default=10.0, gt=0.0, description="largest change of the authority [1/s]; assumed")

    def actions(self, device: Exoskeleton) -> tuple[str, ...]:
        """Change of the setpoint, and authority."""
        return "setpoint change", "authority"

    def commands(self, device: Exoskeleton) -> tuple[Command, ...]:
        """Change of the setpoint and authority; an episode begins at the arm and with a half, as for zeros."""
        shift = Command(SETPOINT, math.inf, apart=1.0, motor=FILTER)
        return shift, Command(ASSISTANCE, self.authority_rate, start=0.5)

    def numbers(self, device: Exoskeleton) -> np.ndarray:
        """Offset and gain to setpoint change [rad] and authority [-], shape (2, 2)."""
        return np.array([[0.0, self.setpoint_range], [0.5, 0.5]])

    def forces(self, worn: WornExoskeleton, start: np.ndarray) -> list[Force]:
        """The filter and the device, whose controller reads it."""
        smooth = ReferenceFilter(
            name=FILTER, input=SETPOINT, frequency=self.filter_frequency, damping=self.filter_damping
        )
        return [smooth, *worn.forces(REFERENCE, ASSISTANCE, f"{FILTER}.setpoint")]

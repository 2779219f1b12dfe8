"""What an action in [-1, 1]^2 does: a drive is the part of the model behind the ropes, and how actions become inputs.

rope_tension: both tensions are commanded. a = -1 is a slack rope, a = 1 the largest tension; the command's rate is
limited, and the motor follows it with a first-order lag inside the DAE.

pid_setpoint: the device's own PID holds psi + offset; a_0 shifts its setpoint through a second-order filter inside the
DAE (psi must be C1 for the controller), a_1 sets its share of authority, whose rate is limited as well.

In both a command goes linearly from its last value to the new one over the control period, as far as its largest rate
takes it. The PID's states are coordinates of the DAE; with rope_tension no rope listens to them.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from dms_core.errors import InputError, choices
from dms_core.model import Constant, Input, ReferenceFilter, RopeActuator
from dms_core.model.element import Force
from exo_env.ecosystem.exoskeleton import AGONIST, ANTAGONIST, WornExoskeleton
from exo_env.settings import Settings

REFERENCE, ASSISTANCE = "psi", "assistance"
COMMANDS = (f"{AGONIST}_command", f"{ANTAGONIST}_command")
SETPOINT, FILTER = "setpoint", "setpoint_filter"


class _Drive(Settings):
    def start(self, holding_tension: float) -> np.ndarray:
        """Values of the inputs at the start, where `holding_tension` [N] of the agonist would hold the arm."""
        always, most = self.holding()
        return always + np.clip(holding_tension, 0.0, most)

    def holding(self) -> np.ndarray:
        """What each input is at the start, and how much of the holding tension it takes at most, shape (2, 2)."""
        raise NotImplementedError


class RopeTension(_Drive):
    """Drive of action mode 'rope_tension'."""

    names: ClassVar[tuple[str, str]] = ("agonist tension", "antagonist tension")
    rtol: ClassVar[float] = 0.01
    """Of the solver: over an episode the elbow stays within 0.4e-3 rad of the exact solution in half of the patients,
    within 1.3e-3 in nine of ten."""
    inputs: ClassVar[tuple[str, str]] = COMMANDS
    time_constant: float = Field(
        default=0.02, ge=0.001, le=0.5, description="lag of the tension [s]; assumed: 8 Hz, of a series elastic drive"
    )
    max_tension: tuple[float, float] = Field(
        default=(200.0, 100.0),
        description="largest command of agonist and antagonist [N]; assumed: 200 N hold 2 kg in a limp arm, and "
        "gravity extends the elbow anyway",
    )
    rate_limit: float = Field(default=2000.0, gt=0.0, description="largest change of a command [N/s]; assumed")

    @model_validator(mode="after")
    def _pulling(self):
        if not all(1.0 < x <= 1500.0 for x in self.max_tension):
            raise ValueError(f"max_tension = {list(self.max_tension)}: two numbers above 1 and up to 1500 N are wanted")
        return self

    def holding(self) -> np.ndarray:
        """The arm is held by the agonist."""
        return np.array([[0.0, 0.0], [self.max_tension[0], 0.0]])

    def table(self, period: float) -> np.ndarray:
        """Offset and gain from an action to a command [N], and its largest change in a period [N], shape (2, 3)."""
        return np.array([[0.5 * most, 0.5 * most, self.rate_limit * period] for most in self.max_tension])

    def forces(self, worn: WornExoskeleton, start: np.ndarray) -> list[Force]:
        """The device with motors that follow the commands."""
        sides = {f"{AGONIST}_motor": 0, f"{ANTAGONIST}_motor": 1}
        return [
            self._motor(f.name, sides[f.name], start) if f.name in sides else f
            for f in worn.forces(REFERENCE, ASSISTANCE)
        ]

    def _motor(self, name: str, side: int, start: np.ndarray) -> RopeActuator:
        """A motor that follows the command of its side."""
        return RopeActuator(
            name=name,
            command=COMMANDS[side],
            time_constant=self.time_constant,
            max_tension=self.max_tension[side],
            start_tension=float(start[side]),
        )


class PidSetpoint(_Drive):
    """Drive of action mode 'pid_setpoint'."""

    names: ClassVar[tuple[str, str]] = ("setpoint change", "authority")
    rtol: ClassVar[float] = 0.2
    """As above, 0.9e-3 and 1.2e-3; what is left over is in the motors' tensions, and the controller keeps it from the
    elbow."""
    inputs: ClassVar[tuple[str, str]] = (SETPOINT, ASSISTANCE)
    setpoint_range: float = Field(default=0.2, gt=0.0, le=1.0, description="largest setpoint change [rad]; assumed")
    filter_frequency: float = Field(default=20.0, gt=0.0, le=200.0, description="of the setpoint filter [rad/s]")
    filter_damping: float = Field(default=1.0, gt=0.0, le=5.0, description="damping ratio of the filter [-]")
    authority_rate: float = Field(default=10.0, gt=0.0, description="largest change of the authority [1/s]; assumed")

    def holding(self) -> np.ndarray:
        """No change, and half of the authority, as for an action of zeros."""
        return np.array([[0.0, 0.5], [0.0, 0.0]])

    def table(self, period: float) -> np.ndarray:
        """Offset and gain to setpoint change [rad] and authority [-], largest change in a period, shape (2, 3)."""
        return np.array([[0.0, self.setpoint_range, np.inf], [0.5, 0.5, self.authority_rate * period]])

    def forces(self, worn: WornExoskeleton, start: np.ndarray) -> list[Force]:
        """The filter and the device, whose controller reads it."""
        smooth = ReferenceFilter(
            name=FILTER, input=SETPOINT, frequency=self.filter_frequency, damping=self.filter_damping
        )
        return [smooth, *worn.forces(REFERENCE, ASSISTANCE, f"{FILTER}.setpoint")]


Drive = RopeTension | PidSetpoint
DRIVES: dict[str, type[Drive]] = {"rope_tension": RopeTension, "pid_setpoint": PidSetpoint}


def drive(mode: str, settings: dict | None) -> Drive:
    """The drive of an action mode, with some of its settings.

    Raises:
        InputError: the mode is unknown, or a setting is.
    """
    if mode not in DRIVES:
        raise InputError(f"action_mode = {mode!r}; one of {choices(DRIVES)} is wanted.")
    return DRIVES[mode](**(settings or {}))


def drive_inputs(used: Drive, start: np.ndarray) -> list[Input]:
    """The inputs of a drive, held at their start values."""
    return [
        Input(name=name, signal=Constant(value=float(x))) for name, x in zip(used.inputs, start, strict=True)
    ]  # fmt: skip


def checked_action(action: object) -> np.ndarray:
    """An action as two finite numbers, clipped to [-1, 1].

    Raises:
        InputError: it has another shape, or a number is not finite.
    """
    try:
        found = np.asarray(action, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"action = {action!r}; two numbers from -1 to 1 are wanted.") from None
    if found.shape != (2,):
        raise InputError(f"action has shape {found.shape}; two numbers from -1 to 1, shape (2,), are wanted.")
    if not np.isfinite(found).all():
        raise InputError(f"action = {found.tolist()}; finite numbers are wanted (they are clipped to -1 to 1).")
    return np.clip(found, -1.0, 1.0)

"""The contract of a drive: what an action in [-1, 1]^n does to the worn device.

A drive is the part of the model behind the ropes, and how actions become its inputs. It is a settings class that
declares its action's components, its commands (inputs of the model, each with a largest rate) and its forces, and a
compiled kernel that says what each command is to be at the end of the coming control period:

    kernel(w)      reads floats(drive, DRIVE.action), floats(drive, DRIVE.numbers) and, if it likes, the hinge's angle,
                   `measured_hinge(w)`, which every world has, or readings of the task, which another task may lack;
                   writes floats(drive, DRIVE.wanted); drive = inner(w, WORLD.drive)

A command goes linearly from its last value to the new one over the period, as far as its largest rate takes it, so that
rates hold at all times and nothing jumps inside the solver.

An episode may begin with the arm apart from the reference psi. A controller of psi would pull the arm there at once; a
command that shifts its setpoint therefore begins with what the arm is apart (`Command.apart`), and the kernel adds
what `still_apart(w)` leaves of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from dms_core.compiled.jit import compiled
from dms_core.errors import InputError
from dms_core.kernels import floats, inner, ints, matrix
from dms_core.model import Constant, Input
from dms_core.model.element import Force
from dms_core.validation import shown
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import WornExoskeleton
from exo_env.settings import Settings
from exo_env.tables import DRAW, DRIVE, DYNAMICS, GIVEN, PLAN, START, STATUS, WORLD

RETURN = 2.0
"""Time in which a setpoint goes from where the arm begins to psi [s]; assumed: that of a slow move of the exercise."""


@dataclass(frozen=True)
class Command:
    """An input of the model that a drive sets."""

    name: str
    """Name of the input."""
    rate: float
    """Largest change [unit of the command per s]; may be infinite."""
    start: float = 0.0
    """Value at the start of an episode."""
    holds: float = 0.0
    """Most that it takes, at the start, of what holds the arm: a tension of the lifting rope [N], or see `carries`."""
    carries: tuple[float, float] | None = None
    """m_c and m_s [Nm] of a command that is no tension, but gives m_c cos(theta) + m_s sin(theta) times its value."""
    apart: float = 0.0
    """What it has at the start beside that, for each radian by which the arm begins beyond psi."""
    motor: str | None = None
    """Motor or filter whose tension or setpoint is this command where the world rests."""


class Drive(Settings):
    """Base of all drives."""

    kernel: ClassVar[Any]
    rtol: ClassVar[float]
    """Relative tolerance of the solver that keeps the elbow within about 1e-3 rad over an episode."""

    def actions(self, device: Exoskeleton) -> tuple[str, ...]:
        """Name of each component of an action."""
        raise NotImplementedError

    def commands(self, device: Exoskeleton) -> tuple[Command, ...]:
        """Commands that the drive sets, in the order of the kernel's output."""
        raise NotImplementedError

    def numbers(self, device: Exoskeleton) -> np.ndarray:
        """Numbers that the kernel reads beside the action."""
        raise NotImplementedError

    def forces(self, worn: WornExoskeleton, start: np.ndarray) -> list[Force]:
        """Controller, motors and ropes of the worn device; `start` is each command's value at the start."""
        raise NotImplementedError

    def inputs(self, device: Exoskeleton, start: np.ndarray) -> list[Input]:
        """The inputs of the model, held at their start values."""
        names = [command.name for command in self.commands(device)]
        return [Input(name=n, signal=Constant(value=float(x))) for n, x in zip(names, start, strict=True)]

    def start_table(self, device: Exoskeleton) -> np.ndarray:
        """What each command has of START, shape (5, n)."""
        return np.array(
            [[c.start, c.holds, c.apart, *(c.carries or (0.0, 0.0))] for c in self.commands(device)]
        ).T.copy()

    def start(self, device: Exoskeleton, holding_tension: float) -> np.ndarray:
        """Each command at the start on psi, where a tension [N] of the lifting rope would hold the arm.

        What a command that is no tension takes of it depends on the angle (world/kernels/reset.py) and is left out.
        """
        tensions = np.array([c.carries is None for c in self.commands(device)])
        table = self.start_table(device)
        return table[START.always] + tensions * np.clip(holding_tension, 0.0, table[START.holds])


@compiled
def affine(w):
    """wanted_i = offset_i + gain_i action_i, with the numbers (offset_0, gain_0, offset_1, ...)."""
    drive = inner(w, WORLD.drive)
    action, wanted, x = floats(drive, DRIVE.action), floats(drive, DRIVE.wanted), matrix(drive, DRIVE.numbers)
    for i in range(wanted.shape[0]):
        wanted[i] = x[i, 0] + x[i, 1] * action[i]


@compiled
def measured_hinge(w):
    """Angle of the device's hinge at the present control time [rad]."""
    return floats(inner(w, WORLD.dynamics), DYNAMICS.y)[ints(inner(w, WORLD.drive), DRIVE.hinge)[0]]


@compiled
def start_apart(w):
    """Angle by which the arm begins beyond psi [rad]."""
    return floats(inner(w, WORLD.draw), DRAW.given)[GIVEN.start] - matrix(inner(w, WORLD.plan), PLAN.course)[0, 0]


@compiled
def still_apart(w):
    """What is left of `start_apart` at the end of the coming period [rad]: a minimum-jerk curve, 0 from RETURN on."""
    s = min((ints(w, WORLD.status)[STATUS.step] + 1) * floats(w, WORLD.period)[0] / RETURN, 1.0)
    return start_apart(w) * (1.0 - s * s * s * (10.0 + s * (6.0 * s - 15.0)))


def as_numbers(values: object) -> np.ndarray:
    """Real numbers as floats, in the order of C.

    Raises:
        TypeError, ValueError: they are something else, or no table of equally long rows.
        OverflowError: one is too large for a float.
    """
    found = np.asarray(values)
    hidden = np.ma.getmaskarray(values).any() if isinstance(values, np.ma.MaskedArray) else False
    # numpy would read numbers out of texts and dates, and drop what is imaginary or masked.
    if hidden or found.dtype.kind not in "biufO" or found.dtype == object and not all(map(_real, found.flat)):
        raise TypeError("no real numbers")
    return np.asarray(found, dtype=float, order="C")


def _real(value: object) -> bool:
    return isinstance(value, int | float | np.integer | np.floating)


def checked_action(action: object, size: int) -> np.ndarray:
    """An action as finite numbers, clipped to [-1, 1], shape (size,).

    Raises:
        InputError: it is something else, has another shape, or a number is not finite.
    """
    try:
        found = as_numbers(action)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        raise InputError(f"action = {shown(action)}: {_right(size)}.") from None
    if found.shape != (size,):
        raise InputError(f"action has shape {found.shape}: {_right(size)}.")
    # A few numbers are looked at sooner one by one than by numpy, whose three calls would take a twentieth of a step.
    numbers = found.tolist()
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"action = {shown(found)}: expected finite numbers (they are clipped to -1 to 1).")
    return np.array([min(max(x, -1.0), 1.0) for x in numbers])


def _right(size: int) -> str:
    """What an action should be, in words."""
    return f"expected {size} numbers from -1 to 1, shape ({size},)"

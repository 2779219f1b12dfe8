"""The check of what a drive declares for a device: names, shapes, rates and numbers, before a kernel reads them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np

from dms_core.errors import InputError, choices
from dms_core.validation import plain
from exo_env.drives.drive import Command, Drive, affine
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.kernel_checks import check_kernel, uses


def check_drive(drive: Drive, device: Exoskeleton) -> None:
    """Check what a drive declares for a device.

    Raises:
        InputError: names the drive, the culprit and what would be right.
    """
    who, kernel = type(drive).__name__, check_kernel(drive, "kernel")
    actions, commands = drive.actions(device), drive.commands(device)
    _check_names(who, "action", actions)
    _check_names(who, "command", [c.name for c in commands])
    for command in commands:
        _check_command(f"{who}: command '{command.name}'", command)
    numbers = drive.numbers(device)
    if not isinstance(numbers, np.ndarray) or numbers.dtype.kind not in "fiu" or not np.isfinite(numbers).all():
        raise InputError(f"{who}: numbers = {plain(numbers)!r}; expected an array of finite numbers.")
    if uses(kernel, affine):
        _check_affine(who, numbers, len(actions), commands, exact=kernel is affine)


def _check_names(who: str, kind: str, names: Iterable[Any]) -> None:
    listed = list(names)
    if not listed or len(set(listed)) < len(listed) or not all(isinstance(x, str) and x for x in listed):
        raise InputError(f"{who}: {kind}s = {listed!r}; expected different names, at least one.")


def _check_command(who: str, command: Command) -> None:
    # NaN compares with nothing, so each of these refuses it.
    if not command.rate > 0.0:
        raise InputError(f"{who}: rate = {command.rate}; expected a number above 0, math.inf for no limit.")
    if not math.isfinite(command.start):
        raise InputError(f"{who}: start = {command.start}; expected a finite number.")
    if not math.isfinite(command.apart):
        raise InputError(f"{who}: apart = {command.apart}; expected a finite number.")
    if not all(map(math.isfinite, command.carries or ())):
        raise InputError(f"{who}: carries = {command.carries}; expected two finite moments [Nm], or None.")
    if not command.holds >= 0.0:
        raise InputError(f"{who}: holds = {command.holds}; expected a tension from 0 N.")


def _check_affine(who: str, numbers: np.ndarray, actions: int, commands: Sequence[Command], *, exact: bool) -> None:
    """Check what the kernel `affine` reads; a kernel that calls it may read more, where not `exact`."""
    n, shape = len(commands), numbers.shape
    if shape != (n, 2) and (exact or len(shape) != 2 or shape[0] < n or shape[1] < 2):
        raise InputError(
            f"{who}: numbers have shape {numbers.shape}; the kernel `affine` expects ({n}, 2), offset and gain of each "
            f"of the commands {', '.join(c.name for c in commands)}."
        )
    if actions < n:
        raise InputError(
            f"{who}: {actions} actions for {n} commands; the kernel `affine` expects at least one for each command."
        )


def check_motors(drive: Drive, device: Exoskeleton, motors: Collection[str], coordinates: Collection[str]) -> None:
    """Check the motors that commands name.

    Args:
        drive: the drive.
        device: its device.
        motors: names of the motors, for the message.
        coordinates: names of all elements that have coordinates.

    Raises:
        InputError: a command names an element that is not there.
    """
    for c in drive.commands(device):
        if c.motor is not None and c.motor not in coordinates:
            who = f"{type(drive).__name__}: command '{c.name}'"
            raise InputError(f"{who}: motor '{c.motor}' is unknown; there are {choices(motors)}.")

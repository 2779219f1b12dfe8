"""The settings of an environment, and what is made of them."""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from dms_core.errors import InputError, choices
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import DEFAULT as DEFAULT_DEVICE
from exo_env.ecosystem.exoskeleton import Exoskeleton, shipped_devices
from exo_env.ecosystem.subject import DEFAULT
from exo_env.ecosystem.worn_exoskeleton import Misalignment
from exo_env.patient.distributions import Distribution, distribution
from exo_env.settings import Settings

LEAST_LOAD, MOST_LOAD = 0.05, 50.0
"""Weights that the machine takes [kg]."""
SOLVER_OPTIONS: dict[str, Any] = {"method": "sdirk2", "newton_tol": 0.2, "h_min": 1e-9, "max_steps": 500_000}
"""A run that needs smaller steps [s], or more of them in an episode, has failed. Newton's method may leave a fifth of
the largest error of a step; with a twentieth, the default elsewhere, the elbow of 12 patients came no nearer to runs at
rtol 1e-6, in a third to a half more iterations."""
DEFAULT_LOAD = {"uniform": [0.5, 2.0]}
"""Weight on the machine [kg]; assumed."""
SLOWEST, FASTEST = 5.0, 1000.0
"""Control rates [Hz]."""
SHORTEST, LONGEST = 0.1, 120.0
"""Durations of an episode that a user may give [s]."""
MOST_PERIODS = 120_000
"""Largest number of control periods in an episode, of which each takes some 200 bytes."""
SAME = 1e-6
"""Part of a number of periods up to which it counts as whole: rounding of what was given in single precision."""
MOST_CYCLE = 100_000
"""Largest number of different episodes that an environment remembers."""


class EnvSettings(Settings):
    """The arguments that every environment takes; all are JSON."""

    patient: Any = Field(default="mixed", description="population by name or YAML file; fields of one, or of a patient")
    load: Any = Field(default=None, description="weight [kg], or a distribution")
    exoskeleton: Any = Field(default=None, description="device by name or YAML file, or changes of the default one")
    misalignment: Any = Field(default=None, description="how the device is worn: shift [m] and tilt_deg of the hinge")
    cuff: Any = Field(default=None, description="'compliant', or its stiffness and damping; None: a rigid guide")
    subject: str = Field(default=DEFAULT, description="anatomy by name or YAML file")
    reference: Any = Field(default=None, description="changes of the movement's distributions")
    action_mode: str = Field(default="rope_tension", description="drive, by name")
    drive_settings: Any = Field(default=None, description="changes of the drive's settings")
    observation: Any = Field(default=("device",), description="groups or channels, in order")
    noise: Any = Field(default=True, description="False, or a channel's deviation, delay and quantum")
    reward_weights: Any = Field(default=None, description="changes of the terms' weights")
    limits: Any = Field(default=None, description="changes of what ends an episode")
    control_rate: Any = Field(default=50.0, description="[Hz]")
    episode_duration: Any = Field(default=None, description="[s]")
    cycle: Any = Field(default=None, description="number of different episodes, after which the first comes again")
    rtol: Any = Field(default=None, description="relative tolerance of the solver; None: that of the drive")
    render_mode: Literal["human", "rgb_array"] | None = None


def owned(value: Any) -> Any:
    """A copy of what a user gives, with dicts, lists and Python's numbers in place of others' mappings and numbers.

    What the user does to it afterwards reaches nobody else.
    """
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: owned(x) for name, x in value.items()}
    if type(value) is tuple:
        return tuple(owned(x) for x in value)
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [owned(x) for x in value]
    return copy.deepcopy(value)


def within(value: Any, low: float, high: float) -> bool:
    """Whether a value is a number between two limits."""
    return (
        isinstance(value, int | float | np.number)
        and not isinstance(value, bool | np.bool_)
        and bool(low <= value <= high)
    )


def check_number(name: str, value: Any, low: float, high: float, unit: str = "") -> None:
    """Refuse a value that is no number between two limits.

    Raises:
        InputError: names the argument and its value.
    """
    if not within(value, low, high):
        raise InputError(f"{name} = {value!r}: expected a number from {low:g} to {high:g}{unit and ' ' + unit}.")


def check_whole(name: str, value: Any, most: int) -> None:
    """Refuse a value that is no whole number from 1 to `most`.

    Raises:
        InputError: names the argument and its value.
    """
    if type(value) is not int or not 1 <= value <= most:
        raise InputError(f"{name} = {value!r}: expected a whole number from 1 to {most}.")


def checked_settings(kind: type[EnvSettings], settings: Mapping[str, Any]) -> EnvSettings:
    """Settings of an environment.

    Args:
        kind: class of the settings.
        settings: what the user gives, by name.

    Raises:
        InputError: a setting is unknown or not usable.
    """
    for name in settings:
        if name not in kind.model_fields:
            raise InputError(f"setting '{name}' is unknown; there are {choices(kind.model_fields)}.")
    s = kind(**settings)
    check_number("control_rate", s.control_rate, SLOWEST, FASTEST, "Hz")
    if s.episode_duration is not None:
        check_number("episode_duration", s.episode_duration, SHORTEST, LONGEST, "s")
    if s.rtol is not None:
        check_number("rtol", s.rtol, 1e-8, 0.2)
    if s.cycle is not None:
        check_whole("cycle", s.cycle, MOST_CYCLE)
    return s


def whole_periods(duration: float, rate: float) -> tuple[int, float]:
    """Number of control periods in an episode, and its true length [s].

    A length that is no whole number of periods becomes the nearest one that is, with a warning that says so.

    Raises:
        InputError: the episode is shorter than one period, or longer than MOST_PERIODS of them.
    """
    what = f"an episode of {duration:g} s at control_rate = {rate:g} Hz"
    if not duration * rate <= MOST_PERIODS * (1.0 + SAME):
        raise InputError(f"{what}: expected at most {MOST_PERIODS:,} control periods, {MOST_PERIODS / rate:g} s.")
    if not duration * rate >= 1.0 - SAME:
        # Rounded up, so that what is named is allowed.
        raise InputError(
            f"{what} is less than one control period: expected an episode_duration of at least "
            f"{max(math.ceil(1e6 / rate) / 1e6, SHORTEST):g} s, or a control_rate of at least {1.0 / duration:g} Hz."
            if duration > 0.0
            else f"{what}: expected a duration above 0."
        )
    steps = max(round(duration * rate), 1)
    if abs(duration * rate - steps) <= SAME * steps:
        return steps, duration
    warnings.warn(
        f"{what} would be {duration * rate:.6g} control periods: it takes {steps}, which are {steps / rate:.6g} s.",
        stacklevel=3,
    )
    return steps, steps / rate


def load_distribution(load: float | Mapping[str, Any] | None) -> Distribution:
    """Distribution of the weight on the machine [kg].

    Raises:
        InputError: `load` is no number and no distribution of numbers that the machine takes.
    """
    spec = DEFAULT_LOAD if load is None else load
    right = f"expected a number from {LEAST_LOAD} to {MOST_LOAD} kg, or a distribution of such numbers"
    try:
        if isinstance(spec, float) and not math.isfinite(spec):
            raise InputError(f"{right}.")
        weights = distribution(spec)
        if any(not within(x, LEAST_LOAD, MOST_LOAD) for x in weights.limits()):
            raise InputError(f"{right}.")
    except InputError as error:
        raise InputError(f"load = {load!r}: {error}") from None
    return weights


def worn_device(source: Any) -> Exoskeleton:
    """A device: a shipped one by name, a YAML file, or the default with some values changed, deep inside too.

    Raises:
        InputError: it is none of these, or a value is wrong.
    """
    if isinstance(source, str):
        return Exoskeleton.named(source)
    if source is None or isinstance(source, Mapping):
        try:
            return Exoskeleton.named(DEFAULT_DEVICE).changed(**(source or {}))
        except InputError as error:
            raise InputError(f"exoskeleton: {error}") from None
    raise InputError(
        f"exoskeleton = {source!r}: expected one of {choices(shipped_devices())}, a YAML file, or a mapping of changes "
        "of the default device."
    )


def worn_misalignment(source: Any) -> Misalignment:
    """How the device is worn.

    Raises:
        InputError: it is no mapping with some of `shift` and `tilt_deg`.
    """
    if not (source is None or isinstance(source, Mapping)):
        raise InputError(f"misalignment = {source!r}: expected a mapping with some of shift, tilt_deg, or None.")
    return Misalignment(**(source or {}))


def worn_cuff(source: Any) -> Cuff | None:
    """The compliant cuff, None for the rigid guide.

    Raises:
        InputError: it is neither None, 'compliant' nor a mapping with some of `stiffness` and `damping`.
    """
    if source is None:
        return None
    if not (source == "compliant" or isinstance(source, Mapping)):
        raise InputError(
            f"cuff = {source!r}: expected None, 'compliant', or a mapping with some of stiffness, damping."
        )
    return Cuff(**(source if isinstance(source, Mapping) else {}))

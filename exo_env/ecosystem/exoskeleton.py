"""The exoskeleton (paper sect. 4.1): upper link fixed to the humerus, lower link on a hinge at the elbow, two ropes.

The lower link leads the forearm through a guide. Its default is one row: a point of the forearm's long axis stays in
the plane of the lower link that holds the hinge axis. The guide then carries one force, the loop humerus - forearm -
lower link - upper link keeps full rank, and a device worn a few millimetres and degrees off still moves, since the
point slides in the plane. With a line or a slider instead, rows are redundant and only an aligned device moves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.errors import InputError, choices
from dms_core.files.config_files import configs
from dms_core.model.element import Vector
from dms_core.model.geometry.rotations import dot, sub
from dms_core.validation import shown
from exo_env.settings import Settings

DEFAULT = "elbow"
"""Name of the shipped device that is worn unless another is named."""
TWO_ROPES = {"agonist": "flexion", "antagonist": "extension"}
"""Ropes of a device file of version 0.1, and which way each turns the elbow."""
LEAST_ANGLE, MOST_ANGLE, ANGLE_STEP = 20, 100, 5
"""Hinge angles of the exercise at which the leverage of a rope is checked [deg]."""
MOST_ROPES = 100
"""Most ropes of a device."""
LEAST_LEVERAGE = 0.001
"""Least moment arm of a rope [m]; a controller divides by it, and a device of an arm's size has centimetres."""


Metres = Annotated[float, Field(ge=-1.0, le=1.0)]
"""A coordinate of a point of a device [m]; beyond a metre it is in another unit."""
Point = tuple[Metres, Metres, Metres]


class Link(Settings):
    """Inertia of a link in its own frame."""

    mass: float = Field(gt=0.0, le=20.0, description="mass [kg]")
    centre_of_mass: Point = Field(description="[m]")
    inertia: Vector = Field(description="principal moments about the centre of mass [kg m^2]")

    def numbers(self) -> np.ndarray:
        """Mass [kg] and centre of mass [m], shape (4,)."""
        return np.array([self.mass, *self.centre_of_mass])


class Rope(Settings):
    """Both ends of a rope, and which way it turns the elbow."""

    upper: Point = Field(description="on the upper link [m]")
    lower: Point = Field(description="on the lower link [m]")
    pulls: Literal["flexion", "extension"] = Field(description="direction in which its tension turns the elbow")

    @property
    def sign(self) -> Literal[1, -1]:
        """+1 for a rope that flexes, -1 for one that extends."""
        return 1 if self.pulls == "flexion" else -1


class Actuator(Settings):
    """Motor of a rope."""

    time_constant: float = Field(gt=0.0, le=0.5, description="first-order lag of the tension [s]")
    max_tension: float = Field(gt=0.0, description="largest tension [N]")
    pretension: float = Field(ge=0.0, description="tension without a command [N]")
    width: float = Field(gt=0.0, description="width of the smoothed positive part [N]")


class PidGains(Settings):
    """Gains of both rope controllers, on the error in rad."""

    kp: float = Field(ge=0.0, description="[N/rad]")
    ki: float = Field(ge=0.0, description="[N/(rad s)]")
    kd: float = Field(ge=0.0, description="[N s/rad]")


class CriticalOscillation(Settings):
    """The oscillation that the gains follow from; for Fig. 6 and for the reader, no part of the model."""

    Kc: float = Field(gt=0.0, description="critical gain [N/rad]")
    Tc: float = Field(gt=0.0, description="critical period [s]")


class Exoskeleton(Settings):
    """A device, as in configs/exoskeletons."""

    upper_link: Link
    lower_link: Link
    hinge_damping: float = Field(ge=0.0, description="viscous friction [N m s/rad]")
    ropes: dict[str, Rope] = Field(
        min_length=1, max_length=MOST_ROPES, description="ropes by name, each with a motor of its own"
    )
    guide_distance: float = Field(gt=0.0, le=0.6, description="from the hinge to the guided point of the forearm [m]")
    actuator: Actuator
    tuning: CriticalOscillation
    gains: PidGains
    drift_gain: float = Field(ge=0.0, description="feedback of the error coordinate's drift [1/s]")

    @model_validator(mode="before")
    @classmethod
    def _named_ropes(cls, data: Any) -> Any:
        """Files of version 0.1 name two ropes, 'agonist' and 'antagonist', beside the links."""
        if not isinstance(data, Mapping) or not set(TWO_ROPES) & set(data):
            return data
        given = {name: dict(data[name]) for name in TWO_ROPES if isinstance(data.get(name), Mapping)}
        more = data.get("ropes", {})
        if not isinstance(more, Mapping):
            raise ValueError(f"ropes = {shown(more)}: expected a mapping of ropes by name")
        ropes = {**more, **{k: {"pulls": TWO_ROPES[k], **x} for k, x in given.items()}}
        return {**{k: x for k, x in data.items() if k not in given}, "ropes": ropes}

    @model_validator(mode="after")
    def _can_lift(self) -> Self:
        if all(rope.sign < 0 for rope in self.ropes.values()):
            raise ValueError(f"ropes {choices(self.ropes)} all pull into extension; expected one that flexes the elbow")
        return self

    @model_validator(mode="after")
    def _pull_as_declared(self) -> Self:
        """Refuse a rope that does not turn the elbow the way it claims, all through the exercise."""
        for name, rope in self.ropes.items():
            for angle in range(LEAST_ANGLE, MOST_ANGLE + 1, ANGLE_STEP):
                arm = self.moment_arm(name, math.radians(angle))
                if not rope.sign * arm >= LEAST_LEVERAGE:
                    found = "it has no length" if math.isnan(arm) else f"its moment arm is {arm:.3g} m"
                    limit = f"at least {LEAST_LEVERAGE}" if rope.sign > 0 else f"at most -{LEAST_LEVERAGE}"
                    raise ValueError(
                        f"ropes.{name}: pulls = '{rope.pulls}', but at a hinge angle of {angle} deg {found} (positive "
                        f"where it flexes); expected {limit} m from {LEAST_ANGLE} to {MOST_ANGLE} deg. Move the ends "
                        "upper and lower, or change pulls"
                    )
        return self

    @classmethod
    def named(cls, source: str) -> Self:
        """A shipped device by its name, or one from a YAML file.

        Args:
            source: name of a file in configs/exoskeletons without its ending, or path of a YAML file;
                configs/exoskeletons/elbow.yaml shows every key.

        Raises:
            InputError: there is no such device, or its file is wrong; names file, key and value.

        Example:
            >>> Exoskeleton.named("elbow").lifting_rope
            'agonist'
        """
        if isinstance(source, str) and source.endswith((".yaml", ".yml")):
            return cls.from_file(source)
        shipped = shipped_devices()
        if source not in shipped:
            raise InputError(f"exoskeleton = {shown(source)}: expected one of {choices(shipped)}, or a YAML file.")
        return cls.from_config(f"exoskeletons/{source}.yaml")

    def changed(self, **changes: Any) -> Self:
        """A checked copy with other values, see `Settings.changed`.

        A rope may be changed by its name alone, as in files of version 0.1.
        """
        by_name = {name: x for name, x in changes.items() if name in self.ropes}
        others = {name: x for name, x in changes.items() if name not in self.ropes}
        if by_name:
            others["ropes"] = {**others.get("ropes", {}), **by_name}
        return super().changed(**others)

    @property
    def lifting_rope(self) -> str:
        """Name of the first rope that flexes the elbow: at the start of an episode it holds what the muscles do not."""
        return next(name for name, rope in self.ropes.items() if rope.sign > 0)

    @property
    def lowering_rope(self) -> str | None:
        """Name of the first rope that extends the elbow, None where there is none."""
        return next((name for name, rope in self.ropes.items() if rope.sign < 0), None)

    def moment_arm(self, rope: str, angle: float) -> float:
        """-dl/dtheta of a rope at a hinge angle [rad]; positive where its tension flexes [m]."""
        ends = self.ropes[rope]
        return rope_lever(np.array(ends.upper), np.array(ends.lower), angle)

    def own_moment(self, angle: float, gravity: float) -> float:
        """Moment that holds the lower link at a hinge angle [rad] [Nm]; gravity in m/s^2."""
        return link_moment(self.lower_link.numbers(), angle, gravity)

    def own_inertia(self) -> float:
        """Of the lower link about the hinge [kg m^2]."""
        link = self.lower_link
        return link.inertia[2] + link.mass * float(np.sum(np.square(link.centre_of_mass[:2])))


def shipped_devices() -> list[str]:
    """Names of the devices in configs/exoskeletons."""
    return sorted(path.stem for path in (configs() / "exoskeletons").glob("*.yaml"))


@compiled
def rope_lever(upper, lower, angle):
    """-dl/dtheta of a rope from a point of the upper link to one of the lower, at a hinge angle [rad] [m]."""
    c, s = math.cos(angle), math.sin(angle)
    end = (c * lower[0] - s * lower[1], s * lower[0] + c * lower[1], lower[2])
    d = sub(end, (upper[0], upper[1], upper[2]))
    return (d[0] * end[1] - d[1] * end[0]) / math.sqrt(dot(d, d))


@compiled
def link_moment(link, angle, gravity):
    """Moment that holds the lower link at a hinge angle [rad] [Nm]; link: mass and centre of mass, shape (4,)."""
    return link[0] * gravity * (link[1] * math.cos(angle) - link[2] * math.sin(angle))

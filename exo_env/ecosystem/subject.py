"""A subject's anatomy as data: bodies, joints and muscles of a model file, and which of them play which part.

A file (configs/subject/arm26.yaml is shipped) holds gravity, bodies, joints, muscles and, under `roles`, the names of
those that the ecosystem of the elbow needs:

    roles: {torso: base, humerus: r_humerus, forearm: r_ulna_radius_hand,
            mount: offset, shoulder: r_shoulder, elbow: r_elbow, flexors: [BIClong, BICshort, BRA]}

Muscles that are no flexors are extensors. Another file may have other muscles, and any number of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import blake2b
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import ConfigDict, Field, PlainSerializer, PlainValidator, model_validator

from dms_core.errors import InputError, choices
from dms_core.files.config_files import config_file, configs
from dms_core.files.input_file import decoded, read_bytes
from dms_core.files.yaml_text import parse_yaml
from dms_core.model import ThelenMuscle
from dms_core.model.element import Vector
from dms_core.validation import shown
from exo_env.settings import Settings

DEFAULT = "arm26"
BODY_ROLES, JOINT_ROLES = ("torso", "humerus", "forearm"), ("mount", "shoulder", "elbow")
SCALED = ("max_isometric_force", "optimal_fibre_length", "tendon_slack_length")
"""Numbers of a muscle that are scaled to a person."""
TIME_CONSTANTS = ("activation_time_constant", "deactivation_time_constant")
"""Numbers of all muscles that are scaled to a patient."""
LEAST_ACROSS = 30.0
"""Least angle between elbow axis and humerus [deg]: elbows have 80 to 90, and with an axis along the humerus the axes
of a link, y up and z along the hinge, do not exist."""


class Facts(Settings):
    """What a subject's file must hold; it may hold more, which nothing here reads."""

    model_config = ConfigDict(extra="allow")


class BodyFacts(Facts):
    """A body of the model."""

    mass: float = Field(ge=0.0, description="mass [kg]")
    centre_of_mass: Vector = Field(description="in the body's frame [m]")
    inertia: Vector = Field(description="principal moments about the centre of mass [kg m^2]")


class StopFacts(Settings):
    """Stops at both ends of a hinge's range, of an arm of the file's own size: fields of JointStop."""

    lowest: float = Field(ge=-math.pi, le=math.pi, description="angle where the lower stop is touched [rad]")
    highest: float = Field(ge=-math.pi, le=math.pi, description="angle where the upper stop is touched [rad]")
    stiffness: float = Field(gt=0.0, description="[N m/rad^1.5]")
    dissipation: float = Field(ge=0.0, description="[s/rad]")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.lowest >= self.highest:
            raise ValueError(f"lowest = {self.lowest:g} must be below highest = {self.highest:g}")
        return self


class JointFacts(Facts):
    """A joint of the model."""

    point_i: Vector = Field(description="centre of the joint in the frame of its first body [m]")
    axis_i: Vector | None = Field(default=None, description="axis of a hinge in the frame of its first body [-]")
    stop: StopFacts | None = Field(default=None, description="stops of the elbow; none where it is not given")


class PointFacts(Facts):
    """A point of a muscle's path."""

    body: str = Field(description="name of the body that holds it")
    point: Vector = Field(description="in the body's frame [m]")


class MuscleFacts(Facts):
    """A muscle; further keys are fields of ThelenMuscle."""

    path: tuple[PointFacts, ...] = Field(min_length=2, description="from origin to insertion")


class RoleFacts(Facts):
    """Names of the bodies, joints and muscles that the ecosystem of the elbow needs."""

    torso: str
    humerus: str
    forearm: str
    mount: str
    shoulder: str
    elbow: str
    flexors: tuple[str, ...]


class SubjectFacts(Facts):
    """A whole file."""

    gravity: Vector
    roles: RoleFacts
    grip: Vector
    bodies: dict[str, BodyFacts]
    joints: dict[str, JointFacts]
    muscle_defaults: dict[str, Any]
    muscles: dict[str, MuscleFacts] = Field(min_length=1)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Refuse roles that nothing has, and muscles that lack a number or lie on an unknown body."""
        for roles, section, known in (
            (BODY_ROLES, "bodies", self.bodies), (JOINT_ROLES, "joints", self.joints),
        ):  # fmt: skip
            for role in roles:
                _check_role(role, getattr(self.roles, role), known, section)
        for name in self.roles.flexors:
            _check_role("flexors", name, self.muscles, "muscles")
        for name, joint in self.joints.items():
            if joint.stop is not None and name != self.roles.elbow:
                raise ValueError(f"joints.{name}: stop: only the elbow, '{self.roles.elbow}', turns and has stops")
        _check_elbow_axis(self.roles.elbow, self.joints[self.roles.elbow].axis_i)
        for key in TIME_CONSTANTS:
            if key not in self.muscle_defaults:
                raise ValueError(f"muscle_defaults: '{key}' is missing")
        bodies = [getattr(self.roles, role) for role in BODY_ROLES]
        for name, muscle in self.muscles.items():
            for key in SCALED:
                if not hasattr(muscle, key) and key not in self.muscle_defaults:
                    raise ValueError(f"muscles.{name}: '{key}' is missing")
            for point in muscle.path:
                if point.body not in bodies:
                    raise ValueError(f"muscles.{name}.path: body = '{point.body}': expected one of {choices(bodies)}")
            _check_muscle(name, {**self.muscle_defaults, **dict(muscle)})
        return self


def _check_muscle(name: str, facts: dict[str, Any]) -> None:
    """Refuse a muscle that no arm could be given; `facts` are its fields."""
    for key in ("name", "excitation"):
        if key in facts:
            raise ValueError(f"muscles.{name}: unknown key '{key}'; it is decided by the muscle's name")
    points = [{"body": point.body, "point": point.point} for point in facts["path"]]
    ThelenMuscle(**{**facts, "name": name, "excitation": name, "path": points})


def _check_role(role: str, name: str, known: Mapping[str, Any], section: str) -> None:
    """Refuse a role that nothing in the file has."""
    if name not in known:
        raise ValueError(f"roles: {role} = {shown(name)}; expected one of the {section} {choices(known)}")


def _check_elbow_axis(joint: str, axis: Vector | None) -> None:
    """Refuse an elbow axis that is missing, has no direction or runs along the humerus, whose long axis is y."""
    if axis is None:
        raise ValueError(f"joints.{joint}: 'axis_i' is missing")
    length = math.hypot(*axis)
    across = math.degrees(math.atan2(math.hypot(axis[0], axis[2]), abs(axis[1])))
    if across < LEAST_ACROSS:
        what = f"is {across:.3g} deg from the humerus (y)" if length > 0.0 else "has no direction"
        raise ValueError(
            f"joints.{joint}: axis_i = {axis} {what}; expected an axis across the humerus, at least {LEAST_ACROSS:g} "
            "deg from y"
        )


@dataclass(frozen=True)
class Subject:
    """An anatomy as its file was when it was read: two are equal where name and contents are."""

    source: str
    """Name of a shipped subject, or whole path of a YAML file."""
    digest: str
    """Digest of the file's contents."""
    facts: dict[str, Any] = field(compare=False, repr=False)
    """Contents of the file."""


def read_subject(source: str | Subject) -> Subject:
    """A subject, its file checked; read again where the file has changed.

    Args:
        source: name of a shipped subject, path of a YAML file, or a subject that was read before.

    Raises:
        InputError: there is no such subject, or its file is wrong; names file, key and value.
    """
    if isinstance(source, Subject):
        return source
    path = _path(source)
    return _read(str(path.resolve()) if _is_file(source) else source, path, read_bytes(path))


@lru_cache(maxsize=16)
def _read(source: str, path: Path, content: bytes) -> Subject:
    facts = parse_yaml(decoded(path, content), path)
    try:
        SubjectFacts(**facts)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return Subject(source, blake2b(content, digest_size=16).hexdigest(), facts)


AnySubject = Annotated[
    Subject | str,
    PlainValidator(read_subject),
    PlainSerializer(lambda subject: f"{subject.source} {subject.digest}"),
]
"""A subject as a setting: given by name, by path, or as one that was read."""


def _is_file(source: str) -> bool:
    """Whether a subject is given by the path of a file, not by its name."""
    return isinstance(source, str) and source.endswith((".yaml", ".yml"))


def _path(source: str) -> Path:
    """Path of the file of a subject."""
    if _is_file(source):
        return Path(source)
    shipped = sorted(p.stem for p in (configs() / "subject").glob("*.yaml"))
    if source not in shipped:
        raise InputError(f"subject = {shown(source)}: expected one of {choices(shipped)}, or a YAML file.")
    return config_file(f"subject/{source}.yaml")

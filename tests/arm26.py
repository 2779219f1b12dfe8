"""The arm of configs/subject/arm26.yaml, posed without an assembly, and the tables it is compared with."""

from __future__ import annotations

import csv
import math
from functools import cache
from pathlib import Path

import numpy as np
import yaml

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.geometry.frames import quaternion, unit
from dms_core.model.muscles.muscle import ThelenMuscle
from dms_core.model.signals import Input
from dms_core.model.system import System

ROOT = Path(__file__).parent.parent
REFERENCE = ROOT / "tests" / "reference"
MUSCLES = ("TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA")


@cache
def subject() -> dict:
    """The subject file."""
    return yaml.safe_load((ROOT / "configs" / "subject" / "arm26.yaml").read_text())


def table(name: str) -> list[dict[str, float | str]]:
    """Rows of a reference file; what is no number stays text."""

    def value(text: str) -> float | str:
        try:
            return float(text)
        except ValueError:
            return text

    with (REFERENCE / f"{name}.csv").open(newline="") as file:
        return [{key: value(text) for key, text in row.items()} for row in csv.DictReader(file)]


def muscle(name: str, **changes) -> ThelenMuscle:
    """One muscle, excited by the input "command"."""
    facts = {**subject()["muscle_defaults"], **subject()["muscles"][name], "name": name, "excitation": "command"}
    return ThelenMuscle(**{**facts, **changes})


def arm(flexion_deg: float, *forces, speed: float = 0.0) -> System:
    """Torso, humerus and forearm posed with the shoulder at 0 and the elbow as given, turning at `speed` [rad/s]."""
    facts = subject()
    joints, bodies = facts["joints"], facts["bodies"]
    torso = np.array(joints["offset"]["point_i"])
    humerus = torso + joints["r_shoulder"]["point_i"]
    forearm = humerus + joints["r_elbow"]["point_i"]
    axis = unit(joints["r_elbow"]["axis_i"], "axis of the elbow")
    turn = quaternion(axis, math.radians(flexion_deg))
    return System(
        # The torso is massless in the file; a body of no importance stands in for it.
        bodies=[
            RigidBody(name="base", mass=1.0, inertia=(1.0, 1.0, 1.0), position=tuple(torso)),
            RigidBody(name="r_humerus", **bodies["r_humerus"], position=tuple(humerus)),
            RigidBody(
                name="r_ulna_radius_hand",
                **bodies["r_ulna_radius_hand"],
                position=tuple(forearm),
                orientation=tuple(turn),
                angular_velocity=tuple(speed * axis),
            ),
        ],
        forces=forces,
        inputs=[Input(name="command")],
    )


def body_coordinates(system: System, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """q and v of the named bodies at their declared start, one behind the other."""
    coordinates = [c for name in names for c in system.element(name).coordinates()]
    return np.array([c.start for c in coordinates]), np.array([c.rate for c in coordinates])

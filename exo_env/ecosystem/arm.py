"""The arm of a subject: torso, humerus and forearm (ulna, radius and hand) with their muscles, scaled to a person.

Shoulder at 0, so that all frames are parallel to ground where the elbow is straight; the elbow turns about arm26's own
tilted axis. Muscles run straight through their points: below 8 degrees BRA passes behind the elbow axis and beyond
70 degrees the triceps lose leverage, so exercises stay within 20 to 100 degrees.

Scaling from arm26 (index 0) to a person of mass M, height H and sex s, with the segment fractions of de Leva (1996),
J. Biomech. 29:1223-1230:

    mass     m  = m_0  (M / M_0) (mass fraction_s / mass fraction_male)
    length   l  = l_0  k,   k = (H / H_0) (length fraction_s / length fraction_male), per segment
    inertia  J  = J_0  (m / m_0) k^2
    muscle   L0 and Ls with the length of the whole path at 90 degrees; F0 = F0_0 strength (M / M_0) / (H / H_0),
             since muscle volume goes with body mass and force with volume over fibre length
    stop     k  = k_0 M / M_0, since a moment of tissue is a stress times an area times a lever, which is a volume
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from math import degrees, radians
from typing import Any, NamedTuple

import numpy as np

from dms_core.model import GROUND, Fixed, JointStop, PathPoint, Revolute, RigidBody, ThelenMuscle
from dms_core.model.element import Constraint, Force, Vector
from dms_core.model.geometry.frames import quaternion, rotation_matrix, unit
from exo_env.ecosystem.person import HEIGHT_0, MASS_0, Person
from exo_env.ecosystem.subject import BODY_ROLES, DEFAULT, StopFacts, Subject, read_subject

ELBOW, ELBOW_STOP = "elbow", "elbow_stop"
USUAL_RANGE_DEG = (0.0, 142.0)
"""A straight arm, and the mean active flexion of men (Boone and Azen 1979, J. Bone Joint Surg. 61-A:756-759) [deg]."""
MASS_FRACTION = {
    "male": {"torso": 0.4346, "humerus": 0.0271, "forearm": 0.0162 + 0.0061},
    "female": {"torso": 0.4257, "humerus": 0.0255, "forearm": 0.0138 + 0.0056},
}
"""Segment over body mass (de Leva 1996, table 4); the forearm with the hand."""
LENGTH_FRACTION = {
    "male": {"torso": 0.6033 / 1.741, "humerus": 0.2817 / 1.741, "forearm": 0.2689 / 1.741},
    "female": {"torso": 0.6148 / 1.735, "humerus": 0.2751 / 1.735, "forearm": 0.2643 / 1.735},
}
"""Segment length over height (de Leva 1996, table 4)."""
TORSO_RADIUS = 0.17
"""Radius of gyration of the torso about every axis [m], assumed; without effect, since it is fixed to ground."""


class Segment(NamedTuple):
    """A body of the arm, scaled to a person."""

    mass: float
    """Mass [kg]."""
    centre_of_mass: np.ndarray
    """Centre of mass in the body's frame [m]."""
    inertia: np.ndarray
    """Principal moments about the centre of mass, in the body's frame [kg m^2]."""
    origin: np.ndarray
    """Origin of the body's frame in ground axes [m]; the forearm's is the elbow centre."""


@dataclass(frozen=True)
class Arm:
    """The arm of a person: what the simulated subject is made of, and what a subject knows of itself.

    Args:
        person: person to whom the subject's anatomy is scaled.
        subject: anatomy, a shipped one by name or a YAML file (subject.py).
    """

    person: Person = Person()
    subject: str | Subject = DEFAULT

    def __post_init__(self) -> None:
        object.__setattr__(self, "subject", read_subject(self.subject))

    @property
    def facts(self) -> dict[str, Any]:
        """Contents of the subject's file."""
        return read_subject(self.subject).facts

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles; everything that has one number a muscle has them in this order."""
        return tuple(self.facts["muscles"])

    @property
    def signs(self) -> np.ndarray:
        """+1 for a flexor, -1 for an extensor, shape (n,)."""
        flexors = self.facts["roles"]["flexors"]
        return np.array([1.0 if m in flexors else -1.0 for m in self.muscles])

    @property
    def gravity(self) -> Vector:
        """Gravity in ground axes [m/s^2]."""
        x, y, z = self.facts["gravity"]
        return (x, y, z)

    def length_factor(self, body: str) -> float:
        """Length factor k of a segment [-]."""
        by_sex = LENGTH_FRACTION[self.person.sex][body] / LENGTH_FRACTION["male"][body]
        return self.person.height / HEIGHT_0 * by_sex

    def mass_factor(self, body: str) -> float:
        """Mass factor m / m_0 of a segment [-]."""
        by_sex = MASS_FRACTION[self.person.sex][body] / MASS_FRACTION["male"][body]
        return self.person.body_mass / MASS_0 * by_sex

    @cached_property
    def segments(self) -> dict[str, Segment]:
        """The scaled bodies by our names."""
        joints, roles = self.facts["joints"], self.facts["roles"]
        at = np.array(joints[roles["mount"]]["point_i"])
        found = {}
        offset = {
            "torso": np.zeros(3),
            "humerus": joints[roles["shoulder"]]["point_i"],
            "forearm": joints[roles["elbow"]]["point_i"],
        }
        parent = {"torso": "torso", "humerus": "torso", "forearm": "humerus"}
        for name in BODY_ROLES:
            body, k, f = self.facts["bodies"][roles[name]], self.length_factor(name), self.mass_factor(name)
            at = at + self.length_factor(parent[name]) * np.asarray(offset[name])
            mass, inertia = f * body["mass"], f * k * k * np.array(body["inertia"])
            if name == "torso":
                mass = MASS_FRACTION[self.person.sex]["torso"] * self.person.body_mass
                inertia = np.full(3, mass * TORSO_RADIUS**2)
            found[name] = Segment(mass, k * np.array(body["centre_of_mass"]), inertia, at)
        return found

    @cached_property
    def axis(self) -> np.ndarray:
        """Elbow axis, flexion positive, in humerus and ground axes [-]."""
        return unit(self.facts["joints"][self.facts["roles"]["elbow"]]["axis_i"], "elbow axis")

    @property
    def elbow(self) -> np.ndarray:
        """Elbow centre in ground axes [m]."""
        return self.segments["forearm"].origin

    @property
    def grip(self) -> np.ndarray:
        """Centre of the grip in the forearm's frame [m]."""
        return self.length_factor("forearm") * np.array(self.facts["grip"])

    def rotation(self, flexion: float) -> np.ndarray:
        """Rotation matrix A of the forearm at an elbow angle [rad], shape (3, 3)."""
        return rotation_matrix(quaternion(self.axis, flexion))

    def bodies(self, flexion: float) -> list[RigidBody]:
        """Torso, humerus and forearm with the elbow at `flexion` [rad], at rest."""
        turn = {"forearm": tuple(quaternion(self.axis, flexion))}
        return [
            RigidBody(
                name=name,
                mass=s.mass,
                inertia=tuple(s.inertia),
                centre_of_mass=tuple(s.centre_of_mass),
                position=tuple(s.origin),
                orientation=turn.get(name, (1.0, 0.0, 0.0, 0.0)),
            )
            for name, s in self.segments.items()
        ]

    def joints(self) -> list[Constraint]:
        """Torso fixed to ground, humerus fixed to torso, elbow."""
        s = self.segments
        shoulder = tuple(s["humerus"].origin - s["torso"].origin)
        elbow = tuple(s["forearm"].origin - s["humerus"].origin)
        return [
            Fixed(name="torso_mount", body_j="torso", point_i=tuple(s["torso"].origin)),
            Fixed(name="shoulder", body_i="torso", body_j="humerus", point_i=shoulder),
            Revolute(
                name=ELBOW, body_i="humerus", body_j="forearm", point_i=elbow, point_j=(0.0, 0.0, 0.0),
                axis_i=tuple(self.axis), axis_j=tuple(self.axis),
            ),
        ]  # fmt: skip

    @property
    def stop(self) -> StopFacts | None:
        """Stops of the elbow of a person of arm26's mass; None where the subject has none."""
        facts = self.facts["joints"][self.facts["roles"]["elbow"]].get("stop")
        return None if facts is None else StopFacts(**facts)

    def within_stops(self, low: float, high: float) -> tuple[float, float]:
        """A range of elbow angles as far as the stops leave it free [deg]; without stops, as far as those of men."""
        lowest, highest = USUAL_RANGE_DEG
        if self.stop is not None:
            # Given in radians: the way to degrees leaves the last digit.
            lowest, highest = round(degrees(self.stop.lowest), 10), round(degrees(self.stop.highest), 10)
        return max(low, lowest), min(high, highest)

    def forces(self) -> list[Force]:
        """What acts in the joints beside the muscles: stops, elements that read traits with `acts="joint"`."""
        if self.stop is None:
            return []
        facts = self.stop.model_dump()
        facts["stiffness"] *= self.person.body_mass / MASS_0
        return [JointStop(name=ELBOW_STOP, joint=ELBOW, **facts)]

    def path(self, muscle: str, *, welded: bool = False) -> tuple[PathPoint, ...]:
        """Points of a muscle; with `welded`, torso and humerus are parts of the ground."""
        if (muscle, welded) not in self._paths:
            self._paths[muscle, welded] = self._path(muscle, welded)
        return self._paths[muscle, welded]

    @cached_property
    def _paths(self) -> dict[tuple[str, bool], tuple[PathPoint, ...]]:
        """Paths of the muscles that were asked for so far."""
        return {}

    def _path(self, muscle: str, welded: bool) -> tuple[PathPoint, ...]:
        ours = {self.facts["roles"][name]: name for name in BODY_ROLES}
        points = []
        for p in self.facts["muscles"][muscle]["path"]:
            body = ours[p["body"]]
            x = self.length_factor(body) * np.array(p["point"])
            if welded and body != "forearm":
                points.append(PathPoint(body=GROUND, point=tuple(x + self.segments[body].origin)))
            else:
                points.append(PathPoint(body=body, point=tuple(x)))
        return tuple(points)

    def muscle_geometry(self, muscle: str, flexion: float) -> tuple[float, float]:
        """(length [m], moment arm -dl/dtheta [m], positive for a flexor) at an elbow angle [rad]."""
        return path_geometry(self, self.path(muscle, welded=True), flexion)

    def muscle(self, name: str, **more: Any) -> ThelenMuscle:
        """A muscle of the person; `more` are further fields of ThelenMuscle, or others in place of these."""
        if more:
            return self._muscle(name, more)
        if name not in self._muscles:
            self._muscles[name] = self._muscle(name, {})
        return self._muscles[name]

    @cached_property
    def _muscles(self) -> dict[str, ThelenMuscle]:
        """Muscles that were asked for so far, without changes."""
        return {}

    def _muscle(self, name: str, more: dict[str, Any]) -> ThelenMuscle:
        facts = {**self.facts["muscle_defaults"], **self.facts["muscles"][name]}
        k = self._path_factors[name]
        size = self.person.strength * self.person.body_mass / MASS_0 * HEIGHT_0 / self.person.height
        facts |= {
            "max_isometric_force": size * facts["max_isometric_force"],
            "optimal_fibre_length": k * facts["optimal_fibre_length"],
            "tendon_slack_length": k * facts["tendon_slack_length"],
            "path": self.path(name),
        }
        return ThelenMuscle(**{"name": name, "excitation": excitation_name(name), **facts, **more})

    @cached_property
    def _path_factors(self) -> dict[str, float]:
        """Length of each muscle's scaled path over that of arm26, at 90 degrees [-]."""
        if self.person.height == HEIGHT_0 and self.person.sex == "male":
            return dict.fromkeys(self.muscles, 1.0)
        lengths = _path_lengths(read_subject(self.subject))
        return {name: self.muscle_geometry(name, radians(90.0))[0] / x for name, x in lengths.items()}

    def inertia_about_elbow(self) -> float:
        """Generalised inertia of the forearm about the elbow axis [kg m^2]."""
        s = self.segments["forearm"]
        lever = np.cross(self.axis, s.centre_of_mass)
        return float(self.axis @ (s.inertia * self.axis) + s.mass * lever @ lever)

    def gravity_moment(self, flexion: float) -> float:
        """Moment of the forearm's weight about the elbow axis [Nm], negative where it extends."""
        s = self.segments["forearm"]
        lever = self.rotation(flexion) @ s.centre_of_mass
        return float(self.axis @ np.cross(lever, s.mass * np.array(self.gravity)))


@cache
def _path_lengths(subject: Subject) -> dict[str, float]:
    """Length of each muscle's path before it is scaled, at 90 degrees [m]."""
    arm = Arm(subject=subject)
    return {name: arm.muscle_geometry(name, radians(90.0))[0] for name in arm.muscles}


def excitation_name(muscle: str) -> str:
    """Name of the input that excites a muscle."""
    return f"excitation.{muscle}"


def path_geometry(arm: Arm, points: tuple[PathPoint, ...], flexion: float) -> tuple[float, float]:
    """Length and moment arm of a path through ground and forearm points."""
    A, length, moment_arm = arm.rotation(flexion), 0.0, 0.0
    x = [arm.elbow + A @ np.array(p.point) if p.body == "forearm" else np.array(p.point) for p in points]
    for a, b, pa, pb in zip(x[:-1], x[1:], points[:-1], points[1:], strict=True):
        d = b - a
        segment = float(np.linalg.norm(d))
        length += segment
        for point, p, sign in ((b, pb, 1.0), (a, pa, -1.0)):
            if p.body == "forearm":
                moment_arm -= sign * float(np.cross(arm.axis, point - arm.elbow) @ d) / segment
    return length, moment_arm

"""The scene of an episode: points of the simulated system in the plane of motion."""

from __future__ import annotations

import math

import numpy as np

from dms_core.model.geometry.frames import rotation_matrix
from exo_env.ecosystem.gym_machine import HANDLE, WEIGHT
from exo_env.ecosystem.sensors import tension_sensor
from exo_env.rendering.scene import MusclePath, RopePath, Scene
from exo_env.tables import STATUS
from exo_env.world.episodes.episode import Episode
from exo_env.world.episodes.readout import Readout

UPPER_END = 0.22
"""Drawn length of the upper link [m]."""


def scene_of(now: Readout, label: str) -> Scene:
    """The present scene.

    Args:
        now: readings of the episode that is shown.
        label: words that name the patient.
    """
    episode, angle, hinge = now.episode, now.sensor("elbow_angle.angle"), now.sensor("exo_angle.angle")
    plan, step = now.world.tables.plan, int(now.world.tables.status[STATUS.step])
    psi = float(plan.course[step, 0])
    arm, machine = episode.arm, episode.ecosystem.machine
    assert machine is not None
    grip = arm.elbow + arm.rotation(angle) @ arm.grip
    index, q = episode.model.layout.index, episode.world.state.q
    turn = rotation_matrix(np.array([q[index[f"{HANDLE}.p{i}"]] for i in range(4)]))
    tied = grip + turn @ (0.0, -machine.handle.length, 0.0)
    weight = np.array([q[index[f"{WEIGHT}.{x}"]] for x in "xyz"])
    low, high = np.array(machine.low_pulley), np.array(machine.high_pulley)
    return Scene(
        shoulder=arm.segments["humerus"].origin[:2].copy(),
        elbow=arm.elbow[:2].copy(),
        grip=grip[:2],
        muscles=_muscles(episode, angle, now.activations),
        ropes=_ropes(episode, hinge, now),
        exo_links=_links(episode, hinge),
        elbow_angle=angle,
        reference_angle=psi,
        time=episode.world.time,
        error_deg=math.degrees(angle - psi),
        muscle_moment=now.sensor("muscle_moment"),
        device_moment=now.sensor("exo_moment"),
        effort=episode.effort,
        plan_hidden=bool(now.world.task.revealing),
        label=label,
        weight=weight[:2],
        weight_mass=float(plan.loads[step]),
        pulleys=(low[:2], high[:2]),
        gym_rope=np.array([grip, tied, low, high, weight])[:, :2],
    )


def _muscles(episode: Episode, angle: float, activations: np.ndarray) -> tuple[MusclePath, ...]:
    """Paths of the muscles with their activations."""
    arm, A, found = episode.arm, episode.arm.rotation(angle), []
    for m, a in zip(arm.muscles, activations, strict=True):
        path = arm.path(m, welded=True)
        points = [arm.elbow + A @ np.array(p.point) if p.body == "forearm" else np.array(p.point) for p in path]
        found.append((np.array(points)[:, :2], float(a)))
    return tuple(found)


def _ropes(episode: Episode, hinge: float, now: Readout) -> tuple[RopePath, ...]:
    """Paths of the ropes with their tensions."""
    worn, found = episode.worn, []
    for name, rope in worn.device.ropes.items():
        ends = np.array([_on_upper(episode, rope.upper), _on_lower(episode, hinge, rope.lower)])
        found.append((ends[:, :2], max(now.sensor(tension_sensor(name)), 0.0)))
    return tuple(found)


def _links(episode: Episode, hinge: float) -> tuple[np.ndarray, np.ndarray]:
    """Upper link from its far end to the hinge, lower link from the hinge to the guide."""
    upper = [_on_upper(episode, (0.0, y, 0.0)) for y in (UPPER_END, 0.0)]
    lower = [_on_lower(episode, hinge, (0.0, -y, 0.0)) for y in (0.0, episode.worn.device.guide_distance)]
    return np.array(upper)[:, :2], np.array(lower)[:, :2]


def _on_upper(episode: Episode, point: tuple[float, float, float]) -> np.ndarray:
    """A point of the upper link in ground axes [m]."""
    worn = episode.worn
    return worn.origin + rotation_matrix(worn.orientation) @ point


def _on_lower(episode: Episode, hinge: float, point: tuple[float, float, float]) -> np.ndarray:
    """A point of the lower link in ground axes [m]."""
    x, y, z = point
    c, s = math.cos(hinge), math.sin(hinge)
    return _on_upper(episode, (c * x - s * y, s * x + c * y, z))

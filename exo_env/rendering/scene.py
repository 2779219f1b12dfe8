"""What a picture of the environment shows: points of the simulated system in the plane of motion, and a few numbers.

Points are (x forward, y up) of ground axes [m], shape (2,); polylines have shape (n, 2). Filled from the simulation,
drawn by `rendering`; it knows neither of them, so that a scene can be stored, pickled and drawn elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MusclePath = tuple[np.ndarray, float]
"""(points from origin to insertion [m], shape (n, 2); activation 0 to 1 [-])."""
RopePath = tuple[np.ndarray, float]
"""(points from the motor on [m], shape (n, 2); tension [N])."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """One moment of an episode; without a gym machine the last four fields keep their defaults."""

    shoulder: np.ndarray
    """Centre of the shoulder [m], shape (2,)."""
    elbow: np.ndarray
    """Centre of the elbow [m], shape (2,)."""
    grip: np.ndarray
    """Centre of the grip in the hand [m], shape (2,)."""
    muscles: tuple[MusclePath, ...]
    """Every muscle with its activation."""
    ropes: tuple[RopePath, ...]
    """The ropes of the exoskeleton with their tensions."""
    exo_links: tuple[np.ndarray, ...]
    """Outlines of the exoskeleton's links [m]: upper link from its far end to the hinge, lower link from the hinge to
    the guide, each of shape (n, 2). Empty: no device is worn."""
    elbow_angle: float
    """Elbow flexion [rad]."""
    reference_angle: float
    """Elbow flexion that the exercise asks for, or that the patient wants [rad]."""
    time: float
    """Since the start of the episode [s]."""
    error_deg: float
    """Elbow flexion minus reference [deg]."""
    muscle_moment: float
    """Moment of the muscles about the elbow, flexion positive [Nm]."""
    device_moment: float
    """Moment of the device's ropes about its hinge, flexion positive [Nm]."""
    effort: float
    """What the patient intends, as a multiple of what was planned [-]."""
    plan_hidden: bool = False
    """Whether the reference is a plan of the patient's that the device is not told."""
    label: str = ""
    """Words that name the patient."""
    weight: np.ndarray | None = None
    """Centre of the weight [m], shape (2,)."""
    weight_mass: float | None = None
    """Mass of the weight at this time [kg]."""
    pulleys: tuple[np.ndarray, ...] = ()
    """Pulleys of the gym machine [m], each of shape (2,)."""
    gym_rope: np.ndarray | None = None
    """Gym rope from the grip over the end of the handle and the pulleys to the weight [m], shape (n, 2), n >= 3."""

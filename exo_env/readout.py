"""True readings of an episode, by the names that observations, rewards and events use."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from exo_env.episode import Episode
from exo_env.human import MUSCLES
from exo_env.observations import PREVIEW, patient_channels

SENSORS = (
    "elbow_angle.angle", "elbow_angle.rate", "exo_angle.angle", "exo_angle.rate", "agonist_tension",
    "antagonist_tension", "muscle_moment", "exo_moment", *(f"elbow_reaction.F{x}" for x in "xyz"),
    *(f"guide_force.F{x}" for x in "xyz"),
)  # fmt: skip


class Readout:
    """What the sensors of an episode's model say at control times.

    Args:
        episode: whose world is read.
    """

    angle: float
    """Of the elbow [rad]."""
    rate: float
    """Of the elbow [rad/s]."""
    hinge: float
    """Angle of the device [rad]."""
    tensions: np.ndarray
    """Of agonist and antagonist rope [N], shape (2,)."""
    muscle_moment: float
    """About the elbow [Nm]."""
    exo_moment: float
    """Of the ropes about the hinge [Nm]."""
    reaction: float
    """Size of the elbow's reaction force [N]."""
    guide: float
    """Force of the guide on the forearm along the normal of its plane [N]."""
    share: float
    """Of the device in the moment [-]."""

    def __init__(self, episode: Episode) -> None:
        self.episode, names = episode, episode.names
        self.y = np.zeros(len(names))
        self._at = np.array([names[name] for name in SENSORS])
        self._force = np.array([names[f"{m}.sensor.tendon_force"] for m in MUSCLES])
        self._activation = np.array([names[f"{m}.sensor.activation"] for m in MUSCLES])
        course = episode.repetition.course
        self.course = course(episode.times)
        ahead = [np.minimum(episode.times + t, episode.times[-1]) for t in PREVIEW]
        self._preview = np.stack([course(times)[:, 0] for times in ahead], axis=1)
        self._patient = {c.name: getattr(episode.patient, c.name) for c in patient_channels()}

    def update(self, step: int) -> None:
        """Read the world, which is at the time of a control step."""
        self.step = step
        self.episode.world.read(self.y)
        y = self.y[self._at]
        self.angle, self.rate, self.hinge, self._hinge_rate = map(float, y[:4])
        self.tensions = np.maximum(y[4:6], 0.0)
        self.muscle_moment, self.exo_moment = float(y[6]), float(y[7])
        self.reaction = math.sqrt(y[8] ** 2 + y[9] ** 2 + y[10] ** 2)
        # The x axis of the lower link.
        normal = self.episode.worn.axes @ (math.cos(self.hinge), math.sin(self.hinge), 0.0)
        self.guide = float(y[11:14] @ normal)
        self.share = device_share(self.muscle_moment, self.exo_moment)

    @property
    def reference(self) -> float:
        """psi [rad]."""
        return float(self.course[self.step, 0])

    @property
    def error(self) -> float:
        """Elbow angle minus reference [rad]."""
        return self.angle - self.reference

    @property
    def activations(self) -> np.ndarray:
        """Of the muscles [-], shape (6,)."""
        return self.y[self._activation]

    def channels(self, action: np.ndarray) -> dict[str, Any]:
        """What the channels of observations.py show, [unit of the channel]; `action`: the last one."""
        k, effort = self.step, self.episode.effort
        return {
            "angle": self.hinge, "rate": self._hinge_rate, "tension": self.tensions, "guide_force": self.guide,
            "reference": self.course[k, 0], "reference_rate": self.course[k, 1], "preview": self._preview[k],
            "last_action": action, "emg": self.activations, **self._patient,
            "load": self.episode.ecosystem.weight, "muscle_force": self.y[self._force],
            "fatigued": effort.fatigued, "effort": effort.effort, "device_share": self.share,
        }  # fmt: skip

    def readings(self) -> dict[str, float]:
        """Every sensor, what follows from them, the inputs held, counts and worst errors of the solver."""
        e = self.episode
        found = {name: float(self.y[k]) for name, k in e.names.items()}
        found |= {
            "time": e.world.time, "reference": self.reference, "tracking_error": self.error,
            "elbow_reaction": self.reaction, "device_share": self.share, "effort": e.effort.effort,
        }  # fmt: skip
        found |= {name: float(x) for name, x in zip(e.drive.inputs, e.held, strict=True)}
        return found | {f"solver.{name}": float(x) for name, x in e.world.stats().as_dict().items()}


def device_share(muscles: float, device: float) -> float:
    """What the device carries of the moment that both give, from 0 to 1 [-].

    Args:
        muscles: moment of the muscles [Nm].
        device: moment of the device [Nm].
    """
    both = muscles + device
    if both == 0.0:
        return 0.0
    way = math.copysign(1.0, both)
    carried, own = max(way * device, 0.0), max(way * muscles, 0.0)
    return carried / (carried + own)

"""True readings of an episode, by the names that observations, rewards and events use, and what `info` tells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from exo_env.ecosystem.arm import MUSCLES
from exo_env.patient.patient import fields_of
from exo_env.tasks.limits import NOTHING, SOLVER, Limits, event
from exo_env.tasks.movement import MOVED
from exo_env.tasks.rewards import TERMS
from exo_env.world.control_period import READING, STATUS, Plant
from exo_env.world.episode import Episode


class Readout:
    """What the sensors of an episode's model say at the present control time.

    Args:
        episode: whose world is read.
        plant: its arrays.
    """

    def __init__(self, episode: Episode, plant: Plant) -> None:
        self.episode, self.plant = episode, plant
        self._activation = np.array([episode.names[f"{m}.sensor.activation"] for m in MUSCLES])

    def __getitem__(self, place: int) -> float:
        """A reading by its place in READING."""
        return float(self.plant.reading[place])

    @property
    def angle(self) -> float:
        """Of the elbow [rad]."""
        return self[READING.angle]

    @property
    def reference(self) -> float:
        """psi [rad]."""
        return float(self.plant.course[self.plant.status[STATUS.step], 0])

    @property
    def error(self) -> float:
        """Elbow angle minus reference [rad]."""
        return self[READING.error]

    @property
    def tensions(self) -> np.ndarray:
        """Of agonist and antagonist rope [N], shape (2,)."""
        return self.plant.reading[READING.agonist : READING.antagonist + 1].copy()

    @property
    def activations(self) -> np.ndarray:
        """Of the muscles [-], shape (6,)."""
        return self.plant.y[self._activation]

    def readings(self) -> dict[str, float]:
        """Every sensor, what follows from them, the commands reached, counts and worst errors of the solver."""
        e = self.episode
        found = {name: float(self.plant.y[k]) for name, k in e.names.items()}
        found |= {
            "time": e.world.time, "reference": self.reference, "tracking_error": self.error,
            "elbow_reaction": self[READING.reaction], "device_share": self[READING.share], "effort": e.effort,
        }  # fmt: skip
        found |= {name: float(x) for name, x in zip(e.drive.inputs, self.plant.commands, strict=True)}
        return found | {f"solver.{name}": float(x) for name, x in e.world.stats().as_dict().items()}

    def happened(self, limits: Limits) -> str | None:
        """The sentence on what ended the episode, or None."""
        code = self.plant.status[STATUS.event]
        if code == NOTHING:
            return None
        if code == SOLVER:
            world = self.episode.world
            return f"{world.result.value} Stopped at t = {world.time:.6g} s."
        return event(int(code), limits, self.angle, float(max(self.tensions)), self[READING.reaction])

    def start_info(self) -> dict[str, Any]:
        """What the episode is made of."""
        e = self.episode
        return {
            "patient": fields_of(e.who.tolist()),
            "load": e.load,
            "ability": e.need.ability,
            "reference": dict(zip(MOVED, e.movement.tolist(), strict=False)),
            # Given in degrees, kept in radians: the way back leaves the last digit.
            "initial_angle_deg": round(math.degrees(e.start), 10),
        }

    def info(self, weights: dict[str, float], happened: str | None) -> dict[str, Any]:
        """Of a step.

        Args:
            weights: of the reward.
            happened: what ended the episode.
        """
        plant = self.plant
        found: dict[str, Any] = {
            "reward_terms": dict(zip(TERMS, plant.terms.tolist(), strict=True)),
            "reward_weights": weights.copy(),
            "time": float(self.episode.times[plant.status[STATUS.step]]),
            "tracking_error_deg": math.degrees(self.error),
            "device_share": self[READING.share],
            "effort": self.episode.effort,
            "elbow_reaction": self[READING.reaction],
            "solver_failed": bool(plant.status[STATUS.event] == SOLVER),
        }
        if happened is not None:
            found["event"] = happened
        return found

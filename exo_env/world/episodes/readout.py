"""True readings of an episode by name, and the contents of `info`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dms_core.results import Result
from exo_env.ecosystem.sensors import muscle_sensor
from exo_env.patient.patient import fields_of
from exo_env.tables import STATUS
from exo_env.tasks.movements.movement import Movement
from exo_env.tasks.observation.channels import Reading
from exo_env.tasks.task import NOTHING, SOLVER
from exo_env.world.episodes.episode import Episode
from exo_env.world.world import PatientWorld


class Readout:
    """The readings of a world at the present control time.

    Args:
        world: world that is read.
        episode: episode that takes place in it.
    """

    def __init__(self, world: PatientWorld, episode: Episode) -> None:
        self.world, self.episode = world, episode

    def __call__(self, name: str) -> np.ndarray:
        """Components of a reading of the task, by its name."""
        return self.world.tables.task.readings[self.world.task.places[name]].copy()

    def number(self, name: str) -> float:
        """A reading of one component, by its name."""
        return float(self(name)[0])

    def sensor(self, name: str) -> float:
        """A component of the model's sensors, by its name."""
        return float(self.world.tables.dynamics.y[self.world.names[name]])

    def known_readings(self) -> list[Reading]:
        """Readings of the task; those that the device's filter estimates only where it runs."""
        runs = self.world.observer.device is not None
        return [r for r in self.world.task.readings if runs or r.estimate is None]

    @property
    def activations(self) -> np.ndarray:
        """Activations of the muscles [-], shape (m,)."""
        return np.array([self.sensor(muscle_sensor(m, "activation")) for m in self.episode.arm.muscles])

    def readings(self) -> dict[str, float]:
        """Every sensor of the model, the known readings of the task, the commands reached, and the solver's counts.

        Readings of several components have the component's label behind a dot; those that copy a sensor are left to
        the sensor's name. `tracking_error` and `elbow_reaction` are the readings `error` and `reaction`.
        """
        world, tables = self.world, self.world.tables
        found = {name: float(tables.dynamics.y[k]) for name, k in world.names.items()}
        found["time"] = self.episode.world.time
        for reading in self.known_readings():
            if not reading.sensors:
                names = [f"{reading.name}.{label}" if label else reading.name for label in reading.labels]
                found |= dict(zip(names, self(reading.name).tolist(), strict=True))
        found |= {new: found[old] for old, new in OTHER_NAMES.items() if old in found}
        commands = world.drive.commands(world.ecosystem.device)
        found |= {c.name: float(x) for c, x in zip(commands, tables.drive.commands, strict=True)}
        return found | {f"solver.{name}": float(x) for name, x in self.episode.world.stats().as_dict().items()}

    def happened(self) -> str | None:
        """The sentence on what ended the episode, or None."""
        code = int(self.world.tables.status[STATUS.event])
        if code == NOTHING:
            return None
        if code == SOLVER:
            dynamics = self.episode.world
            if dynamics.result is Result.SUCCESS:
                return self.world.task.solver_blamed()
            return f"{dynamics.result.value} Stopped at t = {dynamics.time:.6g} s."
        return self.world.task.event(code, self)

    def not_finite(self) -> str:
        """The sentence on reward terms, readings and observed channels that are not finite."""
        task, tables = self.world.task, self.world.tables
        parts: list[tuple[str, Any]] = [("the reward", tables.task.reward)]
        parts += [(f"reward term '{name}'", x) for name, x in zip(task.terms, tables.task.terms, strict=True)]
        parts += [(f"reading '{r.name}'", self(r.name)) for r in task.readings]
        seen = tables.observer.observation
        parts += [
            (f"observed channel '{s.group}.{s.name}'", seen[s.start : s.stop]) for s in self.world.observer.structure
        ]
        found = [name for name, x in parts if not np.isfinite(x).all()]
        time = self.world.times.item(tables.status.item(STATUS.step))
        return f"At t = {time:.6g} s these are not finite: {', '.join(found)}. The code of the task gives them."

    def start_info(self, movement: Movement) -> dict[str, Any]:
        """The `info` of a reset: patient, load, ability, movement and angle of the start.

        Args:
            movement: names the numbers of the movement.
        """
        draw = self.episode.draw
        return {
            "patient": fields_of(draw.patient.tolist()),
            "load": draw.load,
            "ability": self.episode.need.ability,
            "reference": movement.values(draw.movement),
            # Given in degrees, kept in radians: the way back leaves the last digit.
            "initial_angle_deg": round(math.degrees(draw.start), 10),
        }

    def info(self, weights: dict[str, float], happened: str | None) -> dict[str, Any]:
        """The `info` of a step.

        Args:
            weights: weight of each reward term.
            happened: sentence on what ended the episode, None where nothing has.
        """
        task, tables, status = self.world.task, self.world.tables.task, self.world.tables.status.tolist()
        info: dict[str, Any] = {
            "reward_terms": dict(zip(task.terms, tables.terms.tolist(), strict=True)),
            "reward_weights": weights.copy(),
            "time": self.world.times.item(status[STATUS.step]),
            **{name: factor * tables.readings.item(k) for name, k, factor in task.reported_places},
            "solver_failed": status[STATUS.event] == SOLVER,
        }
        if happened is not None:
            info["event"] = happened
        return info


OTHER_NAMES = {"error": "tracking_error", "reaction": "elbow_reaction"}
"""Names that readings have had since version 0.1."""

"""The long vector that the maps of a control period act on: which number stands where."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exo_env.patient.excitation.effort import PRESENT, TICK
from exo_env.patient.excitation.forward_model import LIMB
from exo_env.patient.patient import PATIENT
from exo_env.world.world import PatientWorld

RINGS = {
    "error": "feedback_delay", "expected": "feedback_delay", "command": "neural_delay", "reflex": "stretch_delay",
    "drive": "electromechanical_delay", "copy": "electromechanical_delay",
}  # fmt: skip
"""Past samples that a patient remembers, and the delay with which each is read."""
PLACES = {"present": (PRESENT.effort,), "limb": (LIMB.moment, LIMB.angle, LIMB.rate)}
"""Places of what changes smoothly in two arrays of a patient's state."""
REMEMBERED = ("present", "active", "fatigued", "limb", *RINGS)
"""Fields of `EffortState` that differ from tick to tick."""
AHEAD, BEHIND = 1, 2
"""Samples on both sides of a delay that are taken to be read: of two signals it counts from the period's begin."""


class Vector:
    """Places of all numbers.

    The state comes first: q, v, where the excitations' ramps began, commands and excitations where theirs end, and what
    the patient remembers. Behind it stand what is worked with, the action, declared numbers and what is read.

    Args:
        world: the world.
        numbers: number of declared numbers.
        read: number of sensors that are read.
    """

    def __init__(self, world: PatientWorld, numbers: int, read: int) -> None:
        tables, n_q, signals = world.tables, world.model.n_q, world.dynamics.state.signals
        effort, patient, drive = tables.patient.effort, tables.patient, tables.drive
        remembered = {name: getattr(effort, name) for name in REMEMBERED}
        self.arrays = {
            "commands": drive.commands, "excitations": patient.excitations, **remembered, "action": drive.action,
            "y": tables.dynamics.y, "felt": patient.felt,
        }  # fmt: skip
        """Arrays of the world whose numbers stand in the vector."""
        n_c, m = len(drive.commands), len(patient.excitations)
        sizes = {"q": n_q, "v": n_q, "excitations_before": m} | {name: x.size for name, x in self.arrays.items()}
        sizes |= {"commands_before": n_c, "numbers": numbers, "read": read}
        ends = np.cumsum([0, *sizes.values()])
        self.at = {name: np.arange(a, b) for name, a, b in zip(sizes, ends[:-1], ends[1:], strict=True)}
        """Places of each part."""
        self._rows = np.full((int(ends[-1]), 2), -1)
        for k, name in enumerate(self.arrays):
            self._rows[self.at[name]] = np.stack([np.full(sizes[name], k), np.arange(sizes[name])], axis=1)
        self.size = int(ends[-1])
        self.state = int(self.at["action"][0])
        """Number of numbers of the state."""
        self.memory = [
            *self.arrays.values(), signals.t, signals.c, patient.ticks, drive.wanted, effort.intents,
            tables.task.readings,
        ]  # fmt: skip
        """All arrays that drive and patient read or change, those of `arrays` first."""

    def rows(self, places: Sequence[np.ndarray]) -> np.ndarray:
        """Field of the memory and place in it of numbers of the vector, shape (n, 2)."""
        return self._rows[np.concatenate(places)]

    def read_by_patient(self, traits: np.ndarray, newest: int) -> list[np.ndarray]:
        """Places of what a tick may read, where `newest` is the place of its samples."""
        at, n = self.at, self.arrays["error"].shape[1]
        found = [at["felt"], at["active"], at["fatigued"], *(at[x][list(k)] for x, k in PLACES.items())]
        for name, delay in RINGS.items():
            whole = int(traits[getattr(PATIENT, delay)] / TICK)
            lags = {min(max(k, 1), n - 1) for k in range(whole - AHEAD, whole + BEHIND + 1)}
            found += [self._samples(name, (newest - lag) % n) for lag in sorted(lags)]
        return found

    def written_by_patient(self, newest: int) -> list[np.ndarray]:
        """Places of what a tick writes."""
        at = self.at
        found = [at["excitations"], at["active"], at["fatigued"], *(at[x][list(k)] for x, k in PLACES.items())]
        return found + [self._samples(name, newest) for name in RINGS]

    def _samples(self, ring: str, place: int) -> np.ndarray:
        """Samples at one place of all signals of a ring."""
        return self.at[ring].reshape(self.arrays[ring].shape)[:, place]

"""One episode over time: what a policy did with a patient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dms_core.renamed import replaced
from exo_env.patient.population import Source, population

from ...environment import ENVIRONMENT
from ...policies.policy import Policy
from .episode import recorded, world_of
from .fair_play import hidden_by
from .measures import measured
from .playing import Playing

READ = (
    "time", "elbow_angle.angle", "reference", "agonist_tension", "antagonist_tension", "muscle_moment", "exo_moment",
    "effort", "load",
)  # fmt: skip


@dataclass(frozen=True)
class TimeCourse:
    """Readings of an episode at control times, without noise."""

    policy: str
    """Title."""
    patient: dict[str, Any]
    load: float | None
    """[kg], None where there is none."""
    columns: dict[str, np.ndarray]
    """Shape (n,) each, by those names of READ that the environment has."""
    event: str | None
    """What ended the episode early."""
    measures: dict[str, float]
    """As of an evaluation (measures.py)."""
    hidden: bool = False
    """Whether the device is not told what the patient wants."""

    @property
    def wanted(self) -> str:
        """What the reference is for the device."""
        return "plan" if self.hidden else "reference"

    @property
    def load_steps(self) -> list[tuple[float, float]]:
        """Times at which the load changes [s], and by how much [kg]."""
        if "load" not in self.columns:
            return []
        changes = np.diff(self.columns["load"])
        return [(float(self.columns["time"][k + 1]), float(changes[k])) for k in np.flatnonzero(changes)]

    @property
    def who(self) -> str:
        """The patient in words."""
        shares = [
            f"{100.0 * self.patient[f'maximum_activation_{muscles}']:.0f} % of the {muscles}"
            for muscles in ("flexors", "extensors")
            if f"maximum_activation_{muscles}" in self.patient
        ]
        load = [] if self.load is None else [f"{self.load:.1f} kg"]
        return "; ".join(([f"commands {', '.join(shares)}"] if shares else []) + load)


def time_course(
    policy: Policy,
    patient: Source,
    seed: int,
    options: dict[str, Any] | None = None,
    environment: str = ENVIRONMENT,
    **settings: Any,
) -> TimeCourse:
    """Run an episode.

    Args:
        policy: that assists.
        patient: population to draw from.
        seed: of the episode.
        options: of the environment's reset.
        environment: its id.
        settings: further ones of the environment.
    """
    env = world_of(policy, population(patient).model_dump(), environment, **settings)
    playing, rows = Playing(env, policy, seed, options), list[Mapping[str, float]]()
    record = recorded(playing, rows.append)
    env.close()
    columns = {name: np.array([row[name] for row in rows]) for name in READ if name in rows[0]}
    about = playing.drawn.get("patient", {}), playing.drawn.get("load")
    return TimeCourse(policy.title, *about, columns, record.event, measured(record), bool(hidden_by(env)))


__getattr__ = replaced(__name__, {"Course": "It is now TimeCourse.", "course": "It is now time_course."})

"""One episode over time: what a policy did with a patient."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.evaluation.evaluate import world_of
from agents.policies.policy import Policy
from exo_env.patient.population import Source, population

READ = (
    "time", "elbow_angle.angle", "reference", "agonist_tension", "antagonist_tension", "muscle_moment", "exo_moment",
    "effort",
)  # fmt: skip


@dataclass(frozen=True)
class Course:
    """Readings of an episode at control times, without noise."""

    policy: str
    """Title."""
    patient: dict[str, Any]
    load: float
    """[kg]."""
    columns: dict[str, np.ndarray]
    """Shape (n,) each, by the names of READ."""
    event: str | None
    """What ended the episode early."""

    @property
    def who(self) -> str:
        """The patient in words."""
        p = self.patient
        flexors, extensors = p["maximum_activation_flexors"], p["maximum_activation_extensors"]
        return f"commands {flexors:.0%} of the flexors, {extensors:.0%} of the extensors; {self.load:.1f} kg"


def course(
    policy: Policy, patient: Source, seed: int, options: dict[str, Any] | None = None, **settings: Any
) -> Course:
    """Run an episode.

    Args:
        policy: that assists.
        patient: population to draw from.
        seed: of the episode.
        options: of the environment's reset.
        settings: further ones of the environment.
    """
    env = world_of(policy, population(patient).model_dump(), **settings)
    world: Any = env.unwrapped
    observation, drawn = env.reset(seed=seed, options=options)
    policy.reset(env)
    info, rows, over = drawn, [world.readings()], False
    while not over:
        observation, _, terminated, truncated, info = env.step(policy(observation, info))
        rows.append(world.readings())
        over = terminated or truncated
    env.close()
    columns = {name: np.array([row[name] for row in rows]) for name in READ}
    return Course(policy.title, drawn["patient"], drawn["load"], columns, info.get("event"))

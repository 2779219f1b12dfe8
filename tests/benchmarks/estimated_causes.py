"""Why the moment of others is not told better: causes of the error taken off one by one.

    python -m tests.benchmarks.estimated_causes --patients 20 --out docs/elbow_causes.csv

The filter of the group `estimated` on what the device measures in exo/HiddenIntent-v0, as in
tests/benchmarks/estimated_group.py, with one thing after another made better than a device has it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

import exo_env  # noqa: F401  (registers the environments)
from agents.policies.reference_free.adaptive_gravity import AdaptiveGravity
from dms_core.files.output_file import write_csv
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.person import Person
from exo_env.estimation.reduced_elbow import ReducedTuning, reduced_elbow
from exo_env.estimation.reduced_filter import (
    BELIEF,
    ESTIMATE,
    FAST,
    LEARNT,
    SLOW,
    begin_estimates,
    step_estimates,
)
from exo_env.patient.population import Population
from tests.benchmarks.estimation import FIRST_SEED, SETTLING, Recording, Score, note

NOISE, HARDLY_ANY = (4.3e-4, 0.02, 0.5), (1e-5, 1e-3, 0.01)
"""Of angle [rad], rate [rad/s] and cuff [N], as the device's sheet says, and of sensors that are nearly perfect."""
FAST_RATE = 200.0
"""Readings that are not seldom any more [Hz]."""


class Cause(NamedTuple):
    """What is made better."""

    name: str
    body: bool = False
    """Whether the filter has the wearer's own forearm."""
    tremor: bool = True
    pick_up: bool = True
    rate: float = 50.0
    noise: bool = True


CAUSES = (
    Cause("as it is"),
    Cause("the wearer's own forearm", body=True),
    Cause("no tremor", tremor=False),
    Cause("nothing is picked up", pick_up=False),
    Cause("sensors without noise", noise=False),
    Cause("200 readings a second", rate=FAST_RATE),
    Cause("own forearm, 200 a second", body=True, rate=FAST_RATE),
    Cause("own forearm, 200 a second, no noise", body=True, rate=FAST_RATE, noise=False),
    Cause("own forearm, no tremor, nothing picked up", body=True, tremor=False, pick_up=False),
    Cause("all of these", True, False, False, FAST_RATE, False),
)


def made(cause: Cause, population: str) -> Any:
    """The environment."""
    patients: Any = population
    if not cause.tremor:
        fields = {"tremor_amplitude": 0.0}
        patients = Population(title=population, base=population, fields=fields).model_dump()
    return gymnasium.make(
        "exo/HiddenIntent-v0", patient=patients, observation=("device", "estimated"), action_mode="assist_moment",
        control_rate=cause.rate, noise=cause.noise, reference=None if cause.pick_up else {"load_changes": 0.0},
        disable_env_checker=True,
    ).unwrapped  # fmt: skip


class Filter:
    """The filter with numbers of its own."""

    def __init__(self, ecosystem: Ecosystem, period: float, cause: Cause, person: Person) -> None:
        tuning = ReducedTuning()
        if cause.body:
            tuning = tuning._replace(inertia_doubt=0.0)
        self.elbow = reduced_elbow(
            ecosystem, period, NOISE if cause.noise else HARDLY_ANY, person if cause.body else None, tuning
        )
        self.belief = (
            np.zeros(len(BELIEF)), np.zeros((FAST, FAST)), np.zeros((SLOW, SLOW)), np.zeros(len(LEARNT)),
        )  # fmt: skip
        self.out, self._begun = np.zeros(len(ESTIMATE)), False

    def take(self, sensed: np.ndarray) -> tuple[float, float]:
        """The moment of others and its deviation behind readings."""
        kernel = step_estimates if self._begun else begin_estimates
        kernel(sensed, *self.elbow, *self.belief, self.out)
        self._begun = True
        return float(self.out[ESTIMATE.others_moment]), float(self.out[ESTIMATE.others_moment_deviation])


def scores(cause: Cause, population: str, first: int, patients: int) -> Score:
    """Errors of a cause over patients."""
    env, found = made(cause, population), Score()
    late = round(SETTLING / env.period)
    for k in range(patients):
        policy, truth, rows, over = AdaptiveGravity(), Recording(), [], False
        observation, _ = env.reset(seed=first + k)
        policy.reset(env)
        own = Filter(env.ecosystem, env.period, cause, env.episode.patient.person)
        while not over:
            observation, _, ended, cut, _ = env.step(policy(observation, {}))
            over = ended or cut
            note(env, observation, truth)
            rows.append(own.take(env.world.tables.estimator.sensed))
        e = np.array(rows)[late:]
        found.add(e[:, 0], np.array(truth.others)[late:], e[:, 1])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=20)
    parser.add_argument("--population", default="evaluation")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = []
    for cause in CAUSES:
        rows.append(scores(cause, given.population, FIRST_SEED, given.patients).row())
        print(cause.name, {k: round(v, 4) for k, v in rows[-1].items()}, flush=True)
    columns = {head: np.array([row[head] for row in rows]) for head in rows[0]}
    write_csv(given.out, {"row": np.arange(1.0, len(rows) + 1.0), **columns})


if __name__ == "__main__":
    main()

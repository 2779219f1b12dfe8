"""Policies on the same patients: every episode measured, every measure with its interval.

A patient may lift several loads. A patient's episodes are no independent sample, so they are averaged before anything
is estimated: intervals tell how much other patients would change the numbers. Between two policies on the same patients
the difference is known better than either (`differences`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dms_core.errors import InputError
from dms_core.validation import shown
from exo_env.patient.ability import ABLE
from exo_env.patient.population import Source, population

from ...environment import ENVIRONMENT, environment_id, hides_plan, patient_seeds
from ...policies.policy import Policy
from ..episodes.episode import episode, world_of
from ..episodes.measures import measures_among
from .by_patient import by_patient, by_training
from .gap import GAP, gaps
from .opponents import opponent_of, oracle_name, with_opponents
from .statistics import CONFIDENCE, RESAMPLES, estimate, interquartile_mean, mean

COMPARED = ("return", "tracking_rms_deg", "device_work_share", "peak_reaction_N")
"""Measures whose differences between policies are estimated, patient by patient."""
VERSION = 2
"""Of what `evaluate` returns, which stands in evaluation.json."""
Case = tuple[int, float | None]
"""Seed of an episode and its load [kg], None for the one that the seed draws."""


@dataclass(frozen=True)
class Plan:
    """What every policy of an evaluation is run on.

    Raises:
        InputError: the population or the environment is unknown, or a number is not usable.
    """

    population: Source
    """By name, YAML file, or what else `patient` of the environment takes."""
    patients: int
    """How many; one episode each, or one a load."""
    seed: int
    """Decides the patients and the bootstrap."""
    loads: tuple[float, ...] = ()
    """Loads that each patient lifts [kg]; one that the seed draws, where none is given."""
    environment: str = ENVIRONMENT
    """Its id, with or without the module that registers it, which other processes then import, too."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Further settings of the environment."""
    id: str = field(init=False)
    """Id under which the environment is registered."""
    title: str = field(init=False)
    """Title of the population."""
    patient: dict[str, Any] = field(init=False)
    """Fields of the population, which other processes can be given."""

    def __post_init__(self) -> None:
        check_numbers(self.patients, self.seed)
        if len(set(self.loads)) < len(self.loads):
            # A load that stands twice would count twice in a patient's mean.
            raise InputError(f"loads = {shown(list(self.loads))}: expected each load once.")
        source = population(self.population)
        object.__setattr__(self, "id", environment_id(self.environment))
        object.__setattr__(self, "title", source.title)
        object.__setattr__(self, "patient", source.model_dump())

    @property
    def cases(self) -> list[Case]:
        """Every patient with every load."""
        return cases_of(self.seed, self.patients, self.loads)


def cases_of(seed: int, patients: int, loads: Sequence[float] = ()) -> list[Case]:
    """Every patient with every load."""
    return [(one, load) for one in patient_seeds(seed, patients) for load in (loads or (None,))]


def evaluate(
    policies: Sequence[Policy],
    patients_of: Source,
    patients: int,
    seed: int,
    *,
    loads: Sequence[float] = (),
    environment: str = ENVIRONMENT,
    progress: Callable[[str], None] | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Run every policy on the same patients, loads and repetitions; see opponents.py for who takes part, too.

    Args:
        policies: to compare.
        patients_of: population by name, YAML file, or what else `patient` of the environment takes.
        patients: how many; one episode each, or one a load.
        seed: of the patients and of the bootstrap.
        loads: that each patient lifts [kg]; one that the seed draws, where none is given.
        environment: its id.
        progress: called with the name of the policy after each episode.
        settings: further ones of the environment.

    Returns:
        JSON-able: what was run, and by policy `episodes`, `summary`, an Estimate of each measure, and `summary_able`,
        the same over the patients who can do something (ability of at least `able`); both with `gap_closed` where the
        task hides the patient's plan.

    Raises:
        InputError: the population or the environment is unknown, or a number is not usable.
    """
    plan = Plan(patients_of, patients, seed, tuple(loads), environment, settings)
    used = with_opponents(policies, environment)
    return results_of(used, [episodes_of(one, plan, plan.cases, progress) for one in used], plan)


def check_numbers(patients: int, seed: int) -> None:
    """Refuses numbers that are too small.

    Raises:
        InputError: names the number.
    """
    for name, value, least in (("patients", patients, 1), ("seed", seed, 0)):
        if value < least:
            raise InputError(f"{name} = {value}: expected a whole number from {least}.")


def episodes_of(
    one: Policy, plan: Plan, cases: Sequence[Case], progress: Callable[[str], None] | None = None
) -> list[dict[str, Any]]:
    """Episodes of a policy, one a case."""
    episodes = []
    for done in each_episode_of(one, plan, cases):
        episodes.append(done)
        if progress is not None:
            progress(one.name)
    return episodes


def each_episode_of(one: Policy, plan: Plan, cases: Sequence[Case]) -> Iterator[dict[str, Any]]:
    """Episodes of a policy as they are done, one a case."""
    env = world_of(one, plan.patient, plan.environment, **plan.settings)
    for number, load in cases:
        yield {"seed": number, **episode(env, one, number, load)}
    env.close()


def results_of(policies: Sequence[Policy], episodes: Sequence[list[dict[str, Any]]], plan: Plan) -> dict[str, Any]:
    """What `evaluate` returns, from the episodes of each policy."""
    by_name: dict[str, Any] = {}
    titles, left = [one.title for one in policies], dict[str, list[str]]()
    for one, those in zip(policies, episodes, strict=True):
        shared = f" ({Path(one.name).name})" if titles.count(one.title) > 1 else ""
        for e in those:
            left |= e.pop("left_out", {})
        by_name[one.name] = {
            "title": one.title + shared, "training": one.training,
            "summary": summary(those, plan.seed),
            "summary_able": summary(able_ones(those), plan.seed, names=those[0]["measures"]),
            "difference": differences(those, episodes[0], plan.seed), "episodes": those,
        }  # fmt: skip
        by_name[one.name] |= {"informed": True} if one.informed else {}
    _add_gaps(policies, by_name, plan)
    return {
        "version": VERSION, "environment": plan.id, "population": plan.title, "patients": plan.patients,
        "loads": list(plan.loads), "seed": plan.seed, "settings": dict(plan.settings),
        "statistic": "interquartile mean", "confidence": CONFIDENCE, "resamples": RESAMPLES, "able": ABLE,
        "left_out": left, "policies": by_name,
    }  # fmt: skip


def _add_gaps(policies: Sequence[Policy], by_name: Mapping[str, Any], plan: Plan) -> None:
    """Add the gap closed to both summaries of each policy whose opponent and oracle took part."""
    if not hides_plan(plan.id):
        return
    oracle, opponents = oracle_name(), {one.name: opponent_of(one) for one in policies}
    # An evaluation that was stopped may lack them.
    known = {name for name, other in opponents.items() if {other, oracle} <= by_name.keys()}
    for kind, kept in (("summary", list), ("summary_able", able_ones)):
        episodes = {name: kept(one["episodes"]) for name, one in by_name.items()}
        if all(episodes.values()):
            for name, gap in gaps(episodes, {n: opponents[n] for n in known}, oracle, plan.seed).items():
                by_name[name][kind][GAP] = gap


def summary(
    episodes: list[dict[str, Any]], seed: int, trainings: int = 1, names: Iterable[str] | None = None
) -> dict[str, dict[str, float]]:
    """Estimate of each measure over the patients, by name.

    Args:
        episodes: of one policy, or of several trainings one after another.
        seed: of the bootstrap.
        trainings: how many.
        names: of the measures; those of the first episode where they are not given.
    """
    estimates = {}
    for m in measures_among(episodes[0]["measures"] if names is None else names):
        values = by_training(episodes, m.name, trainings)
        # A generator for each measure and not for each policy: the same resamples for all policies.
        estimates[m.name] = asdict(
            estimate(values, mean if m.rate else interquartile_mean, np.random.default_rng(seed))
        )
    return estimates


def differences(
    episodes: list[dict[str, Any]], others: list[dict[str, Any]], seed: int, trainings: int = 1
) -> dict[str, dict[str, float]]:
    """Estimates of the mean difference to another policy, patient by patient; `trainings` as in `summary`."""
    estimates = {}
    for name in COMPARED:
        if not all(name in e["measures"] for e in (*episodes, *others)):
            continue
        values = by_training(episodes, name, trainings) - by_patient(others, name)
        estimates[name] = asdict(estimate(values, mean, np.random.default_rng(seed)))
    return estimates


def able_ones(episodes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Episodes of patients who can do something with their load; all where the environment does not say."""
    return [e for e in episodes if e.get("ability", ABLE) >= ABLE]

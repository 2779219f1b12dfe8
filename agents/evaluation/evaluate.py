"""Policies on the same patients: every episode measured, every measure with its interval.

A patient may lift several loads. A patient's episodes are no independent sample, so they are averaged before anything
is estimated: intervals tell how much other patients would change the numbers. Between two policies on the same patients
the difference is known better than either (`differences`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.evaluation.measures import MEASURES, Record, measured
from agents.evaluation.statistics import CONFIDENCE, RESAMPLES, estimate, interquartile_mean, mean
from agents.policies.policy import Policy
from dms_core.errors import InputError
from exo_env.patient.ability import ABLE
from exo_env.patient.population import Source, population

ENVIRONMENT = "exo_env:exo/ElbowLift-v0"
COMPARED = ("return", "tracking_rms_deg", "device_work_share", "peak_reaction_N")
"""Measures whose differences between policies are estimated, patient by patient."""
Case = tuple[int, float | None]
"""Seed of an episode and its load [kg], None for the one that the seed draws."""


def patient_seeds(seed: int, patients: int) -> list[int]:
    """Seeds of the episodes; more patients keep those of fewer."""
    return [int(x) for x in np.random.SeedSequence(seed).generate_state(patients)]


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
    progress: Callable[[str], None] | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Run every policy on the same patients, loads and repetitions.

    Args:
        policies: to compare.
        patients_of: population by name, YAML file, or what else `patient` of the environment takes.
        patients: how many; one episode each, or one a load.
        seed: of the patients and of the bootstrap.
        loads: that each patient lifts [kg]; one that the seed draws, where none is given.
        progress: called with the name of the policy after each episode.
        settings: further ones of the environment.

    Returns:
        JSON-able: what was run, and by policy `episodes`, `summary`, an Estimate of each measure, and `summary_able`,
        the same over the patients who can do something (ability of at least `able`).

    Raises:
        InputError: the population is unknown, or a number is not usable.
    """
    check_numbers(patients, seed)
    source, cases = population(patients_of), cases_of(seed, patients, loads)
    episodes = [episodes_of(one, source.model_dump(), cases, settings, progress) for one in policies]
    return results_of(policies, episodes, source.title, patients, seed, loads, settings)


def world_of(policy: Policy, patient: Source, **settings: Any) -> gymnasium.Env:
    """The environment that a policy acts in; `settings`: further ones of it."""
    return gymnasium.make(
        ENVIRONMENT, disable_env_checker=True, patient=patient, action_mode=policy.action_mode,
        observation=list(policy.observation), **settings,
    )  # fmt: skip


def check_numbers(patients: int, seed: int) -> None:
    """Refuses numbers that are too small.

    Raises:
        InputError: names the number.
    """
    for name, value, least in (("patients", patients, 1), ("seed", seed, 0)):
        if value < least:
            raise InputError(f"{name} = {value}; a whole number from {least} is wanted.")


def episodes_of(
    one: Policy,
    patient: dict[str, Any],
    cases: Sequence[Case],
    settings: dict[str, Any],
    progress: Callable[[str], None] | None = None,
) -> list[dict[str, Any]]:
    """Episodes of a policy, one a case."""
    env, found = world_of(one, patient, **settings), []
    for number, load in cases:
        found.append({"seed": number, **episode(env, one, number, load)})
        if progress is not None:
            progress(one.name)
    env.close()
    return found


def results_of(
    policies: Sequence[Policy], episodes: Sequence[list[dict[str, Any]]], title: str, patients: int, seed: int,
    loads: Sequence[float] = (), settings: Mapping[str, Any] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """What `evaluate` returns, from the episodes of each policy."""
    found: dict[str, Any] = {}
    titles = [one.title for one in policies]
    for one, those in zip(policies, episodes, strict=True):
        shared = f" ({Path(one.name).name})" if titles.count(one.title) > 1 else ""
        found[one.name] = {
            "title": one.title + shared, "training": one.training,
            "summary": summary(those, seed), "summary_able": summary(able_ones(those), seed),
            "difference": differences(those, episodes[0], seed), "episodes": those,
        }  # fmt: skip
    return {
        "population": title, "patients": patients, "loads": list(loads), "seed": seed, "settings": dict(settings or {}),
        "statistic": "interquartile mean", "confidence": CONFIDENCE, "resamples": RESAMPLES, "able": ABLE,
        "policies": found,
    }  # fmt: skip


def episode(env: gymnasium.Env, acting: Policy, seed: int, load: float | None = None) -> dict[str, Any]:
    """Measures of one episode, with load, repetition and what ended it; `load` [kg] in place of the one drawn."""
    world: Any = env.unwrapped
    observation, drawn = env.reset(seed=seed, options=None if load is None else {"load": load})
    info = drawn
    acting.reset(env)
    record = Record(world.episode.repetition, world.period)
    record.add(world.readings())
    over = False
    while not over:
        observation, reward, terminated, truncated, info = env.step(acting(observation, info))
        record.rewards.append(float(reward))
        record.add(world.readings())
        over = terminated or truncated
    record.event = info.get("event")
    return {
        **{k: drawn[k] for k in ("load", "ability", "reference", "patient")},
        "event": record.event,
        "measures": measured(record),
    }


def summary(episodes: list[dict[str, Any]], seed: int, trainings: int = 1) -> dict[str, dict[str, float]]:
    """Estimate of each measure over the patients, by name.

    Args:
        episodes: of one policy, or of several trainings one after another.
        seed: of the bootstrap.
        trainings: how many.
    """
    found = {}
    for m in MEASURES:
        values = by_training(episodes, m.name, trainings)
        # A generator for each measure and not for each policy: the same resamples for all policies.
        found[m.name] = asdict(estimate(values, mean if m.rate else interquartile_mean, np.random.default_rng(seed)))
    return found


def by_patient(episodes: list[dict[str, Any]], measure: str) -> np.ndarray:
    """Mean of a measure over the episodes of each patient, shape (n,); NaN where it could not be measured."""
    values: dict[int, list[float | None]] = {}
    for e in episodes:
        values.setdefault(e["seed"], []).append(e["measures"][measure])
    return np.array([np.mean([x for x in v if x is not None and np.isfinite(x)] or [np.nan]) for v in values.values()])


def by_training(episodes: list[dict[str, Any]], measure: str, trainings: int) -> np.ndarray:
    """`by_patient` of each training, shape (trainings, n)."""
    n = len(episodes) // trainings
    return np.array([by_patient(episodes[k * n : (k + 1) * n], measure) for k in range(trainings)])


def differences(
    episodes: list[dict[str, Any]], others: list[dict[str, Any]], seed: int, trainings: int = 1
) -> dict[str, dict[str, float]]:
    """Estimates of the mean difference to another policy, patient by patient; `trainings` as in `summary`."""
    found = {}
    for name in COMPARED:
        values = by_training(episodes, name, trainings) - by_patient(others, name)
        found[name] = asdict(estimate(values, mean, np.random.default_rng(seed)))
    return found


def able_ones(episodes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Episodes of patients who can do something with their load."""
    return [e for e in episodes if e["ability"] >= ABLE]

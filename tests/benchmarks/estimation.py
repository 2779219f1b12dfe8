"""What a worn device can know of an elbow from its own sensors: the table of docs/elbow-estimation.md.

    python -m tests.benchmarks.estimation --patients 50 --out docs/elbow_estimation.csv

Patients of `evaluation` do exo/HiddenIntent-v0 in a device that adaptive gravity compensation commands. The filter
(`exo_env/estimation`) sees channels of the observation with their noise. Its body is one of average size for everyone,
its steps are of a fixed size, and neither muscles nor machine are in it; no moment arm of a rope is.

True moment that all but the device put on the elbow: I theta'' - axis . (p x F) with the true forearm's inertia I about
the elbow axis and the guide's force F at p. True moment of the muscles: the model's own sensor.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from pathlib import Path

import gymnasium
import numpy as np

import exo_env  # noqa: F401  (registers the environments)
from agents.policies.reference_free.adaptive_gravity import AdaptiveGravity
from agents.policies.reference_free.known import ANGLES, Known
from dms_core.files.output_file import write_csv
from exo_env.ecosystem.person import Person
from exo_env.estimation import ElbowEstimator, NominalElbow
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, GYRO, RATE, SPECIFIC_FORCE
from exo_env.estimation.reduced_elbow import USUAL_LOAD

FIRST_SEED = 30_000
"""Of the episodes; no number of the filter was chosen on these."""
SETTLING = 0.5
"""Part of an episode that is left out, in which the filter finds its start [s]."""
CELL = 0.3
"""Noise of the moment of a load cell at the grip: 1 N at 0.3 m [Nm]."""
TYPED_IN = 0.9
"""Inertia of the nominal forearm over the true one where weight, height and sex of the wearer are typed in."""
CELL_TIME = 0.03
"""Low-pass of its reading [s]."""


@dataclass
class Recording:
    """One episode."""

    readings: list[dict[str, float]] = field(default_factory=list)
    others: list[float] = field(default_factory=list)
    """True moments of all but the device [Nm]."""
    muscles: list[float] = field(default_factory=list)
    weight: list[float] = field(default_factory=list)
    """Moment of the forearm's own weight."""
    angle: list[float] = field(default_factory=list)
    load: list[float] = field(default_factory=list)
    """Weight held [kg]."""
    person: Person = Person()


def channels(env, observation: np.ndarray) -> dict[str, float]:  # noqa: ANN001
    """Readings of the filter from an observation, in SI units."""
    found: dict[str, float] = {}
    names = {"angle": [ANGLE], "rate": [RATE], "guide_force": [GUIDE_FORCE], "gyro": [GYRO],
             "specific_force": list(SPECIFIC_FORCE)}  # fmt: skip
    for part in env.observation_structure:
        for k, name in enumerate(names.get(part.name, [])):
            found[name] = float(observation[part.start + k] * part.scale)
    return found


def note(env, observation: np.ndarray, into: Recording) -> None:  # noqa: ANN001
    """The present readings and the present truth."""
    episode, names = env.episode, env.world.names
    y, arm = env.world.tables.dynamics.y, episode.arm
    segment, axis = arm.segments["forearm"], arm.axis
    centre = segment.centre_of_mass
    across = centre - axis * (axis @ centre)
    inertia = axis @ np.diag(segment.inertia) @ axis + segment.mass * across @ across
    angle = y[names["elbow_angle.angle"]]
    F, M = (np.array([y[names[f"guide_force.{c}{x}"]] for x in "xyz"]) for c in "FM")
    R = arm.rotation(angle)
    guide = axis @ (np.cross(R @ episode.worn.guided_point, F) + M)
    into.readings.append(channels(env, observation))
    into.others.append(float(inertia * y[names["elbow_angle.acceleration"]] - guide))
    into.muscles.append(float(y[names["muscle_moment"]]))
    into.weight.append(float(axis @ np.cross(R @ centre, segment.mass * np.array(arm.gravity))))
    into.angle.append(float(angle))
    into.load.append(float(env.world.tables.plan.loads[env.world.tables.status[0]]))


def recorded(env, seed: int) -> Recording:  # noqa: ANN001
    """One episode with the policy."""
    policy, found = AdaptiveGravity(), Recording()
    observation, _ = env.reset(seed=seed)
    policy.reset(env)
    found.person = env.episode.patient.person
    note(env, observation, found)
    over = False
    while not over:
        observation, _, ended, cut, _ = env.step(policy(observation, {}))
        over = ended or cut
        note(env, observation, found)
    return found


def estimated(estimator: ElbowEstimator, found: Recording) -> np.ndarray:
    """Moment of all others and its deviation at each time, shape (k, 2)."""
    rows = [estimator.reset(found.readings[0])] + [estimator.update(x) for x in found.readings[1:]]
    return np.array([(row.others, row.deviation) for row in rows])


def smoothed(x: np.ndarray, period: float) -> np.ndarray:
    """Low-pass of the first order, as a device would run it."""
    y, share = x.copy(), 1.0 - np.exp(-period / CELL_TIME)
    for k in range(1, len(x)):
        y[k] = y[k - 1] + share * (x[k] - y[k - 1])
    return y


def of_muscles(others: np.ndarray, found: Recording, known: Known, rng: np.random.Generator, period: float) -> dict:
    """The muscles' moment by what is known beside the device's sensors, each as (estimate, name)."""
    angle = np.array([x[ANGLE] for x in found.readings])
    own, kilogram = (np.interp(angle, ANGLES, table) for table in (known.own - known.link, known.kilogram))
    true_others, muscles, weight = (np.array(x) for x in (found.others, found.muscles, found.weight))
    hand = true_others - muscles - weight
    cell = smoothed(hand + CELL * rng.normal(size=len(hand)), period)
    handle_too = np.array(found.load) * kilogram
    return {
        "device, a usual load": others + own + USUAL_LOAD * kilogram,
        "device + known load": others + own + handle_too,
        "device + load cell": others + _weight_of(known, angle) - cell,
    }


def _weight_of(known: Known, angle: np.ndarray) -> np.ndarray:
    """Moment that holds the nominal forearm alone, without the handle."""
    arm = known.ecosystem.arm()
    segment, gravity = arm.segments["forearm"], np.array(arm.gravity)
    table = [-arm.axis @ np.cross(arm.rotation(x) @ segment.centre_of_mass, segment.mass * gravity) for x in ANGLES]
    return np.interp(angle, ANGLES, table)


class Score:
    """Errors of one quantity over patients."""

    def __init__(self) -> None:
        self.errors: list[np.ndarray] = []
        self.truth: list[np.ndarray] = []
        self.within: list[np.ndarray] = []

    def add(self, estimate: np.ndarray, truth: np.ndarray, deviation: np.ndarray | None = None) -> None:
        self.errors.append(estimate - truth)
        self.truth.append(truth)
        if deviation is not None:
            self.within.append(np.abs(estimate - truth) < 1.959964 * deviation)

    def row(self) -> dict[str, float]:
        """Pooled error over pooled size, median over patients, coverage."""
        each = [np.sqrt(np.mean(e**2) / np.mean(t**2)) for e, t in zip(self.errors, self.truth, strict=True)]
        e, t = np.concatenate(self.errors), np.concatenate(self.truth)
        inside = float(np.mean(np.concatenate(self.within))) if self.within else np.nan
        return {
            "patients": len(each), "rms_Nm": float(np.sqrt(np.mean(t**2))), "error_Nm": float(np.sqrt(np.mean(e**2))),
            "error_over_rms": float(np.sqrt(np.mean(e**2) / np.mean(t**2))),
            "median_of_patients": float(np.median(each)), "coverage_95": inside,
        }  # fmt: skip


def typed_in(person: Person) -> Person:
    """The wearer as the device is told, with a forearm whose mass and inertia are still off."""
    return Person(body_mass=TYPED_IN * person.body_mass, height=person.height, sex=person.sex)


def study(population: str, first: int, patients: int, rate: float) -> tuple[dict[str, Score], int]:
    """Scores by what is known, and how often a filter began anew."""
    env = gymnasium.make(
        "exo/HiddenIntent-v0", patient=population, observation=("device", "imu"), control_rate=rate,
        disable_env_checker=True,
    ).unwrapped  # fmt: skip
    usual = NominalElbow()
    average, moving = (ElbowEstimator(usual, 1.0 / rate, imu=imu) for imu in (False, True))
    known, rng, lost = Known(env.ecosystem), np.random.default_rng(first), 0
    scores: dict[str, Score] = {}
    late = round(SETTLING * rate)
    for k in range(patients):
        found = recorded(env, first + k)
        others, muscles = np.array(found.others)[late:], np.array(found.muscles)[late:]
        fitted = ElbowEstimator(
            usual.changed(person=typed_in(found.person).model_dump(), inertia_doubt=1.0 - TYPED_IN),
            1.0 / rate,
            like=average,
        )
        estimates = {"device": average, "device + imu": moving, "device + weight and height": fitted}
        for name, estimator in estimates.items():
            e = estimated(estimator, found)
            scores.setdefault(f"all others: {name}", Score()).add(e[late:, 0], others, e[late:, 1])
            if estimator is average:
                for row, x in of_muscles(e[:, 0], found, known, rng, 1.0 / rate).items():
                    scores.setdefault(f"muscles: {row}", Score()).add(x[late:], muscles)
        lost += fitted.lost
        said = [f"{np.sqrt(np.mean(x.errors[-1] ** 2) / np.mean(x.truth[-1] ** 2)):.3f}" for x in scores.values()]
        print(f"patient {k + 1}: {' '.join(said)}, rms {np.sqrt(np.mean(others**2)):.3f} Nm", flush=True)
    return scores, lost + average.lost + moving.lost


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=50)
    parser.add_argument("--population", default="evaluation")
    parser.add_argument("--seed", type=int, default=FIRST_SEED)
    parser.add_argument("--rate", type=float, default=1000.0, help="of the device's sensors [Hz]")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    scores, lost = study(given.population, given.seed, given.patients, given.rate)
    rows = {name: score.row() for name, score in scores.items()}
    for name, row in rows.items():
        print(name, {k: round(v, 4) for k, v in row.items()})
    print(f"filters that began anew: {lost}")
    heads = next(iter(rows.values())).keys()
    write_csv(
        given.out,
        {"row": np.arange(1.0, len(rows) + 1.0), **{h: np.array([r[h] for r in rows.values()]) for h in heads}},
    )


if __name__ == "__main__":
    main()

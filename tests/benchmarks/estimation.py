"""What a worn device can know of an elbow from its own sensors: the table of docs/elbow-estimation.md.

    python -m tests.benchmarks.estimation --patients 50 --out docs/elbow_estimation.csv

Patients of `evaluation` do exo/HiddenIntent-v0 in a device that the best tuned classical policy commands. The filter
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
from exo_env.estimation import ElbowEstimator, NominalElbow
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, GYRO, RATE, SPECIFIC_FORCE

FIRST_SEED = 20_000
"""Of the episodes; nothing was tuned on these, nor on this population."""
SETTLING = 0.5
"""Part of an episode that is left out, in which the filter finds its start [s]."""
USUAL_LOAD = 1.25
"""Weight that stands for an unknown one: the mean of what is drawn [kg]."""
CELL = 0.3
"""Noise of the moment of a load cell at the grip: 1 N at 0.3 m [Nm]."""
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


def study(population: str, first: int, patients: int, rate: float, imu: bool) -> tuple[dict[str, Score], int]:
    """Scores by what is known, and how often a filter began anew."""
    groups = ("device", "imu") if imu else ("device",)
    env = gymnasium.make(
        "exo/HiddenIntent-v0", patient=population, observation=groups, control_rate=rate, disable_env_checker=True
    ).unwrapped
    estimator = ElbowEstimator(NominalElbow(), 1.0 / rate, imu=imu)
    known, rng = Known(env.ecosystem), np.random.default_rng(first)
    scores: dict[str, Score] = {}
    late = round(SETTLING * rate)
    for k in range(patients):
        found = recorded(env, first + k)
        estimate = estimated(estimator, found)
        name = "all others: device + imu" if imu else "all others: device"
        scores.setdefault(name, Score()).add(
            estimate[late:, 0], np.array(found.others)[late:], estimate[late:, 1]
        )  # fmt: skip
        if not imu:
            for name, x in of_muscles(estimate[:, 0], found, known, rng, 1.0 / rate).items():
                scores.setdefault(f"muscles: {name}", Score()).add(x[late:], np.array(found.muscles)[late:])
        first_score = next(iter(scores.values()))
        pooled, e, t = first_score.row(), first_score.errors[-1], first_score.truth[-1]
        print(
            f"{k + 1} patients: {pooled['error_over_rms']:.4f}, coverage {pooled['coverage_95']:.4f}; this one: error "
            f"{np.sqrt(np.mean(e**2)):.4f} Nm, mean {np.mean(e):.4f}, rms {np.sqrt(np.mean(t**2)):.4f} Nm", flush=True
        )  # fmt: skip
    return scores, estimator.lost


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=50)
    parser.add_argument("--population", default="evaluation")
    parser.add_argument("--seed", type=int, default=FIRST_SEED)
    parser.add_argument("--rate", type=float, default=200.0, help="of the device's sensors [Hz]")
    parser.add_argument("--imu", action="store_true")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    scores, lost = study(given.population, given.seed, given.patients, given.rate, given.imu)
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

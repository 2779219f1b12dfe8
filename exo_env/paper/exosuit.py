"""The elbow exosuit study, repeated in simulation: what gravity compensation leaves a healthy wearer to do.

Xiloyannis, Chiaradia, Frisoli and Masia (2019, J. NeuroEng. Rehabil. 16:29): eight healthy people flex and extend the
elbow along a shown reference with peak rates of 42, 84 and 126 deg/s, in a soft suit that compensates for gravity, and
with the suit unpowered. Powered, the biological torque (what total torque the suit does not give, its mean size over
the total torque unpowered) changes by -59.20 +- 5.58 %, the muscular effort by -64.8 +- 7.66 % (means over the people
and rates, and standard errors), and the arm lags 0.2 s more behind the reference.

Here eight people of a population do minimum-jerk moves between 25 and 85 deg on the gym machine with its lightest
weight; the device gives the moment that holds arm, handle, weight and its own link at the angle that was measured some
time before, as far as a rope can. Biological torque is that of the muscles; effort is the activation of the biceps, of
which the study took the electromyogram. The second half of each trial counts, when effort has settled.

    python -m exo_env.paper.exosuit > docs/exosuit.csv
"""

from __future__ import annotations

import csv
import sys
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from tqdm import tqdm

from exo_env.ecosystem.exoskeleton import rope_lever
from exo_env.ecosystem.sensors import muscle_sensor
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.patient.excitation.motor_command import InternalModel

PEAK_RATES = (42.0, 84.0, 126.0)
"""Largest rates of the moves [deg/s]."""
PUBLISHED = {"torque": (-0.592, 0.0558), "effort": (-0.648, 0.0766)}
"""Mean and standard error of the changes [-]."""
SUIT_LAG = 0.2
"""By which the arm lags more with the suit than without [s]; here, the lag of the compensation."""
PEOPLE = 8
START, AMPLITUDE = 25.0, 60.0
"""Where the moves begin, and how far they go [deg]; assumed, within the leverage of the simulated muscles."""
PAUSE, REPETITIONS = 0.5, 8
"""Time at both ends [s], and moves there and back; assumed."""
PEAK_OVER_MEAN = 1.875
"""Largest over mean rate of a minimum-jerk move."""
LIGHTEST = 0.05
"""Weight on the machine [kg]: the study's people held none."""
BICEPS = ("BIClong", "BICshort")
LONGEST_LAG = 0.8
"""Longest lag behind the reference that is looked for [s]."""


@dataclass(frozen=True)
class Trial:
    """One person at one rate, the second half."""

    torque: float
    """Mean size of the moment of the muscles [Nm]."""
    effort: float
    """Mean activation of the biceps [-]."""
    lag: float
    """Time by which the arm lags behind the reference [s]."""


@dataclass
class Wearers:
    """People of a population who do the trials; their trials without help are done once.

    Args:
        population: whoever wears the device.
        people: how many.
        repetitions: moves there and back in a trial.
        rates: peak rates [deg/s].
    """

    population: str = "healthy"
    people: int = PEOPLE
    repetitions: int = REPETITIONS
    rates: Sequence[float] = PEAK_RATES
    _alone: dict[tuple[int, float], Trial] = field(default_factory=dict)

    def compared(self, lag: float, share: float = 1.0) -> dict[str, float]:
        """A row of the table: changes by a compensation [-], and the lag of the arm without and with it [s].

        Args:
            lag: by which the compensation is late [s].
            share: part of gravity's moment that it gives [-].
        """
        changes, lags = np.zeros((2, self.people, len(self.rates))), np.zeros((2, self.people, len(self.rates)))
        for person in range(self.people):
            for k, rate in enumerate(self.rates):
                if (person, rate) not in self._alone:
                    self._alone[person, rate] = self.trial(person, rate, 0.0, 0.0)
                alone, helped = self._alone[person, rate], self.trial(person, rate, lag, share)
                changes[:, person, k] = helped.torque / alone.torque - 1.0, helped.effort / alone.effort - 1.0
                lags[:, person, k] = alone.lag, helped.lag
        row = {"lag_s": lag, "share": share, "lag_alone_s": lags[0].mean(), "lag_helped_s": lags[1].mean()}
        for what, values in zip(PUBLISHED, changes, strict=True):
            row[what] = values.mean()
            row[f"{what}_standard_error"] = values.mean(axis=1).std(ddof=1) / np.sqrt(self.people)
            row |= {f"{what}_{rate:g}_deg_s": x for rate, x in zip(self.rates, values.mean(axis=0), strict=True)}
        return {name: float(x) for name, x in row.items()}

    def trial(self, person: int, rate: float, lag: float, share: float) -> Trial:
        """One person at one peak rate [deg/s], with a share of gravity's moment as of some time [s] ago."""
        move = PEAK_OVER_MEAN * AMPLITUDE / rate
        reference = {"start_deg": START, "amplitude_deg": AMPLITUDE, "rest": PAUSE, "duration": move, "pause": PAUSE}
        with warnings.catch_warnings():
            # That an episode takes whole control periods.
            warnings.simplefilter("ignore")
            env = ElbowLiftEnv(
                patient=self.population, load=LIGHTEST, noise=False, repetitions=self.repetitions, reference=reference,
                episode_duration=(2.0 * (move + PAUSE) + 0.1) * self.repetitions,
            )  # fmt: skip
        env.reset(seed=person, options={"initial_angle_deg": START})
        known = InternalModel.of(env.episode.arm, env.world.machine, env.episode.load)
        angles, moments, activations = [env.readings()["elbow_angle.angle"]], [0.0], [0.0]
        for _ in range(env.steps):
            felt = angles[max(len(angles) - 1 - round(lag / env.period), 0)]
            *_, terminated, _, info = env.step(compensation(env, known, angles[-1], felt, share))
            if terminated:
                raise RuntimeError(f"person {person} at {rate:g} deg/s: {info['event']}")
            readings = env.readings()
            angles.append(readings["elbow_angle.angle"])
            moments.append(abs(readings["muscle_moment"]))
            activations.append(float(np.mean([readings[muscle_sensor(m, "activation")] for m in BICEPS])))
        half = len(angles) // 2
        behind = lag_behind(env.episode.course[:, 0], np.array(angles), half, env.period)
        return Trial(float(np.mean(moments[half:])), float(np.mean(activations[half:])), behind)


def compensation(env: ElbowLiftEnv, known: InternalModel, angle: float, felt: float, share: float) -> np.ndarray:
    """Action that gives a share of the moment that holds arm, load and link at rest at the angle `felt` [rad]."""
    device, drive = env.ecosystem.device, env.world.tables.drive
    gravity = float(np.linalg.norm(known.load.gravity))
    moment = share * (known.resting_moment(felt) + device.own_moment(felt, gravity))
    rope = device.ropes[device.lifting_rope]
    tension = max(moment / rope_lever(np.array(rope.upper), np.array(rope.lower), angle), 0.0)
    tensions = np.array([tension if name == device.lifting_rope else 0.0 for name in device.ropes])
    return np.clip((tensions - drive.numbers[:, 0]) / drive.numbers[:, 1], -1.0, 1.0)


def lag_behind(reference: np.ndarray, angle: np.ndarray, first: int, period: float) -> float:
    """Delay of the reference that is nearest to the angle in the mean square, from sample `first` on [s]."""
    most = min(round(LONGEST_LAG / period), first)
    apart = [np.mean((angle[first:] - reference[first - k : len(reference) - k]) ** 2) for k in range(most + 1)]
    return float(np.argmin(apart)) * period


def table(rows: Iterable[tuple[float, float]], wearers: Wearers) -> list[dict[str, float]]:
    """Rows of the table, for lags [s] and shares [-]."""
    return [wearers.compared(lag, share) for lag, share in rows]


def main() -> None:
    """Write the table: compensation without any lag, with the suit's, and what else was tried."""
    tried = [(0.0, 1.0), (SUIT_LAG, 1.0), (0.1, 1.0), (0.3, 1.0), (0.4, 1.0), (0.0, 0.8), (SUIT_LAG, 0.8)]
    found = table(tqdm(tried, unit="row", disable=None), Wearers())
    writer = csv.DictWriter(sys.stdout, found[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: f"{x:.4g}" for name, x in row.items()} for row in found)


if __name__ == "__main__":
    main()

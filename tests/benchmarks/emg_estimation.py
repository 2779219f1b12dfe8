"""What a worn device can know of an elbow with electrodes: the EMG rows of docs/elbow-estimation.md.

    python -m tests.benchmarks.emg_estimation --patients 50 --out docs/elbow_emg.csv

Patients, policy and seeds are those of tests/benchmarks/estimation.py. The filter (`exo_env/estimation`) has the six
muscles of an average man, their attachments 5 % too far out. Electrodes are 20 ms late, so that the filter works on
readings of 20 ms ago and its estimates are compared with what was true then.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

import exo_env  # noqa: F401  (registers the environments)
from agents.policies.reference_free.adaptive_gravity import AdaptiveGravity
from dms_core.files.output_file import write_csv
from exo_env.ecosystem.person import Person
from exo_env.estimation.muscle_elbow import MuscleElbow
from exo_env.estimation.muscle_estimator import CELL, Known, MuscleEstimator, MuscleTuning, emg_channel
from tests.benchmarks.estimation import FIRST_SEED, Recording, note

SETTLING = 1.0
"""Part of an episode that is left out, in which the filter finds its start [s]."""
DELAY = 0.02
"""Of the electrodes [s]."""
CELL_NOISE = 1.0
"""Of the load cell between handle and rope [N]."""
QUIET = 0.002
"""Noise that is believed of electrodes without any [-]."""
FIRST_REPETITION = 3.0
"""Time behind which the load is judged [s]."""
CALIBRATED = {"gain_deviation": 1e-9, "crosstalk": 0.0, "dropping": 1e-9}
"""Electrodes without faults."""


@dataclass
class MuscleRecording(Recording):
    """One episode with what muscles do."""

    emg: list[np.ndarray] = field(default_factory=list)
    activations: list[np.ndarray] = field(default_factory=list)
    forces: list[np.ndarray] = field(default_factory=list)
    tension: list[float] = field(default_factory=list)
    """Of the rope at the handle [N]."""
    strength: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Largest force of each muscle [N]."""


class Row(NamedTuple):
    """What a filter reads and is told."""

    name: str
    electrodes: str = "calibrated"
    cell: bool = False
    load: bool = False
    strength: bool = False
    body: bool = False
    arms: bool = False
    """Whether body and moment arms are the wearer's."""
    late: bool = True
    noise: bool = True
    """Whether electrodes have noise."""


ROWS = (
    Row("device + EMG"),
    Row("device + EMG, gain errors", "faulty"),
    Row("device + EMG + load cell", cell=True),
    Row("device + EMG + known load", load=True),
    Row("device + EMG + known load and strength", load=True, strength=True),
)
CAUSES = (
    Row("EMG, and the wearer's strength", strength=True),
    Row("EMG, and the wearer's body", body=True),
    Row("EMG, and true moment arms", arms=True),
    Row("EMG, and no delay", late=False),
    Row("EMG, and all of these", strength=True, body=True, arms=True, late=False),
    Row("known load and strength, and the wearer's body", load=True, strength=True, body=True),
    Row("known load and strength, and true moment arms", load=True, strength=True, arms=True),
    Row("known load and strength, and no delay", load=True, strength=True, late=False),
    Row("known load and strength, and all of these", load=True, strength=True, body=True, arms=True, late=False),
    Row("the same, and electrodes without noise", "calibrated", False, True, True, True, True, False, False),
)


def made(row: Row, population: str, rate: float) -> Any:
    """The environment."""
    noise = True if row.late and row.noise else {"emg": {"deviation": 0.03 if row.noise else 0.0}}
    return gymnasium.make(
        "exo/HiddenIntent-v0", patient=population, observation=("device", "imu", "emg"), control_rate=rate,
        electrodes=CALIBRATED if row.electrodes == "calibrated" else None, noise=noise, disable_env_checker=True,
    ).unwrapped  # fmt: skip


def kind_of(row: Row) -> tuple[str, bool, bool]:
    """What rows of one environment have in common."""
    return row.electrodes, row.late, row.noise


def recorded(env: Any, seed: int) -> MuscleRecording:
    """One episode with the policy."""
    policy, found = AdaptiveGravity(), MuscleRecording()
    observation, _ = env.reset(seed=seed)
    policy.reset(env)
    found.person, arm = env.episode.patient.person, env.episode.arm
    found.strength = np.array([arm.muscle(m).max_isometric_force for m in arm.muscles])
    place = next(x for x in env.observation_structure if x.name == "emg")
    over = False
    while True:
        note(env, observation, found)
        found.emg.append(np.array(observation[place.start : place.stop], float) * place.scale)
        found.activations.append(env.readout.activations)
        found.forces.append(env.readout("muscle_force"))
        found.tension.append(env.readout.sensor(CELL))
        if over:
            return found
        observation, _, ended, cut, _ = env.step(policy(observation, {}))
        over = ended or cut


def readings(found: MuscleRecording, row: Row, muscles: tuple[str, ...], lag: int, seed: int) -> Iterator[dict]:
    """Readings of the filter at each time."""
    rng = np.random.default_rng(seed)
    for k in range(len(found.readings) - lag):
        y = {name: x for name, x in found.readings[k].items()}
        y |= {emg_channel(m): float(x) for m, x in zip(muscles, found.emg[k + lag], strict=True)}
        if row.cell:
            y[CELL] = found.tension[k] + CELL_NOISE * rng.normal()
        yield y


class Judged:
    """Errors of a row over patients."""

    def __init__(self) -> None:
        self.parts: list[dict[str, Any]] = []

    def add(self, found: MuscleRecording, estimates: list, period: float) -> None:
        """Those of one episode."""
        late, n = round(SETTLING / period), len(estimates)
        a = np.array([e.activations for e in estimates]) - np.array(found.activations[:n])
        T = np.array(found.forces[:n])
        f, s = np.array([e.forces for e in estimates]) - T, np.array([e.force_deviations for e in estimates])
        M = np.array(found.muscles[:n])
        m = np.array([e.moment for e in estimates]) - M
        ms = np.array([e.moment_deviation for e in estimates])
        load = np.array([e.load for e in estimates]) - np.array(found.load[:n])
        ls = np.array([e.load_deviation for e in estimates])
        first = min(round(FIRST_REPETITION / period), n - 1)
        self.parts.append({
            "activation": a[late:], "force": f[late:], "true_force": T[late:], "moment": m[late:], "true": M[late:],
            "load": load[late:], "first_load": load[first], "within_force": np.abs(f[late:]) < 1.96 * s[late:],
            "within_moment": np.abs(m[late:]) < 1.96 * ms[late:], "within_load": np.abs(load[late:]) < 1.96 * ls[late:],
        })  # fmt: skip

    def _all(self, name: str) -> np.ndarray:
        return np.concatenate([p[name] for p in self.parts])

    def row(self) -> dict[str, float]:
        """Root mean squares over all patients."""

        def rms(x: np.ndarray) -> float:
            return float(np.sqrt(np.mean(np.square(x))))

        f, T = self._all("force"), self._all("true_force")
        each = np.sqrt(np.mean(f**2, axis=0) / np.mean(T**2, axis=0))
        own = [rms(p["moment"]) / rms(p["true"]) for p in self.parts]
        first = np.array([p["first_load"] for p in self.parts])
        return {
            "patients": len(self.parts), "activation": rms(self._all("activation")), "force_N": rms(f),
            "force_over_rms": rms(f) / rms(T), "force_best_muscle": float(each.min()),
            "force_worst_muscle": float(each.max()), "force_coverage": float(np.mean(self._all("within_force"))),
            "load_kg": rms(self._all("load")), "load_at_3_s_kg": rms(first),
            "load_at_3_s_median_kg": float(np.median(np.abs(first))),
            "load_coverage": float(np.mean(self._all("within_load"))), "moment_Nm": rms(self._all("moment")),
            "moment_over_rms": rms(self._all("moment")) / rms(self._all("true")),
            "moment_median_of_patients": float(np.median(own)),
            "moment_coverage": float(np.mean(self._all("within_moment"))),
        }  # fmt: skip


def filtered(found: MuscleRecording, row: Row, usual: MuscleEstimator, period: float, tuning: MuscleTuning, seed: int):  # noqa: ANN201
    """Estimates along an episode."""
    person = found.person if row.body else Person()
    elbow = MuscleElbow(
        device=usual.elbow.device, machine=usual.elbow.machine, person=person, farther=1.0 if row.arms else 1.05
    )
    if not row.noise:
        tuning = tuning._replace(emg=QUIET, activation=1.0)
    told = Known(load=row.load, strength=found.strength if row.strength else None)
    estimator = MuscleEstimator(elbow, period, tuning, told, like=usual)
    estimates = []
    lag = round(DELAY / period) if row.late else 0
    for k, y in enumerate(readings(found, row, estimator.muscles, lag, seed)):
        take = estimator.reset if k == 0 else estimator.update
        estimates.append(take(y, found.load[k]))
    return estimates, estimator.lost


def study(
    rows: tuple[Row, ...], population: str, first: int, patients: int, rate: float, tuning: MuscleTuning
) -> tuple[dict[Row, Judged], int]:
    """Errors of each row, and how often fibres were put in balance anew."""
    scores, lost, period = {row: Judged() for row in rows}, 0, 1.0 / rate
    for kind in dict.fromkeys(kind_of(row) for row in rows):
        of_kind = [row for row in rows if kind_of(row) == kind]
        env = made(of_kind[0], population, rate)
        machine = env.ecosystem.machine
        usual = MuscleEstimator(MuscleElbow(machine=machine, device=env.ecosystem.device), period, tuning)
        for k in range(patients):
            found = recorded(env, first + k)
            for row in of_kind:
                estimates, again = filtered(found, row, usual, period, tuning, first + k)
                lost += again
                scores[row].add(found, estimates, period)
            said = {r.name: f"{scores[r].parts[-1]['first_load']:+.2f} kg" for r in of_kind}
            print(f"patient {k + 1}: {said}, filters begun anew {lost}", flush=True)
    return scores, lost


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=50)
    parser.add_argument("--population", default="evaluation")
    parser.add_argument("--seed", type=int, default=FIRST_SEED)
    parser.add_argument("--rate", type=float, default=50.0, help="of all readings [Hz]")
    parser.add_argument("--causes", action="store_true", help="take causes of the error off one by one")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = CAUSES if given.causes else ROWS
    scores, lost = study(rows, given.population, given.seed, given.patients, given.rate, MuscleTuning())
    found = {row.name: score.row() for row, score in scores.items()}
    for name, numbers in found.items():
        print(name, {k: round(v, 4) for k, v in numbers.items()})
    print(f"times that fibres were put in balance anew: {lost}")
    heads = next(iter(found.values())).keys()
    columns = {h: np.array([r[h] for r in found.values()]) for h in heads}
    write_csv(given.out, {"row": np.arange(1.0, len(found) + 1.0), **columns})


if __name__ == "__main__":
    main()

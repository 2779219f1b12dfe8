"""How much of the plan each set of sensors shows: the table of docs/hidden-intent.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/plan/plan_information.py --runs out/plan [--out docs/plan_information.csv]

Episodes of `wide` under a mixture of controllers, whose moments are disturbed, train a network with memory for each set
(plan_estimator.py). Each tells the plan of patients of `evaluation` whom nobody helps, and whom the shipped policy
helps; beside it stand two trivial answers, the mean of the plan and the arm's own angle. What the reward would give for
tracking if the arm were always where it is told to be tells what the answer is worth at most to a device that follows
it. A second table (..._limits.csv) says how often muscles are told all they can give. Patients are parted by what they
return unhelped.

What was recorded and trained is kept in the folder of --runs, from which the same command goes on.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

import numpy as np
import torch

from agents.environment import HIDDEN_PLAN, make, patient_seeds
from dms_core.model.muscles.activation import MINIMUM
from exo_env.patient.patient import SHOWN
from exo_env.tasks.judgement.intent_rewards import INTENT_WIDTH
from tests.benchmarks import csv_file
from tests.benchmarks.plan.plan_episodes import NOBODY, SETTINGS, TARGETS, Episodes, record
from tests.benchmarks.plan.plan_estimator import PlanEstimator, Schooling, tell, train

LEARNED = "learned_intent"
MIXTURE = (NOBODY, "mean_angle", "adaptive_gravity", LEARNED, "soft_oracle")
DISTURBANCE = 0.4
HELPERS = {"nobody": NOBODY, "learned": LEARNED}
TRAIN_SEED, TEST_SEED = 1501, 1502
"""Of the patients; no training, search or evaluation has them."""
TRAITS = ("load", *SHOWN)
WANTED = "wanted"
"""Stands for the wanted activations before their ceiling, which are no channel."""
SETS: dict[str, tuple[str, ...]] = {
    "device": ("device",),
    "device, estimated": ("device", "estimated"),
    "device, emg": ("device", "emg"),
    "device, activations": ("device", "privileged.activation"),
    "device, traits, load": ("device", *(f"privileged.{x}" for x in TRAITS)),
    "device, activations, traits, load": (
        "device", "privileged.activation", *(f"privileged.{x}" for x in TRAITS)),
    "and commands before their ceiling": (
        "device", "privileged.activation", *(f"privileged.{x}" for x in TRAITS), WANTED),
}  # fmt: skip
FAR = np.radians(5.0)
"""Distance of the plan from the arm beyond which a direction is asked for [rad]."""
NOW, SOON = TARGETS.index("intent"), TARGETS.index("intent in 0.3 s")
COLUMNS = (
    "helped_by", "seen", "rms_now_deg", "rms_in_0.3_s_deg", "rms_weakest_deg", "rms_strongest_deg",
    "rms_at_limit_deg", "rms_between_deg", "told_deviation_deg", "tracking_if_there", "tracking_if_there_weakest",
)  # fmt: skip
LIMIT_COLUMNS = (
    "helped_by", "patients", "flexors_full", "extensors_full", "all_at_limit", "direction_by_mean_right",
    "direction_by_activation_right", "direction_by_first_set_right", "return",
)  # fmt: skip


@cache
def structure() -> tuple:
    """Parts of an observation with all groups."""
    return make(HIDDEN_PLAN, **SETTINGS).unwrapped.observation_structure  # type: ignore[attr-defined]


def places_of(names: Sequence[str]) -> list[int]:
    """Places of groups and channels in an observation with all groups."""
    parts = structure()
    return [
        k for name in names for p in parts if name in (p.group, f"{p.group}.{p.name}") for k in range(p.start, p.stop)
    ]


def elbow() -> int:
    """Place of the arm's own angle."""
    return places_of(["privileged.elbow"])[0]


def kept_episodes(path: Path, *given, **more) -> Episodes:  # noqa: ANN002, ANN003
    """What `record` gives, from a file where there is one."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        found = record(*given, **more)
        np.savez(path, **{f.name: getattr(found, f.name) for f in fields(found)})
    with np.load(path) as kept:
        return Episodes(**{f.name: kept[f.name] for f in fields(Episodes)})


def kept_estimator(path: Path, name: str, episodes: Episodes, how: Schooling) -> PlanEstimator:
    """An estimator for a set, from a file where there is one."""
    names, places = [x for x in SETS[name] if x != WANTED], places_of(SETS[name])
    wanted = len(names) < len(SETS[name])
    if path.exists():
        one = PlanEstimator(places, how.width, episodes.wanted.shape[2] if wanted else 0)
        one.load_state_dict(torch.load(path, weights_only=True))
        return one
    print(name, flush=True)
    one = train(episodes, places, how, wanted)
    torch.save(one.state_dict(), path)
    return one


def rms(error: np.ndarray, which: np.ndarray) -> float:
    """Root mean square of errors [rad] where `which` holds [deg]."""
    return float(np.degrees(np.sqrt(np.mean(error[which] ** 2)))) if which.any() else float("nan")


def quarters(returns: np.ndarray) -> dict[str, np.ndarray]:
    """Which patients are the weakest and the strongest quarter by their unassisted return."""
    low, high = np.quantile(returns, (0.25, 0.75))
    return {"all": np.full(len(returns), True), "weakest": returns <= low, "strongest": returns >= high}


def at_limit(episodes: Episodes) -> np.ndarray:
    """Where what is told to every muscle stays the same if the patient wants a little more or less, shape (n, T)."""
    return episodes.steady.all(axis=2)


def answers(helped: str, test: Episodes, told: Mapping[str, np.ndarray], parts: Mapping[str, np.ndarray]) -> list:
    """A row for each answer [rad], shape (n, T, 2), now and soon, and its deviation behind them where it has one."""
    rows, limit, on = [], at_limit(test), test.running
    for name, answer in told.items():
        now, soon = answer[..., 0] - test.plan[..., NOW], answer[..., 1] - test.plan[..., SOON]
        weakest, strongest = (on & parts[x][:, None] for x in ("weakest", "strongest"))
        deviation = np.degrees(np.sqrt(np.mean(answer[..., 2][on] ** 2))) if answer.shape[2] > 2 else float("nan")
        earned = np.exp(-((now / INTENT_WIDTH) ** 2))
        rows.append((
            helped, name, rms(now, on), rms(soon, on), rms(now, weakest), rms(now, strongest), rms(now, on & limit),
            rms(now, on & ~limit), float(deviation), float(earned[on].mean()), float(earned[weakest].mean()),
        ))  # fmt: skip
    return rows


def limits(helped: str, test: Episodes, guesses: Sequence[np.ndarray], parts: Mapping[str, np.ndarray]) -> list:
    """A row for each part of the patients: how often muscles are at their limits, and what a direction is worth.

    Args:
        helped: by whom.
        test: the episodes.
        guesses: whose sign tells whether the plan is above the arm or below, shape (n, T) each.
        parts: of the patients.
    """
    flexes, rows = np.arange(test.full.shape[2]) >= test.full.shape[2] // 2, []
    away = test.plan[..., NOW] - test.seen[..., elbow()]
    for name, which in parts.items():
        on = test.running & which[:, None]
        far = on & (np.abs(away) > FAR)
        right = [float(np.mean(np.sign(g[far]) == np.sign(away[far]))) for g in guesses]
        rows.append((
            helped, name, float(test.full[on][:, flexes].mean()), float(test.full[on][:, ~flexes].mean()),
            float(at_limit(test)[on].mean()), *right, float(test.returns[which].mean()),
        ))  # fmt: skip
    return rows


def more_flexion(test: Episodes) -> np.ndarray:
    """By how much more of what weakness leaves the flexors are active than the extensors [-], shape (n, T)."""
    activation = test.seen[..., places_of(["privileged.activation"])]
    half, shares = activation.shape[2] // 2, []
    for group, muscles in (("flexors", activation[..., half:]), ("extensors", activation[..., :half])):
        (ceiling,) = places_of([f"privileged.maximum_activation_{group}"])
        shares.append(muscles.mean(axis=2) / np.maximum(test.seen[..., ceiling], MINIMUM))
    return shares[0] - shares[1]


def study(runs: Path, sets: Sequence[str], episodes: int, patients: int, how: Schooling) -> tuple[list, list]:
    """Rows of both tables."""
    training = kept_episodes(
        runs / "training.npz", "wide", patient_seeds(TRAIN_SEED, episodes), MIXTURE, disturbance=DISTURBANCE
    )
    estimators = {name: kept_estimator(runs / f"set_{list(SETS).index(name)}.pt", name, training, how) for name in sets}
    tests = {
        name: kept_episodes(runs / f"test_{name}.npz", "evaluation", patient_seeds(TEST_SEED, patients), [driver])
        for name, driver in HELPERS.items()
    }
    parts, middle = quarters(tests["nobody"].returns), float(training.plan[..., NOW][training.running].mean())
    rows, limit_rows = [], []
    for helped, test in tests.items():
        angle = test.seen[..., elbow()]
        told = {"(mean of the plan)": np.full((*angle.shape, 2), middle), "(the arm's angle)": np.stack([angle] * 2, 2)}
        for name, one in estimators.items():
            mean, deviation = tell(one, test, WANTED in SETS[name])
            told[name] = np.concatenate([mean[..., [NOW, SOON]], deviation[..., [NOW]]], axis=2)
        rows += answers(helped, test, told, parts)
        guesses = [middle - angle, more_flexion(test), told[sets[0]][..., 0] - angle]
        limit_rows += limits(helped, test, guesses, parts)
    return rows, limit_rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Do the study and write both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path, required=True, help="folder of what is recorded and trained")
    parser.add_argument("--sets", nargs="+", choices=SETS, default=list(SETS), help="sets of sensors")
    parser.add_argument("--episodes", type=int, default=2000, help="of training")
    parser.add_argument("--patients", type=int, default=256, help="of the test")
    parser.add_argument("--epochs", type=int, default=16, help="of each training")
    parser.add_argument("--out", type=Path, default=Path("docs/plan_information.csv"), help="the first table")
    given = parser.parse_args(arguments)
    torch.set_num_threads(1)
    rows, limit_rows = study(given.runs, given.sets, given.episodes, given.patients, Schooling(given.epochs))
    csv_file.write(given.out, COLUMNS, rows)
    csv_file.write(given.out.with_stem(f"{given.out.stem}_limits"), LIMIT_COLUMNS, limit_rows)
    for row in (*rows, *limit_rows):
        print(*(f"{x:.2f}" if isinstance(x, float) else x for x in row), sep=" | ")
    return 0


if __name__ == "__main__":
    sys.exit(main())

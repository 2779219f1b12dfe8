"""Policies that act on an estimate of the plan: the second table of docs/hidden-intent.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/plan/plan_belief.py --runs out/plan --told out/ablations/told_plan_0 \
        [--out docs/plan_belief.csv]

An estimator of the plan sees `device` (plan_information.py, whose folder --runs is). Its estimates stand in for the
plan in a policy that was trained to be told it (certainty equivalence); then the estimator goes on with episodes that
this policy drove. A soft PD on the estimate is tuned (estimate_pd.py). PPO learns on `device` and the estimates, by the
recipe ppo.yml with half of its steps, and goes on once the estimator has seen that policy's episodes; and it begins
with the policy that was told the plan. All act on the 60 patients of docs/ablations.csv. What was done is kept in
--runs, from which the same command goes on.
"""

from __future__ import annotations

import argparse
import copy
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

import numpy as np
import torch

from agents.environment import patient_seeds
from agents.evaluation.comparison.gap import gap_closed
from agents.evaluation.comparison.statistics import estimate, interquartile_mean
from agents.policies.learned import find_policy
from exo_env.tasks.judgement.intent_rewards import INTENT_WIDTH
from tests.benchmarks import csv_file
from tests.benchmarks.plan.belief_learning import TOLD, BeliefLearning
from tests.benchmarks.plan.believer import Believer
from tests.benchmarks.plan.estimate_pd import searched
from tests.benchmarks.plan.plan_episodes import NOBODY, Driver, Episodes, record
from tests.benchmarks.plan.plan_estimator import PlanEstimator, Schooling, train
from tests.benchmarks.plan.plan_information import (
    DISTURBANCE,
    LEARNED,
    MIXTURE,
    TRAIN_SEED,
    kept_episodes,
    kept_estimator,
    places_of,
)

TRIES = ("certainty", "cautious", "learning", "tuning")
SEARCHED = (24, 24)
"""Tries of a search, and training patients of each."""
SEED, PATIENTS = 7, 60
COLUMNS = (
    "policy", "return", "return_low", "return_high", "gap_closed", "gap_closed_low", "gap_closed_high",
    "tracking_rms_deg", "estimate_rms_deg", "unsafe", "return_mean", "tracking", "tracking_if_there",
)  # fmt: skip


class CertaintyEquivalence:
    """A policy that was trained with the plan, with an estimate in its place.

    Args:
        told: folder of its training.
        estimator: of the plan.
        share: of its action that is done.
    """

    def __init__(self, told: Path, estimator: PlanEstimator, share: float = 1.0) -> None:
        self._network, self._believer = copy.deepcopy(find_policy(str(told)).network), Believer(estimator)  # type: ignore[attr-defined]
        self._device, self._share = places_of(["device"]), share

    def begin(self, worlds: int) -> None:
        """Begin an episode in each world."""
        self._network.reset(worlds)
        self._believer.begin()
        self.told: list[np.ndarray] = []

    def act(self, observations: np.ndarray) -> np.ndarray:
        """Actions, shape (n, 2)."""
        plan = self._believer.believe(observations).mean
        self.told.append(plan[:, 0])
        seen = np.concatenate([observations[:, self._device], plan[:, TOLD]], axis=1, dtype=np.float32)
        action = self._network(seen)
        action[:, 0] *= self._share
        return action


def measured(name: str, test: Episodes, against: Mapping[str, Episodes], told: np.ndarray | None = None) -> list:
    """A row of the table."""
    as_episodes = {
        key: [{"seed": k, "measures": {"return": float(x)}} for k, x in enumerate(one.returns)]
        for key, one in {**against, "": test}.items()
    }
    gap = gap_closed(as_episodes[""], as_episodes["mean_angle"], as_episodes["oracle"], SEED)
    returns = estimate(test.returns, interquartile_mean, np.random.default_rng(SEED))
    angle = test.seen[..., places_of(["privileged.elbow"])[0]]
    answers = [angle, told if told is not None else np.full_like(angle, np.nan)]
    wrong = [np.degrees(rms(x - test.plan[..., 0], test.running)) for x in answers]
    return [
        name, returns.value, returns.low, returns.high, gap["value"], gap["low"], gap["high"], *wrong,
        float(1.0 - test.running[:, -1].mean()), float(test.returns.mean()),
        *(earned(x - test.plan[..., 0], test.running) for x in answers),
    ]  # fmt: skip


def rms(error: np.ndarray, on: np.ndarray) -> float:
    """Interquartile mean over patients of the root mean square over time."""
    each = np.sqrt(np.sum(np.where(on, error**2, 0.0), axis=1) / on.sum(axis=1))
    return float(interquartile_mean(each))


def earned(error: np.ndarray, on: np.ndarray) -> float:
    """What errors [rad] earn for tracking, over what a whole episode earns at most."""
    return float(np.where(on, np.exp(-((error / INTENT_WIDTH) ** 2)), 0.0).mean())


def tested(driver: Driver) -> Episodes:
    """The episodes of the test under a driver."""
    return record("evaluation", patient_seeds(SEED, PATIENTS), [driver])


class Study:
    """The tries one after another.

    Args:
        runs: folder of plan_information.py.
        told: folder of the training that is told the plan.
        episodes: that each retraining of an estimator adds.
        epochs: of it.
        steps: of PPO.
    """

    def __init__(self, runs: Path, told: Path, episodes: int, epochs: int, steps: int) -> None:
        self.runs, self.told, self.episodes, self.epochs, self.steps = runs, told, episodes, epochs, steps
        self.training = kept_episodes(
            runs / "training.npz", "wide", patient_seeds(TRAIN_SEED, 2000), MIXTURE, disturbance=DISTURBANCE
        )
        self.first = kept_estimator(runs / "set_0.pt", "device", self.training, Schooling())
        self.against = {name: tested(name) for name in ("mean_angle", "oracle")}
        self.rows = [measured(name, one, self.against) for name, one in self.against.items()]
        for name in (NOBODY, LEARNED):
            self._add(name, name)

    def _add(self, name: str, driver: Any) -> None:
        one = tested(driver)
        told = getattr(driver, "told", None)
        row = measured(name, one, self.against, None if not told else np.array(told[::2]).T)
        self.rows.append(row)
        print(*(f"{x:.3g}" if isinstance(x, float) else x for x in row), sep=" | ", flush=True)

    def tries(self, name: str) -> None:
        """The rows of a kind of tries, from a file where there is one."""
        path, first = self.runs / f"tries_{name}.json", len(self.rows)
        if path.exists():
            self.rows += json.loads(path.read_text())
            return
        getattr(self, name)()
        path.write_text(json.dumps(self.rows[first:]))

    def certainty(self) -> None:
        """Certainty equivalence, its estimator retrained on its own episodes twice; then less of its action."""
        one, known = self.first, self.training
        self._add("certainty equivalence", CertaintyEquivalence(self.told, one))
        for k in (1, 2):
            one, known = self.retrained(one, known, CertaintyEquivalence(self.told, one), f"belief_{k}.pt", 10 + k)
            self._add(f"certainty equivalence, estimator retrained, round {k}", CertaintyEquivalence(self.told, one))
        for share in (0.25, 0.5):
            self._add(f"{share:g} of that action", CertaintyEquivalence(self.told, one, share))

    def retrained(
        self, one: PlanEstimator, known: Episodes, driver: Any, file: str, seed: int
    ) -> tuple[PlanEstimator, Episodes]:
        """An estimator that goes on with episodes that a driver drove, and all that it has learned from."""
        seeds = patient_seeds(TRAIN_SEED + seed, self.episodes)
        known = known.and_also(record("wide", seeds, [driver], disturbance=0.5 * DISTURBANCE, seed=seed))
        path, found = self.runs / file, copy.deepcopy(one)
        if path.exists():
            found.load_state_dict(torch.load(path, weights_only=True))
            return found, known
        found = train(known, one.places, Schooling(self.epochs, rate=1e-3), begin=found)
        torch.save(found.state_dict(), path)
        return found, known

    def cautious(self) -> None:
        """A soft PD on the estimate, softer where that is unsure."""
        driver, numbers = searched(self.first, *SEARCHED)
        print(numbers)
        self._add("PD on the estimate, tuned", driver)

    def learning(self) -> None:
        """PPO on `device` and the estimates, and on with a retrained estimator."""
        learning = BeliefLearning(self.first, self.steps, seed=0)
        learning.learn(self.steps)
        self._add("PPO on device and estimates", learning.driver())
        one, _ = self.retrained(self.first, self.training, learning.driver(), "belief_ppo.pt", 20)
        learning.believe(one)
        self._add("the same, estimator retrained", learning.driver())
        learning.learn(self.steps // 2)
        self._add("PPO gone on with it", learning.driver())

    def tuning(self) -> None:
        """PPO that begins with the policy that was told the plan, and sees what the estimator believes instead."""
        told: Any = find_policy(str(self.told))
        learning = BeliefLearning(self.first, self.steps // 2, seed=0, told=told)
        learning.learn(self.steps // 2)
        self._add("PPO that begins with told_plan", learning.driver())


def main(arguments: Sequence[str] | None = None) -> int:
    """Do the tries and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path, required=True, help="folder of plan_information.py")
    parser.add_argument("--told", type=Path, required=True, help="training of the variation told_plan")
    parser.add_argument("--tries", nargs="+", choices=TRIES, default=TRIES)
    parser.add_argument("--episodes", type=int, default=600, help="that each retraining of an estimator adds")
    parser.add_argument("--epochs", type=int, default=8, help="of each retraining")
    parser.add_argument("--steps", type=int, default=1_500_000, help="of PPO")
    parser.add_argument("--out", type=Path, default=Path("docs/plan_belief.csv"))
    given = parser.parse_args(arguments)
    torch.set_num_threads(1)
    study = Study(given.runs, given.told, given.episodes, given.epochs, given.steps)
    for name in given.tries:
        study.tries(name)
        csv_file.write(given.out, COLUMNS, study.rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())

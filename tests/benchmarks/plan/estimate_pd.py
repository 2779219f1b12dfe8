"""A soft PD on an estimate of the plan, softer where the estimate is unsure; its numbers are searched for.

    M = weight(theta) + c (stiffness (psi^ - theta) + damping psi^') - damping theta' + integral int c (psi^ - theta) dt
    c = 1 / (1 + (s / s0)^2)

with the estimate psi^, its rate and its standard deviation s. It is the PD on the mean angle (mean_movement.py) with
what is believed in place of the mean, and the oracle's integral, which forgets and is for those who do not get there.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agents.environment import HIDDEN_PLAN, make, patient_seeds
from agents.policies.reference_free.assist_moment import AssistMoment, Seen
from agents.policies.reference_free.oracle import FORGETTING
from tests.benchmarks.plan.believer import Believer
from tests.benchmarks.plan.plan_episodes import SETTINGS, TARGETS, record
from tests.benchmarks.plan.plan_estimator import PlanEstimator

RANGES = {
    "stiffness": (0.5, 20.0), "integral": (0.5, 60.0), "damping": (0.3, 3.0), "s0_deg": (3.0, 40.0),
    "share": (0.02, 0.3), "carried": (0.02, 0.6), "smoothing": (0.01, 0.1),
}  # fmt: skip
"""Least and largest value of each number, drawn evenly in the logarithm."""
SEARCH_SEED = 1510
"""Of the training patients."""


class EstimatePd(AssistMoment):
    """The controller, as a driver of worlds that show all groups.

    Args:
        estimator: of the plan.
        numbers: by the names of RANGES.
    """

    name, title = "estimate_pd", "PD on the estimated plan"

    def __init__(self, estimator: PlanEstimator, numbers: Mapping[str, float]) -> None:
        self.numbers = dict(numbers)
        self._believer, self._env = Believer(estimator), make(HIDDEN_PLAN, **SETTINGS)
        self._scale = estimator.plan_scale[0].item()

    def begin(self, worlds: int) -> None:  # type: ignore[override]
        """Begin an episode in each world."""
        super().begin(self._env, worlds)
        self._believer.begin()
        self._sum = np.zeros(worlds)
        self.told: list[np.ndarray] = []

    def wanted(self, observations: np.ndarray, seen: Seen) -> np.ndarray:
        """The moment towards what is believed."""
        x, belief = self.numbers, self._believer.believe(observations)
        psi, rate = (belief.mean[:, TARGETS.index(name)] for name in ("intent", "intent_rate"))
        self.told.append(psi)
        deviation = self._scale * np.exp(0.5 * belief.log_variance[:, 0])
        sure = 1.0 / (1.0 + (deviation / np.radians(x["s0_deg"])) ** 2)
        error = sure * (psi - seen.angle)
        self._sum = self._sum + self.period * error - self.kept(FORGETTING) * self._sum
        towards = x["stiffness"] * error + x["damping"] * (sure * rate - seen.rate) + x["integral"] * self._sum
        return self.weight(seen.angle) + towards


def searched(estimator: PlanEstimator, tries: int, patients: int) -> tuple[EstimatePd, dict[str, float]]:
    """The controller with the best mean return on training patients; half of the tries are near the best."""
    generator, best, found = np.random.default_rng(0), -np.inf, dict[str, float]()
    for k in range(tries):
        numbers = {n: float(np.exp(generator.uniform(*np.log(r)))) for n, r in RANGES.items()}
        if k >= tries // 2:
            near = {n: found[n] * float(np.exp(0.3 * generator.standard_normal())) for n in RANGES}
            numbers = {n: float(np.clip(near[n], *RANGES[n])) for n in RANGES}
        seeds = patient_seeds(SEARCH_SEED, patients)
        returned = float(record("wide", seeds, [EstimatePd(estimator, numbers)], patients).returns.mean())
        print(f"try {k}: {returned:.1f}", {n: round(x, 3) for n, x in numbers.items()}, flush=True)
        if returned > best:
            best, found = returned, numbers
    return EstimatePd(estimator, found), found

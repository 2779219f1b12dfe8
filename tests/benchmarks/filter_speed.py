"""What a step of the compiled filter costs: processor time over its period, and beside the filter in Python.

    python -m tests.benchmarks.filter_speed

Processor time of one thread counts, not the clock, so that other work on the machine matters little. Filters and their
Python form are stepped in turn.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from dms_core import Model
from dms_core.estimation import CompiledFilter, FilterSettings, KalmanFilter
from dms_core.files.config_files import configs
from dms_core.model_files.model_file import load
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.estimation import ElbowEstimator, NominalElbow
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, RATE
from exo_env.estimation.muscle_elbow import MuscleElbow
from exo_env.estimation.muscle_estimator import MuscleEstimator, emg_channel

PERIOD, STEPS, BESIDE, ROUNDS = 0.001, 300, 3, 4
"""Period [s]; steps of a round, and those of the filter in Python; rounds, of which the best counts."""


def forearm() -> tuple[CompiledFilter, dict[str, float]]:
    """The forearm of docs/estimation.md."""
    settings = FilterSettings.from_file(configs() / "estimation/forearm_filter.yaml")
    settings = FilterSettings(**{**dict(settings), "period": PERIOD, "steps": 1})
    quick = CompiledFilter(Model(load(configs() / "estimation/forearm.yaml")), settings)
    y, _ = quick.shown()
    return quick, dict(zip(quick.names, y.tolist(), strict=True))


def elbow() -> tuple[CompiledFilter, dict[str, float]]:
    """The elbow of a worn device."""
    at = {ANGLE: 0.8, RATE: 0.0, GUIDE_FORCE: 3.0}
    estimator = ElbowEstimator(NominalElbow(), PERIOD)
    estimator.reset(at)
    return estimator.filter, at


def muscles() -> tuple[CompiledFilter, dict[str, float]]:
    """The elbow with six muscles, electrodes and constants."""
    elbow = MuscleElbow(machine=GymMachine.from_config("gym_machine/pulley.yaml"))
    estimator = MuscleEstimator(elbow, PERIOD)
    at = {ANGLE: 0.8, RATE: 0.0, GUIDE_FORCE: 3.0, **{emg_channel(m): 0.1 for m in estimator.muscles}}
    estimator.reset(at)
    return estimator.filter, at


def cost(step: Callable[[], object], count: int) -> float:
    """Processor time of a step [s]."""
    begin = time.process_time()
    for _ in range(count):
        step()
    return (time.process_time() - begin) / count


def main() -> None:
    for name, made in {"forearm": forearm, "elbow": elbow, "elbow with muscles": muscles}.items():
        quick, readings = made()
        kalman = KalmanFilter(quick.kalman.model, quick.kalman.settings)
        belief = quick.belief()

        def in_python(kalman=kalman, belief=belief, readings=readings) -> None:  # noqa: ANN001
            end = kalman.predict(belief, belief.t + PERIOD).belief
            kalman.correct(end, readings)

        in_python()
        both = []
        for _ in range(ROUNDS):
            quick.begin(belief)
            own = cost(lambda quick=quick, readings=readings: quick.step(readings), STEPS)  # type: ignore[misc]
            both.append((own, cost(in_python, BESIDE)))
        own, slow = np.min(np.array(both), axis=0)
        print(
            f"{name}: {len(belief.P)} estimated numbers, {own * 1e6:.0f} us a step, {own / PERIOD:.2f} of a period at "
            f"1 kHz; in Python {slow * 1e6:.0f} us, {slow / own:.0f} times as much",
            flush=True,
        )


if __name__ == "__main__":
    main()

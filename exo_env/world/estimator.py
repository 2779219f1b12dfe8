"""Tables of the device's filter in a world; empty where no agent is shown what it estimates."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.estimation.reduced_elbow import reduced_elbow
from exo_env.estimation.reduced_filter import BELIEF, ESTIMATE, FAST, LEARNT, SENSED, SLOW
from exo_env.streams import stream
from exo_env.tables import EstimatorTables, ObserverTables
from exo_env.tasks.observation.noise import IMPERFECTION
from exo_env.tasks.observation.observer import Observer
from exo_env.tasks.task import Task


def estimator_tables(
    observer: Observer, task: Task, ecosystem: Ecosystem, period: float, seen_by: Callable[[Observer], ObserverTables]
) -> EstimatorTables:
    """The filter of a device, as the observer says whether there is one.

    Args:
        observer: what an agent sees; its `device` is what the filter sees.
        task: has the readings that are estimates.
        ecosystem: the device knows itself and the machine of it, and nothing of the person.
        period: control period [s].
        seen_by: makes the tables of an observer.
    """
    if observer.device is None:
        return _tables(_nothing(), np.zeros(0), np.zeros((0, 5)), np.zeros((0, 0)), np.zeros((0, 2), np.int64))
    # What the maker knows of the sensors, whatever noise the settings give them.
    sheet = [c.imperfection for _, c in observer.device.channels]
    noise = [math.hypot(i.deviation, i.quantum / math.sqrt(12.0)) for i in sheet]
    elbow = reduced_elbow(ecosystem, period, noise)
    shown = [
        (task.places[r.name].start, ESTIMATE._fields.index(r.estimate)) for r in task.readings if r.estimate is not None
    ]
    return _tables(seen_by(observer.device), elbow.numbers, elbow.curves, elbow.disturbance, np.array(shown, np.int64))


def _tables(
    sensors: ObserverTables, numbers: np.ndarray, curves: np.ndarray, disturbance: np.ndarray, target: np.ndarray
) -> EstimatorTables:
    """The tables, with room for what the filter believes."""
    return EstimatorTables(
        sensors=sensors, numbers=numbers, curves=curves, disturbance=disturbance, target=target,
        sensed=np.zeros(len(SENSED)), mean=np.zeros(len(BELIEF)), fast=np.zeros((FAST, FAST)),
        slow=np.zeros((SLOW, SLOW)), learnt=np.zeros(len(LEARNT)), estimates=np.zeros(len(ESTIMATE)),
    )  # fmt: skip


def _nothing() -> ObserverTables:
    """An observer that sees nothing."""
    return ObserverTables(
        columns=np.zeros(0, np.int64), imperfections=np.zeros((0, len(IMPERFECTION))),
        streams=np.array([stream("tremor")]).view(np.int64), tremor=np.zeros(0), noise=np.zeros((0, 0)),
        memory=np.zeros((0, 0)), observation=np.zeros(0),
    )  # fmt: skip

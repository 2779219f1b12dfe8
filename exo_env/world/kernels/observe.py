"""What an agent is shown of a world, compiled: the device's filter first, then the observation."""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, ints, matrix
from exo_env.estimation.reduced_filter import begin_estimates, step_estimates
from exo_env.tables import ESTIMATOR, OBSERVER, STATUS, TASK, WORLD
from exo_env.tasks.observation.noise import IMPERFECTION, imperfect


@compiled
def observe(w, first):
    """Fill the observation of the present readings; with `first`, they are taken to have been true for long."""
    estimate(w, first)
    show(w, inner(w, WORLD.observer), first)


@compiled
def show(w, o, first):
    """Fill what an observer, packed `ObserverTables`, sees of the present readings."""
    imperfect(
        floats(inner(w, WORLD.task), TASK.readings), ints(o, OBSERVER.columns), matrix(o, OBSERVER.imperfections),
        matrix(o, OBSERVER.memory), matrix(o, OBSERVER.noise)[ints(w, WORLD.status)[STATUS.step]], first,
        floats(o, OBSERVER.observation),
    )  # fmt: skip


@compiled
def estimate(w, first):
    """Let the device's filter take what the device measures, and fill its readings; nothing where none is shown."""
    e = inner(w, WORLD.estimator)
    target = inner(e, ESTIMATOR.target)
    if target.shape[0] == 0:
        return
    sensors = inner(e, ESTIMATOR.sensors)
    show(w, sensors, first)
    seen, sensed = floats(sensors, OBSERVER.observation), floats(e, ESTIMATOR.sensed)
    imperfections = matrix(sensors, OBSERVER.imperfections)
    for i in range(seen.shape[0]):
        sensed[i] = seen[i] * imperfections[i, IMPERFECTION.scale]
    out = floats(e, ESTIMATOR.estimates)
    numbers, curves, disturbance = (
        floats(e, ESTIMATOR.numbers), matrix(e, ESTIMATOR.curves), matrix(e, ESTIMATOR.disturbance),
    )  # fmt: skip
    mean, learnt = floats(e, ESTIMATOR.mean), floats(e, ESTIMATOR.learnt)
    fast, slow = matrix(e, ESTIMATOR.fast), matrix(e, ESTIMATOR.slow)
    if first:
        begin_estimates(sensed, numbers, curves, disturbance, mean, fast, slow, learnt, out)
    else:
        step_estimates(sensed, numbers, curves, disturbance, mean, fast, slow, learnt, out)
    r = floats(inner(w, WORLD.task), TASK.readings)
    for k in range(target.shape[0]):
        r[target[k, 0]] = out[target[k, 1]]

"""The steps of a record taken again from another start, with other inputs or numbers: what differences are made of."""

from __future__ import annotations

import copy

import numpy as np

from dms_core import Model
from dms_core.analyses.independent import Independent
from dms_core.assembly.derivatives.parameter_derivatives import _moved, _system_with
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.replay import Replay
from dms_core.sensitivity.run import By, Sensitivity, Shift, Start


def _closed(model: Model, at: Independent, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q, v on the constraints of another model, the independent ones as they were."""
    q, v = q.copy(), v.copy()

    def corrected(G: np.ndarray, gap: np.ndarray) -> np.ndarray:
        square = np.vstack([G[at.rows][:, at.second], np.eye(len(at.second))[np.searchsorted(at.second, at.chosen)]])
        return np.linalg.solve(square, np.concatenate([-gap[at.rows], np.zeros(len(at.chosen))]))

    for _ in range(6):
        phi, _, G, _ = model.constraint_jacobian(q, v)
        q[at.second] += corrected(G, phi)
    for _ in range(2):
        _, phi_v, G, _ = model.constraint_jacobian(q, v)
        v[at.second] += corrected(G, phi_v)
    return q, v


def _shifted(record: RecordedWorld, shift: Shift, by: float) -> dict[int, list[tuple[float, float]]]:
    """The settings of a record with one input moved between two times."""
    k = record.model.input_index(shift.input)
    declared = float(record.model.new_signals().c[record.state.signals.ptr[k], 0])
    known = record._settings.get(k, [(-1.0, declared)])
    begin = shift.begin if shift.begin > 0.0 else -1.0
    times = sorted({t for t, _ in known} | {t for t in (begin, shift.end) if np.isfinite(t)})
    values = [next(v for t, v in reversed(known) if t <= time) for time in times]
    moved = [v + by if begin <= t < shift.end else v for t, v in zip(times, values, strict=True)]
    return {**record._settings, k: list(zip(times, moved, strict=True))}


def again(run: Sensitivity, x: By, by: float) -> np.ndarray:
    """The outputs of `run` where x is moved by `by`, over the recorded steps."""
    record = copy.copy(run.record)
    n = record.model.n_q
    first = run.record.kept(0)[0].copy()
    at, dq, dv = run._start
    if isinstance(x, Number):
        system = record.model.system
        element = system.element(x.element)
        record.model = Model(_system_with(system, _moved(element, x.path.split("."), by)), like=record.model)
        first = np.concatenate(_closed(record.model, at, first[:n], first[n:]))
    elif isinstance(x, Start):
        k = run.states.index(x.state)
        first += by * np.concatenate([dq[k], dv[k]])
        first = np.concatenate(_closed(record.model, at, first[:n], first[n:]))
    else:
        record._settings = _shifted(run.record, x, by)
    record._orders, record.stride, record._kept = [(0, record.model.tables)], 1, {}
    record._kept[0] = np.array([first, first])
    replay = Replay(record)
    for k in range(len(record.times) - 1):
        here = record._kept[k]
        if record.row(k + 1).start:
            record._kept[k + 1] = here
            continue
        replay.step(k, here)
        record._kept[k + 1] = np.array([np.concatenate([replay.state.q, replay.state.v]), here[0]])
    return Sensitivity(record, run.of, []).value()


def difference(run: Sensitivity, x: By, step: float) -> np.ndarray:
    """Central difference of the fourth order of all outputs by x."""
    far, high, low, near = (again(run, x, k * step) for k in (2.0, 1.0, -1.0, -2.0))
    return (8.0 * (high - low) - (far - near)) / (12.0 * step)

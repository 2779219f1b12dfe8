"""Accelerations, rates of first-order coordinates and multipliers at given states of a run.

Between the steps of Radau IIA they are not interpolated but found from q and v, as at a start.
"""

from __future__ import annotations

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.tables import Signals
from dms_core.compiled.arena import floats
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.addresses import part_addresses
from dms_core.simulation.iteration.parts import PARTS, run_rates, set_inputs
from dms_core.simulation.state import STATE, new_state


@compiled
def _find(m, s, times, q, v, a, lam):
    """Rates of all states in place; where there are none, what was given stays."""
    q_s, v_s, vd, lam_s = floats(s, STATE.q), floats(s, STATE.v), floats(s, STATE.vd), floats(s, STATE.lam)
    for k in range(times.shape[0]):
        for i in range(q_s.shape[0]):
            q_s[i], v_s[i], vd[i] = q[k, i], v[k, i], a[k, i]
        for i in range(lam_s.shape[0]):
            lam_s[i] = lam[k, i]
        set_inputs(m, s, times[k], True)
        if run_rates(m, s, PARTS.consistent_rates, 0.0):
            for i in range(q_s.shape[0]):
                v[k, i], a[k, i] = v_s[i], vd[i]
            for i in range(lam_s.shape[0]):
                lam[k, i] = lam_s[i]


def rates_between(
    model: Model, signals: Signals, times: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray, lam: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """v, vdot and lam of the rows that are solved for, at times between steps; at a jump those before it.

    Args:
        model: the model.
        signals: its inputs in time.
        times: [s], shape (k,).
        q: coordinates, shape (k, n_q).
        v: velocities; those of first-order coordinates are a guess.
        a: accelerations, a guess; it stays where the equations have no solution.
        lam: multipliers, a guess, shape (k, n_phi).
    """
    start, tables = model.start, model.tables
    world = new_state(tables.values, model.new_work(), signals, part_addresses(), start.q, start.v)
    v, a, lam = (np.array(x, float, order="C") for x in (v, a, lam))
    _find(tables.table, world.table, times, np.ascontiguousarray(q), v, a, lam)
    return v, a, lam

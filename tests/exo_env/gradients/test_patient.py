"""The patient's act: the few numbers that its derivative is taken by are all that it reads."""

from __future__ import annotations

import numpy as np
import pytest

from exo_env.gradients.kernels import PARTS, do_part
from exo_env.gradients.periods import Periods
from tests.exo_env.gradients.worlds import made, some_actions


@pytest.mark.parametrize("seed", [1, 5, 9])
@pytest.mark.parametrize("delay", [0.0, 0.031, 0.5])
def test_no_other_number_of_the_memory_moves_what_a_tick_writes(seed, delay):
    """Every number that the patient remembers is moved by itself, one after another."""
    names = ("neural_delay", "electromechanical_delay", "stretch_delay", "feedback_delay")
    env = made(seed=seed, patient=dict.fromkeys(names, delay) | {"prediction": 0.5}, action_mode="assist_moment")
    for action in some_actions(env, 7):
        env.step(action)
    periods = Periods(env, ["angle"], [])
    vector, patient, moment = periods.vector, env.world.tables.patient, periods.start()[1]
    found = periods._patient()[1]
    newest = (int(patient.effort.present[0]) + 1) % patient.effort.error.shape[1]
    fields = [name for name in vector.arrays if name not in ("present", "limb", "commands", "action", "y")]
    everything = np.concatenate([vector.at[name] for name in fields])
    whole = periods._difference(PARTS.patient, vector.written_by_patient(newest), [everything])
    dense = np.zeros((len(found.written), vector.size))
    dense[:, found.read] = found.slope
    np.testing.assert_array_equal(whole.slope, dense[:, everything])
    assert found.slope.any()
    # Only what is said to be written is.
    before = periods._state()
    do_part(env.world.packed.table, PARTS.patient)
    changed = np.flatnonzero(periods._state() != before)
    told = {*found.written.tolist(), *vector.at["excitations_before"].tolist(), *vector.at["present"].tolist()}
    assert set(changed.tolist()) <= told
    periods._moments.go_to(moment)


def test_differences_leave_the_world_as_it_was():
    env = made(action_mode="assist_moment")
    env.step(np.array([0.1, -0.5]))
    periods = Periods(env, ["angle"], [])
    before = periods.start()[1]
    periods._drive(), periods._patient()
    after = periods.start()[1]
    assert after.arrays == before.arrays and after.mark.arrays == before.mark.arrays

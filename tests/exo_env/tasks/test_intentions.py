"""Plans of a patient who moves where and when he likes."""

import math

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.envs.hidden_intent import TIME, HiddenIntentEnv
from exo_env.tasks.movements.intended_plan import Move, Plan
from exo_env.tasks.movements.intentions import MOST_TARGETS, Intentions
from exo_env.tasks.movements.repetition import HIGHEST, LOWEST
from exo_env.tasks.movements.submovements import UNIT

KEYS = [np.uint64(k) for k in range(400)]


def units_of(movement, row):
    n = movement.most_units
    units = row[1 : 1 + len(UNIT) * n].reshape(n, len(UNIT))
    return units[units[:, UNIT.amplitude_deg] != 0.0]


def loads_of(movement, row):
    changes = row[1 + len(UNIT) * movement.most_units :].reshape(-1, 2)
    return changes[changes[:, 1] != 0.0]


@pytest.mark.parametrize("windows", [1, 8])
def test_plans_end_at_rest_within_the_arms_range(windows):
    movement = Intentions().in_windows(windows)
    assert movement.size(windows * TIME) == len(movement.draw(KEYS[0], windows * TIME))
    for key in KEYS[:: windows * 2]:
        row = movement.draw(key, windows * TIME)
        units = units_of(movement, row)
        ends = units[:, UNIT.onset] + units[:, UNIT.duration]
        assert len(units) >= 2 * windows and (units[:, UNIT.duration] >= 0.8).all()
        # A move ends in the window in which it begins.
        assert (np.floor(units[:, UNIT.onset] / TIME) == np.floor((ends - 1e-9) / TIME)).all()
        times = np.linspace(0.0, windows * TIME, 300 * windows)
        x = np.clip((times[:, None] - units[:, UNIT.onset]) / units[:, UNIT.duration], 0.0, 1.0)
        psi = row[0] + (x**3 * (10.0 - 15.0 * x + 6.0 * x**2)) @ units[:, UNIT.amplitude_deg]
        assert LOWEST - 1e-9 <= psi.min() and psi.max() <= HIGHEST + 1e-9


def test_what_occurs_is_what_was_asked_for():
    movement = Intentions()
    rows = [movement.draw(key, TIME) for key in KEYS]
    units = [units_of(movement, row) for row in rows]
    starts = np.array([row[0] for row in rows])
    assert LOWEST <= starts.min() < LOWEST + 1.0 and HIGHEST - 1.0 < starts.max() <= HIGHEST
    rests = np.array([u[0, UNIT.onset] for u in units])
    assert 0.2 <= rests.min() < 0.3 and 2.9 < rests.max() <= 3.0
    overlapping = sum(int((u[1:, UNIT.onset] < u[:-1, UNIT.onset] + u[:-1, UNIT.duration] - 1e-9).sum()) for u in units)
    moves = sum(map(len, units)) - overlapping
    # A fifth of the moves, less those for which no time is left; four deviations of a binomial number.
    assert abs(overlapping / moves - 0.19) < 4.0 * math.sqrt(0.2 * 0.8 / moves)
    assert 2.0 < moves / len(KEYS) < 3.5
    changes = [loads_of(movement, row) for row in rows]
    assert sum(map(len, changes)) > 0.4 * len(KEYS)
    assert all(c[0, 1] > 0.0 for c in changes if len(c)), "a hand must be empty before it picks something up"
    assert all(abs(c[0, 1] + c[1, 1]) < 1e-12 for c in changes if len(c) > 1)


def test_one_distribution_moves_no_other():
    row, other = (Intentions(pause=p).draw(KEYS[3], TIME) for p in (0.5, 0.6))
    assert row[0] == other[0] and row[1 + UNIT.onset] == other[1 + UNIT.onset]
    assert row[1 + UNIT.amplitude_deg] == other[1 + UNIT.amplitude_deg]


def test_the_time_says_nothing_about_the_plan():
    """The mean of psi over plans is the same at all times, within four standard errors of 400 plans."""
    movement, times = Intentions(), np.linspace(0.0, TIME, 46)
    psi = []
    for key in KEYS:
        row = movement.draw(key, TIME)
        x = np.clip((times[:, None] - units_of(movement, row)[:, 0]) / units_of(movement, row)[:, 1], 0.0, 1.0)
        psi.append(row[0] + (x**3 * (10.0 - 15.0 * x + 6.0 * x**2)) @ units_of(movement, row)[:, 2])
    mean = np.mean(psi, axis=0)
    assert np.abs(mean - mean.mean()).max() < 4.0 * np.std(psi) / math.sqrt(len(KEYS))
    assert np.var(mean) < 0.01 * np.var(psi)


def move(**changed):
    quiet = Move(30.0, 1.0, 0.5, 0.4, 20.0, 1.2, 0.0, 0.9, 0.5, 0.0, 0.0, 0.9)
    return quiet._replace(**changed)


def test_a_plan_by_hand():
    plan = Plan(40.0, 9.0)
    moves = [move(loaded=0.0), move(changed=0.0), move(changed=0.0, elsewhere=0.9, way=0.9), move(duration=5.0)]
    plan.add_window(1.0, moves, 0.2, 0.25)
    row = plan.row(8, 4)
    found = row[1:25].reshape(8, 3)[:6]
    expected = [
        [1.0, 1.0, 30.0],  # to 70 deg; in its pause something is picked up
        [2.5, 1.0, 30.0],  # to 100 deg, broken off halfway: back to 70
        [3.0, 1.2, -30.0],
        [4.7, 1.0, -30.0],  # to 40 deg, redirected halfway: 20 deg up from where it began, to 90
        [5.2, 1.2, 50.0],
        [0.0, 1.0, 0.0],  # for the last there is no time
    ]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_allclose(row[25:].reshape(4, 2), [[2.25, 0.4], [9.0, 0.0], [9.0, 0.0], [9.0, 0.0]])


def test_a_move_goes_where_there_is_room():
    plan = Plan(95.0, 9.0)
    plan.add_window(0.2, [move(amplitude_deg=30.0, way=0.0), move(amplitude_deg=60.0)], 0.0, 0.0)
    # 30 deg up leave the range; from 65 deg neither way has room for 60: as far as there is.
    np.testing.assert_allclose(plan.row(8, 4)[1:7].reshape(2, 3)[:, UNIT.amplitude_deg], [-30.0, -45.0])


@pytest.mark.parametrize(
    ("reference", "said"),
    [
        ({"start_deg": 5.0}, "start_deg = 5.0: expected numbers from 20 to 100"),
        ({"targets": 0}, "targets = 0: expected numbers from 1 to 4"),
        ({"targets": 2.5}, "targets = 2.5: expected whole numbers"),
        ({"targets": {"uniform": [1, 3]}}, "expected whole numbers"),
        ({"amplitude_deg": {"uniform": [10.0, 90.0]}}, "expected numbers from 1 to 80"),
        ({"duration": 0.0}, "duration = 0.0: expected numbers from 0.3 to 10"),
        ({"pause": "long"}, "pause = 'long': expected numbers from 0 to 10"),
        ({"changes_of_mind": 1.5}, "changes_of_mind"),
        ({"plan": 1}, "plan"),
    ],
)
def test_plans_that_cannot_be(reference, said):
    with pytest.raises(InputError, match="(?s).*" + said.replace("[", r"\[")):
        HiddenIntentEnv(reference=reference)


def test_most_targets_have_time():
    quick = Intentions(rest=0.2, targets=MOST_TARGETS, duration=0.8, pause=0.2, changes_of_mind=0.0)
    assert len(units_of(quick, quick.draw(KEYS[0], TIME))) == MOST_TARGETS

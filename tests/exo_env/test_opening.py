"""The compiled opening of an episode against the declarations it stands for, and what it says where it fails."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from dms_core.errors import InputError, SimulationError
from exo_env import opening
from exo_env.claims import AREAS, areas_of, claim
from exo_env.control_period import PLANT
from exo_env.distributions import Draws, distribution
from exo_env.jit import compiled
from exo_env.lift_env import ElbowLiftEnv
from exo_env.motor_command import SETTLED, InternalModel, plan_course
from exo_env.opening import FOUND, GAPING, NO_RATES, OUT_OF_REACH, UNSETTLED
from exo_env.patient import FIELDS, Patient
from exo_env.population import population
from exo_env.repetition import Repetition, Repetitions, put_pieces
from exo_env.rig import PLANNING


@pytest.fixture(scope="module")
def env():
    found = ElbowLiftEnv(patient="evaluation", repetitions=2)
    found.reset(seed=5)
    return found


@pytest.mark.parametrize("seed", range(20))
def test_pieces_are_those_of_the_declared_signal(seed):
    rng = np.random.default_rng(seed)
    count = 1 + seed % 4
    rest = {"rest": 0.0} if seed % 5 == 0 else {}
    movement = Repetitions().sample(rng).model_copy(update={"count": count, "every": float(seed % 3) * 3.0, **rest})
    t, c = np.full(4 * count + 1, np.nan), np.full((4 * count + 1, 6), np.nan)
    put_pieces(movement.row(), t, c)
    wanted = movement.signal.pieces()
    n = len(wanted.t)
    # Sums of a dozen times in another order.
    np.testing.assert_allclose(t[:n], wanted.t, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(c[:n], wanted.c, rtol=1e-11, atol=1e-15)
    assert (t[n:] == t[n - 1]).all() and (c[n:] == c[n - 1]).all()


SPECS = (
    1.25, {"uniform": [-1.0, 3.0]}, {"log_uniform": [0.01, 4.0]}, {"choice": [1.0, 2.0, 5.0], "weights": [1, 0, 3]},
    {"normal": {"mean": 0.4, "deviation": 0.3, "low": 0.0, "high": 1.0}},
)  # fmt: skip


def test_draws_are_the_quantiles_of_each_distribution():
    spreads = [distribution(spec) for spec in SPECS]
    draws, found, wanted = Draws(spreads), np.random.default_rng(3), np.random.default_rng(3)
    for _ in range(200):
        x = draws.sample(found)
        y = [d.quantile(wanted.random()) for d in spreads]
        np.testing.assert_allclose(x, y, rtol=1e-14)


def test_rows_give_patients_and_movements_back():
    patient = population("evaluation").sample(np.random.default_rng(1)).changed(sex="female")
    assert Patient.of_row(patient.row()) == patient and len(patient.row()) == len(FIELDS)
    movement = Repetition(start_deg=30.0, amplitude_deg=50.0, rest=0.1, count=3, every=7.0)
    assert Repetition.of_row(movement.row()) == movement


def test_the_command_is_that_of_the_internal_model(env):
    """Planned on a table of its own, over the whole episode and to more digits."""
    episode = env.episode
    patient, machine = episode.patient, env.rig.machine
    known = InternalModel.of(episode.arm, machine, patient.expected_load * episode.load)
    times = np.arange(round(env.duration / PLANNING) + 1) * PLANNING
    planned = plan_course(known, times, episode.repetition.course(times)).activations
    wanted = np.array([np.interp(env.rig.times, times, column) for column in planned.T]).T
    # Both iterations end within SETTLED of the same solution.
    np.testing.assert_allclose(env.rig.plant.wanted, wanted, atol=2.0 * SETTLED)


@pytest.mark.parametrize(
    ("code", "error", "sentence"),
    [
        (UNSETTLED, SimulationError, "motor command does not settle: .* may still be wrong by 0.5; below 0.0001"),
        (NO_RATES, SimulationError, r"\(at the start of an episode\)"),
        (GAPING, SimulationError, "joints stay open by 0.25"),
    ],
)
def test_an_opening_that_fails_says_why(env, code, error, sentence):
    found = env.rig.setting.values.found
    found[FOUND.left], found[FOUND.gap] = 0.5, 0.25
    with pytest.raises(error, match=sentence):
        env.rig.opened(code)


def test_a_pulley_within_reach_is_refused():
    env = ElbowLiftEnv()
    env.reset(seed=0)
    rig = env.rig
    setting = rig.setting.values
    near = tuple(float(x) for x in setting.elbow + (0.0, -0.2, 0.0))
    rig.machine, setting.low_pulley[:] = rig.machine.changed(low_pulley=near), near
    env.prepare(0)
    code = rig.open()
    assert code == OUT_OF_REACH
    with pytest.raises(InputError, match="low_pulley = .* from the elbow, and the handle reaches"):
        env.opened(code)


def test_a_start_that_does_not_close_is_seen(env):
    """Forearm and device in each other's place."""
    env.prepare(7)
    places = env.rig.setting.values.places
    places[0], places[1] = places[1], places[0]
    try:
        code = env.rig.open()
    finally:
        places[0], places[1] = places[1], places[0]
    assert code in (GAPING, NO_RATES)
    with pytest.raises(SimulationError, match="start of an episode"):
        env.opened(code)
    env.reset(seed=5)


def test_a_number_that_is_none_stops_an_opening(env):
    env.prepare(8)
    env.rig.setting.values.patient[FIELDS.index("expected_load")] = np.nan
    code = env.rig.open()
    assert code == UNSETTLED
    with pytest.raises(SimulationError, match="does not settle"):
        env.opened(code)
    env.reset(seed=5)


@compiled(nogil=True)
def _claims(counter, taken, n):
    for _ in range(n):
        taken[claim(counter)] += 1


def test_no_two_threads_claim_the_same():
    n = 200_000
    counter, taken = np.zeros(1, np.int64), np.zeros(4 * n, np.int64)
    _claims(np.zeros(1, np.int64), np.zeros(1, np.int64), 1)
    with ThreadPoolExecutor(4) as pool:
        for job in [pool.submit(_claims, counter, taken, n) for _ in range(4)]:
            job.result()
    assert counter[0] == 4 * n and (taken == 1).all()


def test_areas_hold_every_array_but_those_left_out(env):
    areas = areas_of(env.packed, ("noise",))
    assert areas.shape == (AREAS, 2)
    plant = env.rig.plant

    def within(x):
        first = x.ctypes.data
        return ((areas[:, 0] <= first) & (first + x.nbytes <= areas.sum(axis=1))).any()

    assert within(plant.effort) and within(env.rig.world.state.newton_values) and within(plant.wanted)
    assert not within(plant.noise)
    assert PLANT._fields == type(plant)._fields and opening.SETTING._fields == type(env.rig.setting.values)._fields

"""The compiled begin of an episode against the declarations it stands for, and what it says where it fails."""

from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import pytest

from dms_core.compiled.jit import compiled
from dms_core.errors import InputError, SimulationError
from exo_env.envs.elbow_lift import ElbowLiftEnv, ElbowLiftVectorEnv
from exo_env.patient.distributions import Draws, distribution
from exo_env.patient.excitation.effort import TICK
from exo_env.patient.excitation.motor_command import SETTLED, InternalModel, plan_course
from exo_env.patient.patient import PATIENT, Patient, fields_of
from exo_env.patient.population import Population, population
from exo_env.streams import stream, uniform
from exo_env.tables import OUTCOME
from exo_env.tasks.movements.repetition import Repetition, Repetitions, put_pieces
from exo_env.traits import neutral_traits
from exo_env.world.kernels.reset import GAPING, NO_RATES, PULLEY_IN_REACH, UNSETTLED
from exo_env.world.kernels.rest_pose import MOVING
from exo_env.world.work_sharing import areas_of, claim
from exo_env.world.world import PLANNING


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
    drawn = Repetition.of_row([*Repetitions().draw(np.uint64(rng.integers(2**63)), 6.0)])
    movement = drawn.model_copy(update={"count": count, "every": float(seed % 3) * 3.0, **rest})
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
    {"normal": {"mean": 0.4, "deviation": 0.3, "low": 0.0, "high": 1.0}}, {"uniform": [5.0, 6.0]},
    {"normal": {"mean": 9.0, "deviation": 2.0, "low": 8.0, "high": 20.0}},
)  # fmt: skip


def test_draws_are_the_quantiles_of_each_distribution():
    spreads = {f"number.{k}": distribution(spec) for k, spec in enumerate(SPECS)}
    draws = Draws(spreads)
    for key in map(np.uint64, range(200)):
        wanted = [d.quantile(uniform(key, stream(name), 0)) for name, d in spreads.items()]
        # Quantiles of the normal distribution are those of scipy to 15 digits, added to a mean of order 1.
        np.testing.assert_allclose(draws.sample(key), wanted, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("name", ["stroke_mild", "evaluation"])
def test_drawn_patients_are_the_quantiles_of_each_field(name):
    found, key = population(name), np.uint64(2)
    names = {field: field.replace("body_mass_index", "body_mass") for field in found.distributions}
    wanted = {f: d.quantile(uniform(key, stream(f"patient.{names[f]}"), 0)) for f, d in found.distributions.items()}
    if "body_mass_index" in wanted:
        wanted["body_mass"] = wanted.pop("body_mass_index") * wanted["height"] ** 2
    # Traits that a file need not name are those of a healthy subject.
    wanted = {field: getattr(Patient(), field) for field in neutral_traits(Patient)} | wanted
    for field, x in fields_of(found.draw(key)).items():
        assert x == (wanted[field] if isinstance(x, str) else pytest.approx(wanted[field], rel=1e-14)), field


def test_choices_are_checked_by_their_extremes_in_any_order():
    with pytest.raises(InputError, match=r"lead to 130.0 deg, expected at most 100.0 deg"):
        Repetitions(start_deg={"choice": [25.0, 60.0]}, amplitude_deg={"choice": [70.0, 30.0]})
    given = {**population("stroke_mild").fields, "body_mass_index": {"choice": [25.0, 5.0, 26.0]}}
    with pytest.raises(InputError, match="body_mass_index reaches 5.0"):
        Population(fields=given)


def test_rows_give_patients_and_movements_back():
    patient = population("evaluation").sample(np.random.default_rng(1)).changed(sex="female")
    assert Patient.of_row(patient.row()) == patient and len(patient.row()) == len(PATIENT)
    movement = Repetition(start_deg=30.0, amplitude_deg=50.0, rest=0.1, count=3, every=7.0)
    assert Repetition.of_row(movement.row()) == movement


def test_the_command_is_that_of_the_internal_model(env):
    """Planned on a table of its own, over the whole episode and to more digits."""
    episode = env.episode
    patient, machine = episode.patient, env.world.machine
    known = InternalModel.of(episode.arm, machine, patient.expected_load * episode.load)
    times = np.arange(round(env.duration / PLANNING) + 1) * PLANNING
    repetition = Repetition.of_row(episode.movement)
    planned = plan_course(known, times, repetition.course(times)).activations
    ticks = TICK * np.arange(len(env.world.tables.patient.wanted))
    wanted = np.array([np.interp(ticks, times, column) for column in planned.T]).T
    # Both iterations end within SETTLED of the same solution.
    np.testing.assert_allclose(env.world.tables.patient.wanted, wanted, atol=2.0 * SETTLED)
    np.testing.assert_allclose(env.world.tables.patient.course, repetition.course(ticks), atol=1e-12)


@pytest.mark.parametrize(
    ("code", "error", "sentence"),
    [
        (
            UNSETTLED,
            SimulationError,
            "motor command does not settle: .* may still be wrong by 0.5, expected less than 0.0001",
        ),
        (GAPING, SimulationError, "joints stay open by 0.25"),
    ],
)
def test_a_begin_that_fails_says_why(env, code, error, sentence):
    outcome = env.world.tables.outcome
    outcome[OUTCOME.left], outcome[OUTCOME.gap] = 0.5, 0.25
    with pytest.raises(error, match=sentence):
        env.world.begun(code)


def test_without_accelerations_there_is_no_episode(env, monkeypatch):
    monkeypatch.setattr(type(env.world.dynamics), "reorder", lambda self: False)
    with pytest.raises(SimulationError, match=r"\(at the start of an episode\)"):
        env.world.begun(NO_RATES)


@pytest.mark.parametrize("seed", range(4))
def test_a_straight_elbow_wants_other_orders_of_elimination(seed):
    """At 0 deg, where those of the template have a pivot of rounding, alone as in a batch."""
    settings, options = {"patient": "mixed"}, {"initial_angle_deg": 0.0}
    env, batch = ElbowLiftEnv(**settings), ElbowLiftVectorEnv(2, threads=2, **settings)
    observation, info = env.reset(seed=seed, options=options)
    assert info["initial_angle_deg"] == pytest.approx(0.0, abs=1e-9)
    observations, _ = batch.reset(seed=[9, seed], options=options)
    np.testing.assert_array_equal(observations[1], observation)
    action = np.array([-0.4, -1.0])
    for _ in range(3):
        observation, *_ = env.step(action)
        observations, *_ = batch.step(np.array([action, action]))
    np.testing.assert_array_equal(observations[1], observation)
    batch.close()


def test_what_an_episode_began_with_is_told_later_too(env):
    _, told = env.reset(seed=5)
    for _ in range(30):
        env.step(np.array([1.0, -1.0]))
    assert env.start_info() == told
    env.reset(seed=5)
    with pytest.raises(gymnasium.error.ResetNeeded):
        ElbowLiftEnv().start_info()


def test_an_unknown_option_draws_nothing(env):
    env.reset(seed=3)
    wanted = env.reset()[1]
    env.reset(seed=3)
    with pytest.raises(InputError, match="'typo' is unknown"):
        env.reset(options={"typo": 1})
    assert env.reset()[1] == wanted


def test_a_pulley_within_reach_is_refused():
    env = ElbowLiftEnv()
    env.reset(seed=0)
    world = env.world
    near = tuple(float(x) for x in world.tables.scaling.elbow + (0.0, -0.2, 0.0))
    world.machine, world.tables.subject.low_pulley[:] = world.machine.changed(low_pulley=near), near
    env.prepare(0)
    code = world.begin()
    assert code == PULLEY_IN_REACH
    with pytest.raises(InputError, match="low_pulley = .* from the elbow, and the handle reaches"):
        env.begun(code)


def test_a_start_that_does_not_close_is_seen(env):
    """Forearm and device in each other's place."""
    env.prepare(7)
    places, pair = env.world.tables.rest.places, [MOVING.forearm, MOVING.lower_link]
    places[pair] = places[pair[::-1]]
    try:
        code = env.world.begin()
    finally:
        places[pair] = places[pair[::-1]]
    assert code in (GAPING, NO_RATES)
    with pytest.raises(SimulationError, match="start of an episode"):
        env.begun(code)
    env.reset(seed=5)


def test_a_number_that_is_none_stops_a_begin(env):
    env.prepare(8)
    env.world.tables.draw.patient[PATIENT.expected_load] = np.nan
    code = env.world.begin()
    assert code == UNSETTLED
    with pytest.raises(SimulationError, match="does not settle"):
        env.begun(code)
    env.reset(seed=5)


@pytest.mark.parametrize("table", ["muscles", "points"])
def test_a_command_of_numbers_that_are_none_does_not_settle(env, table):
    known = InternalModel.of(env.episode.arm, env.world.machine, 1.0)
    numbers = getattr(known.arm, table).copy()
    numbers[1, 0] = np.nan
    times = np.arange(20) * PLANNING
    with pytest.raises(SimulationError, match="does not settle"):
        plan_course(
            InternalModel(known.arm._replace(**{table: numbers}), known.load, known.muscles),
            times,
            Repetition().course(times),
        )


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


def test_areas_hold_the_arrays_but_those_left_out(env):
    areas = areas_of(env.packed, ("noise",))
    tables = env.world.tables

    def within(x):
        first = x.ctypes.data
        return ((areas[:, 0] <= first) & (first + x.nbytes <= areas.sum(axis=1))).any()

    assert within(tables.scaling.coefficients) and within(env.world.dynamics.state.newton_values)
    # Small arrays that lie apart are left to be: where they lie is up to the allocator.
    held = [x.nbytes for x in arrays_of(tables) if within(x)]
    assert sum(held) > 0.9 * sum(x.nbytes for x in arrays_of(tables) if x is not tables.observer.noise)
    assert not within(tables.observer.noise)


def arrays_of(tables):
    """All arrays of tables within tables."""
    for x in tables:
        if isinstance(x, np.ndarray):
            yield x
        elif isinstance(x, tuple):
            yield from arrays_of(x)


@pytest.mark.parametrize(
    "worn", [None, {"shift": [0.01, 0.01, 0.0]}, {"shift": [0.0, 0.0, 0.0], "tilt_deg": [4.0, 0.0]}]
)
def test_the_start_holds_a_limp_arm_however_the_device_is_worn(worn):
    limp = {"maximum_activation_flexors": 0.0, "maximum_activation_extensors": 0.0}
    env = ElbowLiftEnv(misalignment=worn, patient=limp, load=2.0)
    env.reset(seed=1)
    held, most = env.world.tables.drive.commands.copy(), np.array(env.drive.max_tension)
    env.step(2.0 * held / most - 1.0)
    # The device's links turn in a plane that leans against gravity, which is left out: 2e-4 rad/s in a period.
    assert abs(env.readings()["elbow_angle.rate"]) < 2e-3

"""The reduced filter of the elbow against the nominal equations, against the full filter, and against the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core import Model, SolverOptions, World
from exo_env.ecosystem.cuff import DAMPING, STIFFNESS
from exo_env.ecosystem.person import HEIGHT_0, MASS_0
from exo_env.envs.hidden_intent import HiddenIntentEnv
from exo_env.envs.settings import DEFAULT_LOAD
from exo_env.estimation import ElbowEstimator, NominalElbow
from exo_env.estimation.elbow_estimator import ANGLE, GUIDE_FORCE, RATE
from exo_env.estimation.nominal_elbow import GRIP, NET
from exo_env.estimation.reduced_elbow import USUAL_LOAD, ReducedTuning, reduced_elbow
from exo_env.estimation.reduced_filter import (
    BELIEF,
    CURVES,
    ESTIMATE,
    FAST,
    LEARNT,
    NUMBERS,
    SLOW,
    _conclude,
    begin_estimates,
    step_estimates,
)

NOISE = (math.hypot(2e-4, 1.5e-3 / math.sqrt(12.0)), 0.02, 0.5)
"""That of the full filter: angle [rad], rate [rad/s], cuff [N]."""


class Filter:
    """The compiled filter alone."""

    def __init__(self, period, noise=NOISE, tuning=None):
        self.elbow = reduced_elbow(HiddenIntentEnv().ecosystem, period, noise, tuning=tuning)
        self.mean, self.fast, self.slow = np.zeros(len(BELIEF)), np.zeros((FAST, FAST)), np.zeros((SLOW, SLOW))
        self.learnt, self.out = np.zeros(len(LEARNT)), np.zeros(len(ESTIMATE))

    def take(self, readings, first=False):
        """Estimates behind readings of angle, rate and force."""
        kernel = begin_estimates if first else step_estimates
        kernel(
            np.array(readings, float), *self.elbow, self.mean, self.fast, self.slow, self.learnt, self.out
        )  # fmt: skip
        return self.out.copy()

    def run(self, rows):
        """Estimates over a record, shape (n, 10)."""
        return np.array([self.take(row, k == 0) for k, row in enumerate(rows)])


@pytest.fixture(scope="module")
def world() -> World:
    """The nominal elbow as equations."""
    return World(Model(NominalElbow().system()), SolverOptions(rtol=1e-7))


@pytest.mark.parametrize("net, grip", [(1.0, 0.0), (0.0, 1.0), (-0.7, 2.0)])
def test_the_nominal_equations_have_these_inertias_and_this_lever(world, net, grip):
    n = dict(zip(NUMBERS._fields, Filter(0.02).elbow.numbers.tolist(), strict=True))
    names = [name for name, _ in world.model.layout.outputs]
    world.set_input(NET, net)
    world.set_input(GRIP, grip)
    world.settle()
    seen = dict(zip(names, world.read(), strict=True))
    # The same equations, solved with a sparse factorisation: rounding only.
    assert seen["exo_angle.acceleration"] == pytest.approx(net * n["by_inertia"], rel=1e-9, abs=1e-12)
    assert n["lever"] * seen[GUIDE_FORCE] == pytest.approx(grip - n["link_share"] * net, rel=1e-9, abs=1e-12)
    # others = I_f theta'' - F d = net - grip
    arm = n["arm_share"] / n["by_inertia"] * seen["exo_angle.acceleration"] - n["lever"] * seen[GUIDE_FORCE]
    assert arm == pytest.approx(net - grip, rel=1e-9)


def test_the_exact_solution_over_a_period():
    """Many short periods are one long one."""
    short, long = (reduced_elbow(HiddenIntentEnv().ecosystem, T, NOISE) for T in (0.002, 0.02))
    x, P = np.array([0.0, 0.0, 1.0]), np.zeros((3, 3))
    n = NUMBERS
    A = np.array(
        [[1.0, 0.002, short.numbers[n.angle_by_net]], [0.0, 1.0, short.numbers[n.rate_by_net]],
         [0.0, 0.0, short.numbers[n.net_keep]]]
    )  # fmt: skip
    for _ in range(10):
        x, P = A @ x, A @ P @ A.T + short.disturbance
    assert x == pytest.approx(long.numbers[[n.angle_by_net, n.rate_by_net, n.net_keep]], rel=1e-10)
    np.testing.assert_allclose(P, long.disturbance, rtol=1e-8)


def record(world, period, steps, rng):
    """Noisy readings of the nominal elbow under a push and a rest that move, and the moment of others, true."""
    names = [name for name, _ in world.model.layout.outputs]
    rows, moments = [], []
    for k in range(steps):
        push, rest = 2.0 * np.sin(0.8 * period * k), 0.2 * np.sin(9.0 * period * k)
        world.set_input(GRIP, -push)
        world.set_input(NET, rest)
        world.advance(period * (k + 1))
        seen = dict(zip(names, world.read(), strict=True))
        rows.append([seen[x] + s * rng.normal() for x, s in zip((ANGLE, RATE, GUIDE_FORCE), NOISE, strict=True)])
        moments.append(rest + push)
    return np.array(rows), np.array(moments)


@pytest.mark.parametrize("period", [0.002, 0.02])
def test_full_and_reduced_filter_agree(period):
    world = World(Model(NominalElbow().system()), SolverOptions(rtol=1e-7))
    world.settle()
    rows, moments = record(world, period, 250, np.random.default_rng(2))
    full = ElbowEstimator(NominalElbow(inertia_doubt=0.0), period)
    reduced = Filter(period, tuning=ReducedTuning(net_time=0.05, least=0.05, inertia_doubt=0.0)).run(rows)
    others = []
    for k, row in enumerate(rows):
        readings = dict(zip((ANGLE, RATE, GUIDE_FORCE), row.tolist(), strict=True))
        found = full.reset(readings) if k == 0 else full.update(readings)
        others.append((found.others, found.deviation))
    late, (a, s), b = round(0.3 * len(rows)), np.array(others).T, reduced[:, ESTIMATE.others_moment]
    apart = np.sqrt(np.mean(np.square(a - b)[late:]))
    # One implicit step of the full filter errs by period / net_time in what net does within a period.
    assert apart < (0.1 if period < 0.01 else 0.5) * np.mean(s[late:])
    assert np.sqrt(np.mean(np.square(b - moments)[late:])) < 1.2 * np.sqrt(np.mean(np.square(a - moments)[late:]))
    assert reduced[-1, ESTIMATE.others_moment_deviation] == pytest.approx(s[-1], rel=0.1 if period < 0.01 else 0.3)


def test_an_average_patient_with_a_known_load_is_known():
    """The truth's own body, load told, little noise: what is left is what the filter cannot follow."""
    average = {"body_mass": MASS_0, "height": HEIGHT_0, "sex": "male"}
    env = HiddenIntentEnv(
        observation=["device", "estimated"], load=1.0, reference={"load_changes": 0.0}, noise=False, patient=average
    )
    env.reset(seed=4)
    rows, truth = [], []
    for _ in range(300):
        env.step(np.array([0.1, -1.0]))
        rows.append(env.world.tables.estimator.sensed.copy())
        truth.append(env.readout.number("muscle_moment"))
    told = ReducedTuning(load=1.0, load_deviation=1e-3, inertia_doubt=0.0, weight_doubt=0.0)
    found = Filter(0.02, (1e-5, 1e-3, 0.05), told).run(rows)[50:, ESTIMATE.muscle_moment]
    error = np.sqrt(np.mean(np.square(found - np.array(truth)[50:])))
    # The handle swings on its own, and the rate at which the load is lifted has a moment that is left out.
    assert error < 0.03 * np.sqrt(np.mean(np.square(truth)))


def test_the_load_cannot_be_told_and_the_deviations_say_so():
    """A device that holds more and more: the load's deviation stays near its prior's, and the muscles' has it."""
    one = Filter(0.02)
    one.take((1.0, 0.0, 20.0), first=True)
    for k in range(500):
        found = one.take((1.0, 0.0, 20.0 + 0.02 * k))
    prior, kilogram = ReducedTuning().load_deviation, one.elbow.curves[29, 1]
    assert 0.95 * prior < found[ESTIMATE.load_deviation] <= prior
    assert found[ESTIMATE.muscle_moment_deviation] > 0.9 * kilogram * prior
    assert found[ESTIMATE.others_moment_deviation] < 0.2 * found[ESTIMATE.muscle_moment_deviation]


def test_what_is_intended_is_what_is_new():
    """Nothing at rest, whoever carries; a moment that comes within a moment; which is then a habit."""
    one, push = Filter(0.02), 12.0
    one.take((1.0, 0.0, 20.0), first=True)
    for _ in range(200):
        rest = one.take((1.0, 0.0, 20.0))
    assert abs(rest[ESTIMATE.intended_moment]) < 0.15
    for _ in range(10):
        begun = one.take((1.0, 0.0, 20.0 - push))
    assert begun[ESTIMATE.intended_moment] > 0.35 * 0.16 * push
    for _ in range(2000):
        late = one.take((1.0, 0.0, 20.0 - push))
    assert abs(late[ESTIMATE.intended_moment]) < 0.3 * begun[ESTIMATE.intended_moment]


PLACES = {"mean": len(BELIEF), "fast": FAST * FAST, "slow": SLOW * SLOW, "learnt": LEARNT.lost}
"""What the filter keeps, and how many numbers of it can be broken: the count of new beginnings is none."""


@pytest.mark.parametrize("broken", [np.nan, np.inf, -1e300])
@pytest.mark.parametrize("what, place", [(what, k) for what, n in PLACES.items() for k in range(n)])
def test_a_filter_that_is_lost_begins_anew(what, place, broken):
    one = Filter(0.02)
    one.take((0.8, 0.0, 3.0), first=True)
    getattr(one, what).flat[place] = broken
    found = one.take((0.8, 0.0, 3.0))
    assert np.isfinite(found).all() and np.isfinite(one.fast).all() and np.isfinite(one.slow).all()
    for _ in range(2):
        again = one.take((0.8, 0.0, 3.0))
    assert abs(again[ESTIMATE.others_moment] + 0.16 * 3.0) < 0.1


@pytest.mark.parametrize("broken", [np.nan, np.inf])
@pytest.mark.parametrize("what, place", [(what, k) for what in ("mean", "fast", "slow") for k in range(PLACES[what])])
def test_a_belief_that_is_not_finite_reads_no_table(what, place, broken):
    """In Python, where an angle that is no number can be no index, and in a table that must not be read at all."""
    one = Filter(0.02)
    one.take((0.8, 0.0, 3.0), first=True)
    getattr(one, what).flat[place] = broken
    numbers, nothing = one.elbow.numbers, np.zeros((0, len(CURVES)))
    assert not _conclude.py_func(numbers, nothing, one.mean, one.fast, one.slow, one.out)
    assert np.isnan(one.out).all()


NO_NUMBERS = [np.nan, np.inf, -np.inf]


@pytest.mark.parametrize("reading", NO_NUMBERS)
@pytest.mark.parametrize("place", range(3))
def test_a_reading_that_is_no_number_is_a_missing_one(place, reading):
    """All estimates go on, the deviation of what it would have told grows, and nothing else is lost."""
    one, other, broken = Filter(0.02), Filter(0.02), np.array([0.8, 0.0, 3.0])
    for x in (one, other):
        for k in range(50):
            x.take((0.8, 0.0, 3.0), k == 0)
    broken[place] = reading
    known, belief = one.take((0.8, 0.0, 3.0)), one.fast.copy()
    for _ in range(25):
        found = other.take(broken)
        assert np.isfinite(found).all() and np.isfinite(other.fast).all()
    told = (0, 1, 3)[place]
    assert other.fast[told, told] > 1.2 * belief[told, told]
    assert other.learnt[LEARNT.lost] == 0.0
    assert abs(found[ESTIMATE.others_moment] - known[ESTIMATE.others_moment]) < found[ESTIMATE.others_moment_deviation]
    for _ in range(100):
        again = other.take((0.8, 0.0, 3.0))
    assert again[ESTIMATE.others_moment] == pytest.approx(known[ESTIMATE.others_moment], abs=0.01)


def test_readings_that_are_all_missing_are_predicted_only():
    """As the exact solution says: nothing is corrected, so that the mean moves on and the covariance spreads."""
    one = Filter(0.02)
    for k in range(20):
        one.take((0.8, 0.3, 3.0), k == 0)
    mean, power, n = one.mean.copy(), one.learnt[LEARNT.net_power], one.elbow.numbers
    P, net = one.fast.copy(), mean[2]
    one.take((np.nan,) * 3)
    assert one.mean[0] == pytest.approx(mean[0] + 0.02 * mean[1] + n[NUMBERS.angle_by_net] * net, rel=1e-14)
    assert one.mean[3] == mean[3]
    walk = n[NUMBERS.walk] + n[NUMBERS.walk_share] * math.sqrt(power)
    assert one.fast[3, 3] == pytest.approx(P[3, 3] + 0.02 * walk**2, rel=1e-12)
    for _ in range(5000):
        assert np.isfinite(one.take((np.nan,) * 3)).all()


@pytest.mark.parametrize("reading", [*NO_NUMBERS, 1e200, -1e308])
@pytest.mark.parametrize("places", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_start_without_some_reading_is_a_guess(places, reading):
    """Also where a reading is finite, but nothing that it leads to."""
    one, broken = Filter(0.02), np.array([0.8, 0.0, 3.0])
    broken[list(places)] = reading
    first = one.take(broken, first=True)
    assert np.isfinite(first).all() and np.isfinite(one.fast).all()
    for _ in range(200):
        found = one.take((0.8, 0.0, 3.0))
        assert np.isfinite(found).all()
    assert abs(found[ESTIMATE.others_moment] + 0.16 * 3.0) < 0.1
    assert abs(one.mean[0] - 0.8) < 0.01


def test_what_a_device_knows_of_itself_widens_its_deviation():
    """A rate of readings below 50 Hz, and a cuff that gives way; in a rigid guide at 50 Hz and more nothing changes."""
    place, doubt = NUMBERS.inertia_doubt, ReducedTuning().inertia_doubt

    def found(period, **changes):
        elbow = reduced_elbow(HiddenIntentEnv(**changes).ecosystem, period, NOISE)
        return elbow.numbers[place]

    assert [found(T) for T in (0.02, 0.01, 0.001)] == [doubt] * 3
    assert doubt < found(0.05) < found(0.1) < found(0.2)
    soft = {"stiffness": [1850.0, *STIFFNESS[1:]], "damping": list(DAMPING)}
    assert doubt < found(0.02, cuff="compliant") < found(0.02, cuff=soft)
    ecosystem = HiddenIntentEnv(cuff="compliant").ecosystem
    share = Filter(0.02).elbow.numbers[NUMBERS.arm_share]
    forearm, d = ecosystem.changed(person={}).arm().inertia_about_elbow(), ecosystem.device.guide_distance
    part = forearm * (2.0 * math.pi * 6.0) ** 2 / (STIFFNESS[0] * d**2)
    assert found(0.02, cuff="compliant") == pytest.approx(math.hypot(doubt, part / share), rel=1e-12)


def test_the_usual_load_is_the_mean_of_what_is_drawn():
    assert ReducedTuning().load == USUAL_LOAD == np.mean(DEFAULT_LOAD["uniform"])


@pytest.mark.parametrize("reading", [1e6, -1e6])
def test_readings_beyond_all_reason_leave_numbers_finite(reading):
    one = Filter(0.02)
    one.take((reading, reading, reading), first=True)
    for k in range(50):
        found = one.take((reading, -reading, reading * (-1) ** k))
        assert np.isfinite(found).all()
    for _ in range(200):
        found = one.take((0.8, 0.0, 3.0))
    assert abs(found[ESTIMATE.others_moment] + 0.16 * 3.0) < 0.1

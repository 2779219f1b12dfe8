"""The smoothed objectives: their equation, their derivative, and how near they are to a peak."""

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.design.comparison import QUANTITIES, quantities
from exo_env.design.gradient import INTERVAL, Trial
from exo_env.design.objectives import OBJECTIVES, PEAK, objective
from exo_env.design.wearer import LEAST_SAMPLES, exercise_times
from exo_env.paper.scenarios import Exercise
from tests.exo_env.design.cases import EXERCISE, OPTIONS, few, space

ROPES = ("agonist", "antagonist")


@pytest.mark.parametrize("name", OBJECTIVES)
def test_the_derivative_by_readings(name):
    lowered = OBJECTIVES[name]
    readings = np.random.default_rng(0).uniform(1.0, 2.0, len(lowered.outputs(ROPES, [0.1, 0.2, 0.3])))
    slope = lowered.of(ROPES, readings)[1]
    moves = 1e-5 * np.eye(len(readings))
    expected = [(lowered.of(ROPES, readings + m)[0] - lowered.of(ROPES, readings - m)[0]) / 2e-5 for m in moves]
    # Central differences of functions of order 1 with p = 20: the third derivative is below p^2.
    assert slope == pytest.approx(np.array(expected), abs=1e-7)


def test_a_peak_is_approached_from_below_and_power_is_the_root_of_the_mean_square():
    tension = 100.0 * np.exp(-(np.linspace(-2.0, 2.0, 40) ** 2))
    readings = np.column_stack([tension, 0.1 * tension]).ravel()
    found = objective("peak_tension").of(ROPES, readings)[0]
    assert found == pytest.approx(((tension**20).sum() * (1.0 + 0.1**20) / 40.0) ** 0.05)
    assert 0.85 * tension.max() < found < tension.max()
    power = objective("motor_power").of(("agonist",), np.array([2.0, -3.0, 4.0, 0.5]))[0]
    assert power == pytest.approx(np.sqrt((6.0**2 + 2.0**2) / 2.0))
    reaction = objective("elbow_reaction").of(ROPES, np.tile([3.0, 0.0, 4.0], 5))[0]
    assert reaction == pytest.approx(5.0)


def test_large_forces_do_not_overflow_and_none_are_no_error():
    assert objective("peak_tension").of(("agonist",), np.full(3, 1e30))[0] == pytest.approx(1e30)
    value, slope = objective("elbow_reaction").of(ROPES, np.zeros(6))
    assert value == 0.0 and not slope.any()


def test_a_short_exercise_has_as_many_samples_as_a_long_one_and_none_is_looked_at_more_rarely():
    def times(duration):
        return exercise_times(Exercise(**{**EXERCISE, "duration": duration}), INTERVAL)

    assert len(times(2.6)) == 52 and len(times(2.62)) == 53 and len(times(0.2)) == LEAST_SAMPLES
    assert times(0.2)[0] == pytest.approx(0.005) and times(0.2)[-1] == 0.2


def test_objective_and_table_see_the_same_run():
    """With the same samples, power is the same up to what a run errs by, and a peak within the p-norm's bounds."""
    (wearer,), designs = few(1), space()
    trial, table = Trial(wearer, designs, designs.start, OPTIONS), quantities(wearer, designs.today, OPTIONS)
    rows = dict(zip(QUANTITIES, table, strict=True))
    assert trial.value(OBJECTIVES["motor_power"]) == pytest.approx(rows["RMS motor power"], rel=1e-3)
    assert trial.off == pytest.approx(rows["rms tracking error"], rel=1e-3)
    assert trial.tension == pytest.approx(rows["peak rope tension"], rel=1e-3)
    for name, row in (("peak_tension", "peak rope tension"), ("elbow_reaction", "peak elbow reaction")):
        # Two ropes that pull alike may be above the peak by the root.
        assert LEAST_SAMPLES ** (-1.0 / PEAK) < trial.value(OBJECTIVES[name]) / rows[row] < 2.0 ** (1.0 / PEAK)


def test_an_unknown_objective():
    with pytest.raises(InputError, match="objective = 'comfort': expected one of .*elbow_reaction"):
        objective("comfort")

"""The exosuit study in simulation: a few people here, all of them with `slow`."""

import numpy as np
import pytest

from exo_env.paper.exosuit import PUBLISHED, SUIT_LAG, Wearers, lag_behind


def test_the_lag_is_that_of_a_shifted_reference():
    times = 0.02 * np.arange(400)
    reference = np.sin(times) + 0.3 * np.sin(2.7 * times)
    late = np.interp(times - 0.24, times, reference)
    assert lag_behind(reference, late, 100, 0.02) == pytest.approx(0.24, abs=1e-12)
    assert lag_behind(reference, reference, 100, 0.02) == 0.0


def test_compensation_relieves_the_muscles_and_a_lag_takes_some_of_it():
    """One person, the fastest moves, two of them: half of the torque is gone, and less where the help is late."""
    one = Wearers(people=1, repetitions=2, rates=(126.0,))
    ideal, late = one.trial(0, 126.0, 0.0, 1.0), one.trial(0, 126.0, SUIT_LAG, 1.0)
    alone = one.trial(0, 126.0, 0.0, 0.0)
    assert ideal.torque < late.torque < 0.7 * alone.torque
    # In a single person at this rate the biceps may give less with late help, which the arm lags behind.
    assert max(ideal.effort, late.effort) < 0.7 * alone.effort


@pytest.mark.slow
def test_the_study_comes_out_within_two_standard_errors():
    found = Wearers().compared(SUIT_LAG)
    for what, (mean, error) in PUBLISHED.items():
        assert abs(found[what] - mean) < 2.0 * error, (what, found[what])

"""Which curves of a panel are drawn, and which are told in words."""

import numpy as np

from exo_env.rendering.curves import Curve, difference, told, told_apart

TIMES = np.linspace(0.0, 1.0, 101)


def curve(name, values):
    return Curve(name, TIMES, values * np.ones(101))


def test_a_curve_on_another_one_is_told_with_how_far_it_is_off():
    ramp = 100.0 * TIMES
    first, near, far = curve("1", ramp), curve("2", ramp + 1.0), curve("3", ramp + 10.0)
    drawn, twins = told_apart([first, near, far])
    assert [c.name for c in drawn] == ["1", "3"]
    assert told(twins, "Nm") == "2 on 1 (at most 1 Nm apart)"


def test_a_short_jump_does_not_part_curves_but_is_in_the_words():
    jump = np.where(TIMES < 0.05, 30.0, 0.0)
    drawn, twins = told_apart([curve("1", 100.0 * TIMES), curve("2", 100.0 * TIMES + jump)])
    assert len(drawn) == 1 and told(twins, "N") == "2 on 1 (at most 30 N apart)"


def test_equal_curves_are_named_together():
    _, twins = told_apart([curve(name, 0.0) for name in "abc"])
    assert told(twins, "N") == "b and c on a (less than 0.01 N apart)"
    assert told([], "N") == ""


def test_the_span_of_the_axis_says_what_can_be_told_apart():
    ones = [curve("1", 0.0), curve("2", 1.0)]
    assert len(told_apart(ones)[0]) == 2 and len(told_apart(ones, span=100.0)[0]) == 1


def test_differences_last_as_long_as_both():
    short = Curve("short", TIMES[:51], np.full(51, 2.0))
    for one, other, sign in ((curve("1", 3.0), short, 1.0), (short, curve("1", 3.0), -1.0)):
        found = difference(one, other)
        assert found.times[-1] == 0.5 and np.array_equal(found.values, np.full(51, sign))
    # An episode that ended early is still compared over the time that it lived.
    assert len(told_apart([curve("1", 2.0), short, curve("3", 9.0)])[0]) == 2

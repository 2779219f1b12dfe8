"""Places of numbers by name, and the tables of all elements against them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from dms_core.model.places import numbers_at


class Spring(NamedTuple):
    point: int = 0
    stiffness: int = 3


SPRING = Spring()


def test_each_value_is_at_its_place():
    assert numbers_at(SPRING, point=np.array([1, 2, 3]), stiffness=4) == (1.0, 2.0, 3.0, 4.0)
    assert all(isinstance(x, float) for x in numbers_at(SPRING, point=(1, 2, 3), stiffness=4))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"point": (1.0, 2.0), "stiffness": 3.0}, "Expected 'stiffness' at place 3 of Spring, got place 2"),
        ({"point": (0.0,) * 4, "stiffness": 3.0}, "Expected 'stiffness' at place 3 of Spring, got place 4"),
        ({"point": (0.0,) * 3, "stiffness": 3.0, "damping": 1.0}, r"got \('damping',\) too"),
    ],
)
def test_a_table_that_does_not_fit_its_places_is_an_error(values, message):
    with pytest.raises(ValueError, match=message):
        numbers_at(SPRING, **values)

"""A device that does not do the exercise is refused: unit by unit, and in whole runs."""

import pytest

from dms_core.errors import SimulationError
from exo_env.design.acceptance import LAG, MOST_OFF, Acceptance
from exo_env.design.comparison import compared
from exo_env.design.objectives import OBJECTIVES
from exo_env.design.search import search
from exo_env.design.space import Design, DesignSpace
from exo_env.ecosystem.exoskeleton import Exoskeleton
from tests.exo_env.design.cases import OPTIONS, few, space

DEVICE = Exoskeleton.named("elbow")
LIFT = {"times": [0.0, 0.4], "angles_deg": [30.0, 70.0], "duration": 0.5, "proprioception": {}}
"""Far enough that an arm which stays behind is seen."""
DEAD = {"gains": {"kp": 0.0, "ki": 0.0, "kd": 0.0}}
"""A device that does nothing."""
WEAK = {"actuator": {"max_tension": 30.0}}
"""Motors that cannot lift the weight."""


@pytest.mark.parametrize(
    ("off", "tension", "message"),
    [
        (MOST_OFF + 0.1, 100.0, "patient 3: the elbow is 5.1 deg rms off .* Expected at most 5 deg"),
        (float("nan"), 100.0, "patient 3: the elbow is nan deg"),
        (0.3, 1499.5, "patient 3: a rope reaches 1499.5 N.* Expected less than 1499 N"),
    ],
)
def test_todays_device_has_to_do_the_exercise(off, tension, message):
    with pytest.raises(SimulationError, match=message):
        Acceptance().check("patient 3", DEVICE, off, tension)


def test_another_device_may_lag_a_little_more_than_todays_on_the_same_patient():
    acceptance = Acceptance()
    acceptance.check("patient 1", DEVICE, 1.0, 100.0)
    acceptance.check("patient 2", DEVICE, 0.1, 100.0)
    acceptance.check("patient 1", DEVICE, LAG - 0.01, 100.0)
    with pytest.raises(SimulationError, match="patient 2: the elbow is 0.5 deg .* Expected at most 0.2 deg, 2 times"):
        acceptance.check("patient 2", DEVICE, 0.5, 100.0)


@pytest.mark.parametrize(
    ("changes", "message"), [(DEAD, "patient 1: the elbow is .* deg rms off"), (WEAK, "patient 1: a rope reaches 30 N")]
)
def test_a_search_from_a_device_that_does_not_do_the_exercise_is_refused(changes, message):
    designs = DesignSpace(Design(DEVICE.changed(**changes)), {"guide_distance": (0.13, 0.19)})
    with pytest.raises(SimulationError, match=message):
        search(designs, few(1, exercise=LIFT), OBJECTIVES["motor_power"], OPTIONS, 1)


def test_the_table_tells_with_whom_the_exercise_is_not_done():
    said: list[str] = []
    compared("held out", few(1, exercise=LIFT), space().today, Design(DEVICE.changed(**DEAD)), OPTIONS, said.append)
    assert len(said) == 1 and said[0].startswith("in the found device: patient 1: the elbow is ")

"""Nobody who may be simulated pulls the weight into its pulley, where the rope's length has a kink."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.ecosystem.arm import Arm, Person
from exo_env.ecosystem.gym_machine import GymMachine, LoadedMachine
from exo_env.envs.elbow_lift import ElbowLiftEnv

MACHINE = GymMachine.from_config("gym_machine/pulley.yaml")
TALLEST = {"height": 2.3, "sex": "male", "body_mass": 90.0}


@pytest.mark.parametrize("person", [Person(**TALLEST), Person(height=1.0, sex="female"), Person()])
def test_the_machine_has_room_for_everybody(person):
    LoadedMachine(MACHINE, Arm(person), 0.5)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"high_pulley": (0.9, 1.0, 0.16)}, r"high_pulley = .* 0.7 m above weight_start = 0.3; the weight can rise by"),
        ({"low_pulley": (0.2, 0.2, 0.16)}, "low_pulley = .* from the elbow, and the handle reaches"),
    ],
)
def test_a_pulley_within_reach_is_refused(change, complaint):
    with pytest.raises(InputError, match=complaint):
        LoadedMachine(MACHINE.changed(**change), Arm(Person()), 0.5)


def test_the_tallest_arm_pulled_up_from_straight():
    """With a pulley 0.7 m above the start this run failed at 129 deg, where the weight ran into it."""
    limp = {"maximum_activation_flexors": 0.0, "maximum_activation_extensors": 0.0}
    env = ElbowLiftEnv(patient=TALLEST | limp, limits={"highest_deg": 142.0})
    env.reset(seed=0, options={"load": 0.5, "initial_angle_deg": 5.0})
    weight = env.episode.model.layout.names.index("weight.y")
    over, info = False, {}
    while not over:
        _, _, over, _, info = env.step(np.array([1.0, -1.0]))
    assert "outside -5 to 142 deg" in info["event"] and not info["solver_failed"]
    assert env.episode.world.state.q[weight] > 1.0

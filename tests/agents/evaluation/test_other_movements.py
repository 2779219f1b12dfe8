"""Evaluation where the patient repeats no lift: smoothness, which is of lifts and returns, is left out by name."""

import importlib
import shutil
from typing import Any, ClassVar

import numpy as np
import pytest
from gymnasium.envs.registration import register, registry

from agents.environment import ENVIRONMENT, make, make_vector
from agents.evaluation.comparison.evaluate import evaluate
from agents.evaluation.episodes.episode import judged, movement_of
from agents.evaluation.results.tables import left_out_lines
from agents.evaluation.search.upper_bound import tried_on
from agents.policies.baselines import policy
from dms_core.errors import InputError
from dms_core.files.config_files import configs
from exo_env.tasks.movements.movement import Stay
from exo_env.tasks.movements.repetition import Repetitions

HOLD, SWAY = "tests/HoldAtSixty-v0", "tests/Sway-v0"
SHORT = {"episode_duration": 0.4}


class StayOrSway(Stay):
    """A movement with a number that no repetition has."""

    sway_deg: Any = 2.0


@pytest.fixture(scope="module", autouse=True)
def registered(tmp_path_factory):
    """The task of examples/own_task.py, with its own movement and with another one."""
    # A copy: what numba keeps beside the example is of a module of another name.
    folder = tmp_path_factory.mktemp("example")
    shutil.copy(configs().parent / "examples" / "own_task.py", folder / "copied_own_task.py")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        example = importlib.import_module("copied_own_task")

    class Sway(example.HoldAtSixty):
        movement_type: ClassVar = StayOrSway

    class SwayEnv(example.HoldAtSixtyEnv):
        task_type: ClassVar = Sway

    register(id=HOLD, entry_point=example.HoldAtSixtyEnv, vector_entry_point=example.HoldAtSixtyVectorEnv)
    register(id=SWAY, entry_point=SwayEnv)
    yield
    for name in (HOLD, SWAY):
        del registry[name]


@pytest.mark.parametrize("environment", [HOLD, SWAY])
def test_there_is_no_smoothness_of_a_lift_that_never_was(environment):
    found = evaluate([policy("none")], "stroke_mild", 1, 0, environment=environment, **SHORT)
    assert found["left_out"] == {"smoothness_sparc": ["repetitions"]}
    assert left_out_lines(found) == [f"Left out: smoothness (SPARC); {environment} has no repetitions of a lift."]
    (one,) = found["policies"]["none"]["episodes"]
    measures = one["measures"]
    assert "smoothness_sparc" not in measures and {"reward.near", "tracking_rms_deg"} <= measures.keys()
    assert np.isfinite([x for name, x in measures.items() if not name.endswith("work_share")]).all()
    # What a training is watched by is measured in the same way.
    env = make(environment, patient="stroke_mild", **SHORT)
    (watched,) = judged(env, policy("none"), [one["seed"]])
    env.close()
    assert watched.keys() == measures.keys() and watched["return"] == measures["return"]


def test_an_upper_bound_says_what_it_needs():
    worlds = make_vector(HOLD, 1, action_mode="pid_setpoint", patient="stroke_mild", **SHORT)
    with pytest.raises(InputError, match=r"needs a movement of Repetitions; that of this environment is Stay\."):
        tried_on(worlds, 0, np.ones((1, 4)))
    worlds.close()


def test_repetitions_are_those_of_the_movement():
    env = make(ENVIRONMENT, patient="stroke_mild", repetitions=2)
    _, drawn = env.reset(seed=0, options={"reference": {"amplitude_deg": 50.0}})
    found, draw = movement_of(env, drawn), env.unwrapped.episode.draw
    # What is rebuilt from `info` is the row of numbers that the episode was made of, to the last bit.
    assert isinstance(env.unwrapped.movement, Repetitions) and found.row().tolist() == draw.movement.tolist()
    assert (found.count, found.amplitude_deg) == (2, 50.0)
    env.close()

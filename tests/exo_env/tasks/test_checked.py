"""What a task of one's own may declare wrongly, and the sentence that names the task, the culprit and what is right."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.drives.rope_tension import RopeTension
from exo_env.envs.base_env import AssistanceEnv
from exo_env.kernels import FIRST_EVENT, SOLVER, compiled, first_of, readings
from exo_env.tables import STATUS
from exo_env.tasks.elbow import elbow_readings, read_elbow
from exo_env.tasks.lift import LiftTask
from exo_env.tasks.movements.movement import Stay
from exo_env.tasks.observation.channels import Channel, Parts, Reading
from exo_env.tasks.task import Reported

PARTS = Parts(("flexor",), ("agonist", "antagonist"), ("agonist tension", "antagonist tension"))
NINE = tuple(f"action {k}" for k in range(9))


def made(more: tuple[Reading, ...] = (), groups: dict[str, list[Channel]] | None = None, **declared: Any) -> LiftTask:
    """A task like the built-in one with something more, or something else."""

    class Own(LiftTask):
        def declared_readings(self, parts):
            return [*super().declared_readings(parts), *more]

        def declared_groups(self, parts):
            return super().declared_groups(parts) if groups is None else groups

    for name, value in declared.items():
        setattr(Own, name, value)
    return Own(PARTS)


@pytest.mark.parametrize(
    ("reading", "complaint"),
    [
        (
            Reading("x", "-", ("a",), ("m", "n", "o")),
            r"sensors = \('m', 'n', 'o'\); expected none, .* its 1 components",
        ),
        (Reading("x", "-", ("a", "b"), ("m",)), "sensors = .* its 2 components"),
        (Reading("x", "-", ("a", "a")), "labels = .*different words"),
        (Reading("x", "-", ()), "labels = .*at least one"),
        (Reading("x", "-", "abc"), "labels = 'abc'"),  # type: ignore[arg-type]
        (Reading("x", "-", trait="nope"), "trait 'nope' is unknown; a patient has .*strength"),
        (Reading("x", "-", ("a", "b"), trait="strength"), "'strength'; expected one component"),
        (Reading("angle", "rad"), "reading 'angle' is declared twice"),
    ],
)
def test_readings(reading, complaint):
    with pytest.raises(InputError, match=f"Own: .*{complaint}"):
        made((reading,))


@pytest.mark.parametrize(
    ("groups", "complaint"),
    [
        ({}, "declared_groups gives no group"),
        ({"mine": []}, "group 'mine' is empty"),
        ({"mine": [Channel("nope", 1.0, 0.0, 1.0)]}, "'mine.nope' shows reading 'nope', which is unknown; .*angle"),
        ({"mine": [Channel("a", 1.0, 0.0, 1.0, reading="rate")] * 2}, "group 'mine' has channel 'a' twice"),
        ({"mine": [Channel("rate", 0.0, 0.0, 1.0)]}, "scale = 0.0"),
        ({"mine": [Channel("rate", 1.0, 1.0, float("nan"))]}, "high = nan; expected low below high"),
        ({"my.own": [Channel("rate", 1.0, 0.0, 1.0)]}, "'my.own' of group or channel; expected no dot"),
    ],
)
def test_groups(groups, complaint):
    with pytest.raises(InputError, match=f"Own: .*{complaint}"):
        made(groups=groups)


@pytest.mark.parametrize(
    ("reported", "complaint"),
    [
        ((Reported("time", "angle"),), "'time': info has that name already"),
        # Of a reset, whose infos a batch puts beside those of a step.
        ((Reported("load", "load"),), "'load': info has that name already"),
        ((Reported("a", "angle"), Reported("a", "rate")), "'a' is declared twice"),
        ((Reported("a", "nope"),), "reading 'nope' is unknown; there are .*angle"),
        ((Reported("a", "tension"),), "components agonist, antagonist; expected a reading of one"),
    ],
)
def test_reported(reported, complaint):
    with pytest.raises(InputError, match=f"Own: reported number .*{complaint}"):
        made(reported=reported)


@compiled
def _of_two(w, more):
    """No kernel: one argument too many."""


@pytest.mark.parametrize(
    ("kernel", "complaint"),
    [
        (lambda w: None, "Python function '<lambda>'; expected a compiled kernel"),
        (None, "None; expected a compiled kernel"),
        (_of_two, "'_of_two' of 2 arguments"),
    ],
)
def test_kernels(kernel, complaint):
    for name in ("read", "judge"):
        with pytest.raises(InputError, match=f"Own: {name} is .*{complaint}"):
            made(**{name: kernel})
    movement = type("Own", (Stay,), {"kernel": kernel, "__annotations__": {"kernel": ClassVar[Any]}})
    with pytest.raises(InputError, match=f"Own: kernel is .*{complaint}"):
        movement.of(None)


@pytest.mark.parametrize("events", ["fast", ("fast", "fast"), (1,)])
def test_events(events):
    with pytest.raises(InputError, match="Own: events = .*different words"):
        made(events=events)


@pytest.mark.parametrize("preview", [0.1, (-0.1,), (float("nan"),), ("soon",)])
def test_preview(preview):
    with pytest.raises(InputError, match="Own: preview = .*expected a tuple of finite times"):
        made(preview=preview)


@compiled
def _read_by_way_of_another(w):
    """A kernel that takes readings by their places in one that it calls."""
    read_elbow(w)
    readings(w)[first_of(w)[0]] = 0.0


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda found: found[1:], "'angle' of size 1 as reading number 1, got 'rate' of size 1"),
        (lambda found: [Reading("mine", "-"), *found], "'angle' of size 1 as reading number 1, got 'mine'"),
        (lambda found: found[:3], "'hinge_rate' of size 1 as reading number 4, got none"),
        (
            lambda found: [r if r.name != "last_action" else Reading("last_action", "-") for r in found],
            "'last_action' of size 2 as reading number 18, got 'last_action' of size 1",
        ),
    ],
)
def test_readings_that_kernels_take_by_their_places(change, complaint):
    class Own(LiftTask):
        reported = ()
        read = judge = _read_by_way_of_another

        def declared_readings(self, parts):
            return change(elbow_readings(parts))

        def declared_groups(self, parts):
            return {"mine": [Channel("mine", 1.0, 0.0, 1.0, reading=self.readings[0].name)]}

    with pytest.raises(InputError, match=f"Own: .*elbow_readings.*{complaint}"):
        Own(PARTS)


@compiled
def _of_its_own(w):
    """A kernel without places of others."""
    readings(w)[0] = 0.0


def test_a_task_whose_kernels_take_none_of_them_may_declare_what_it_likes():
    class Own(LiftTask):
        reported = ()
        read = judge = _of_its_own

        def declared_readings(self, parts):
            return [Reading("rate", "rad/s"), Reading("angle", "rad")]

        def declared_groups(self, parts):
            return {"mine": [Channel("angle", 1.0, 0.0, 1.0)]}

    assert list(Own(PARTS).places) == ["rate", "angle"]


@pytest.mark.parametrize("pieces", [1, 2, 3.0])
def test_a_movement_has_three_pieces_at_least(pieces):
    movement = type("Own", (Stay,), {"pieces": property(lambda self: pieces)})
    with pytest.raises(InputError, match=f"Own: pieces = {pieces}; expected a whole number from 3"):
        movement.of(None)


def _environment(task: type[LiftTask], **more: Any) -> AssistanceEnv:
    return type("OwnEnv", (AssistanceEnv,), {"task_type": task, **more})()


def test_a_sensor_that_the_model_lacks():
    class Own(LiftTask):
        def declared_readings(self, parts):
            return [*super().declared_readings(parts), Reading("x", "-", sensors=("nope",))]

    with pytest.raises(InputError, match=r"Own: reading 'x': sensor 'nope' is unknown; .*elbow_angle\.angle"):
        _environment(Own).reset(seed=0)


@pytest.mark.parametrize("code", [FIRST_EVENT + 3, 7, -3])
def test_an_event_that_is_not_declared_is_said(code):
    said = made().event(code, lambda name: np.zeros(1))
    assert f"judge of Own gave the event number {code};" in said
    assert "expects one of 2 (angle), 3 (tension), 4 (reaction)" in said


def test_the_code_of_the_solver_is_not_the_task_s_to_give(env):
    env.reset(seed=0)
    env.world.tables.status[STATUS.event] = SOLVER
    said = env.happened()
    assert "judge of LiftTask gave the event number 1, SOLVER" in said and "2 (angle)" in said
    env.reset(seed=0)


class NineActions(RopeTension):
    """Two ropes and seven actions that do nothing."""

    def actions(self, device):
        return NINE


def test_nine_actions_are_all_observed():
    env = _environment(LiftTask, drives={"rope_tension": NineActions})
    env.reset(seed=0)
    action = np.linspace(-0.9, -0.1, 9)
    observation = env.step(action)[0]
    (part,) = (s for s in env.observation_structure if s.name == "last_action")
    assert part.labels[:2] == ("first", "second") and part.labels[-2:] == ("eighth", "number 9")
    np.testing.assert_array_equal(observation[part.start : part.stop], action.astype(np.float32))

"""Runs of the examples of all elements: forward equals adjoint equals differences; no element can escape.

The examples are those of test_derivatives.py, which fails where a kind has none. Each takes some steps of a fixed size;
what its states have become is differentiated by states at the start, inputs, and numbers of the element itself.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np
import pytest
from pydantic import BaseModel

from dms_core import AssemblyError, InputError, Model, ModelError, Result, SimulationError, SolverOptions
from dms_core.model import (
    Constant,
    Cylindrical,
    Gravity,
    Input,
    LineGuide,
    Planar,
    PositionDriver,
    RigidBody,
    Screw,
    Slider,
    System,
)
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import By, Output, Sensitivity, Shift, Start
from tests.dms_core.sensitivity.again import difference
from tests.example_elements import Example, examples

PLACES = {
    "weld_to_ground", "line", "rod", "position", "sleeve", "table", "nut", "shortening", "fast_shortening",
    "fast_lengthening", "steep_pennation", "on_the_stop", "on_the_stop_by_pennation", "activation_given",
    "reflex_rising", "reflex_limited", "sensor", "sensor_steep", "length_driven", "sensor_of_constraint",
}  # fmt: skip
"""Examples that are a place for their kernel and no mechanism that runs; other examples of their kinds do."""
APART = (
    "sphere_contact", "sphere_pair_contact", "sphere_cylinder_contact", "cylinder_pair_contact", "cylinder_contact",
    "contact_sensor",
)  # fmt: skip
"""Contacts, of which a run says that it is differentiated between their events only."""


def guided() -> Example:
    """The constraints whose own examples do not run."""
    names = ("bead", "lift", "sleeve", "puck", "nut")
    bodies = [RigidBody(name=n, mass=1.0, inertia=(0.1, 0.12, 0.15), position=(float(k), 0.0, 0.0))
              for k, n in enumerate(names)]  # fmt: skip
    constraints = [
        LineGuide(name="wire", body_j="bead", axis_i=(0.1, 1.0, 0.2)),
        Slider(name="shaft", body_j="lift", point_i=(1.0, 0.0, 0.0), axis_i=(0.0, 1.0, 0.0)),
        PositionDriver(name="winch", body_j="lift", point_i=(1.0, 0.0, 0.0), axis_i=(0.0, 1.0, 0.0), input="height"),
        Cylindrical(name="tube", body_j="sleeve", point_i=(2.0, 0.0, 0.0)),
        Planar(name="table", body_j="puck", point_i=(3.0, 0.0, 0.0), axis_i=(0.1, 1.0, 0.2)),
        Screw(name="spindle", body_j="nut", point_i=(4.0, 0.0, 0.0), lead=0.3),
    ]
    system = System(
        "guided", bodies=bodies, constraints=constraints, inputs=[Input(name="height")],
        forces=[Gravity(name="weight", acceleration=(1.0, -9.0, 3.0))],
    )  # fmt: skip
    return Example(system, system.element("wire"))


EXAMPLES = {**examples(), "guided": (guided,)}
CASES = [
    pytest.param(f, id=f"{kind}-{f.__name__}")
    for kind, functions in EXAMPLES.items()
    if kind not in APART
    for f in functions
]
H, STEPS = 5e-4, 4
MOST = 3
"""States and numbers that are tried for each example: the first ones."""
STEP = 1e-6
"""Of a difference over the size of what is moved."""
TOLERANCE = 1e-6
"""Of the largest derivative by the same quantity; fibres and stops bend within the step of the difference."""

SAME = 1e-9
"""Forward and adjoint, over 1 + the largest derivative: sums of numbers of size c0 = 7000 / s, 1e-16 each."""
ROUNDING = 3e-14
"""To be divided by the step: what closing a loop leaves of positions of size 1."""


def _numbers(value: object, path: tuple[str, ...] = ()) -> Iterator[tuple[str, float]]:
    """Declared numbers of an element, by their keys."""
    if isinstance(value, float):
        yield ".".join(path), value
    elif isinstance(value, BaseModel):
        for key in type(value).model_fields:
            yield from _numbers(getattr(value, key), (*path, key))
    elif isinstance(value, tuple):
        for k, x in enumerate(value):
            yield from _numbers(x, (*path, str(k)))


def _record(system) -> RecordedWorld:
    model = Model(system)
    world = RecordedWorld(model, SolverOptions(rtol=1e-9, method="sdirk2", fixed_step=H))
    for declared in model.system.inputs:
        if isinstance(declared.signal, Constant) and declared.name not in model.layout.driven:
            # Away from 0, where a rope's command has a kink.
            world.set_input(declared.name, declared.signal.value + 0.3)
    if world.advance(STEPS * H) is not Result.SUCCESS:
        raise SimulationError(world.message)
    return world


def _by(world: RecordedWorld, element, of: list[Output]) -> dict[By, float]:
    """What is differentiated by, and the steps of the differences."""
    model, found = world.model, {}
    scale = {}
    for name, c in zip(model.layout.names, model.layout.coordinates, strict=True):
        scale[f"q.{name}"], scale[f"v.{name}"] = c.scale, c.rate_scale
    states = Sensitivity(world, of, []).states
    for name in states[:: max(1, len(states) // MOST)]:
        found[Start(name)] = STEP * scale[name]
    for declared in model.system.inputs:
        if isinstance(declared.signal, Constant) and declared.name not in model.layout.driven:
            found[Shift(declared.name)] = STEP
    tried = 0
    for path, value in _numbers(element):
        if tried == MOST or value == 0.0:
            continue
        try:
            Sensitivity(world, of, [Number(element.name, path)])
        except InputError:
            # Not every number can be moved alone: a step length, say, is one of the structure.
            continue
        found[Number(element.name, path)] = STEP * abs(value)
        tried += 1
    return found


def _reads_turns(system: System) -> bool:
    """Whether a constraint reads the turns of a joint, a state of first order: no chart then, as in `linearise`."""
    return any(x.kind == "turn_counter" for c in system.constraints for x in c.companions())


@pytest.mark.parametrize("example", CASES)
def test_run_of_every_element(example):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        case = example()
        if example.__name__ in PLACES:
            with pytest.raises((ModelError, AssemblyError, SimulationError)):
                _record(case.system)
            return
        world = _record(case.system)
        if _reads_turns(case.system):
            with pytest.raises(ModelError, match="a state of first order"):
                Sensitivity(world, [], [])
            return
        second = world.model.second_order
        of = [Output(f"q.{n}") for n in world.model.layout.names]
        of += [Output(f"v.{n}") for n, is_second in zip(world.model.layout.names, second, strict=True) if is_second]
        of += [Output(name) for name, _ in world.model.layout.outputs]
        element = case.element
        if element.name in world.model.system.composed:
            element = world.model.system.element(world.model.system.composed[element.name])
        steps = _by(world, element, of)
        run = Sensitivity(world, of, tuple(steps))
        forward, adjoint = run.forward(), run.adjoint()
        size = np.abs(forward).max(axis=0, keepdims=True, initial=0.0)
        assert np.abs((forward - adjoint) / (1.0 + size)).max(initial=0.0) < SAME
        for k, x in enumerate(run.by):
            try:
                expected = difference(run, x, steps[x])
            except (AssemblyError, ModelError, SimulationError):
                # The number holds a loop or redundant rows together: moved alone it leaves no mechanism.
                assert isinstance(x, Number)
                continue
            allowed = TOLERANCE * np.abs(expected).max() + ROUNDING / steps[x]
            error = np.abs(forward[:, k] - expected)
            worst = int(np.argmax(error))
            assert error.max() < allowed, (x, of[worst].name, forward[worst, k], expected[worst])


def test_no_kind_escapes():
    """Each kind but contacts has an example that runs, or stands in the guided bodies."""
    kinds = {x.kind for x in guided().system.constraints}
    for kind, functions in examples().items():
        if kind not in APART and kind not in kinds:
            assert any(f.__name__ not in PLACES for f in functions), kind

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
from dms_core.model.signals import Constant
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import By, Output, Sensitivity, Shift, Start
from tests.dms_core.sensitivity.again import difference
from tests.example_elements import examples

CASES = [pytest.param(f, id=f"{kind}-{f.__name__}") for kind, functions in examples().items() for f in functions]
H, STEPS = 5e-4, 4
MOST = 3
"""States and numbers that are tried for each example: the first ones."""
STEP = 1e-5
"""Of a difference over the size of what is moved."""
TOLERANCE = 1e-6
"""Of the largest derivative by the same quantity; fibres and stops bend within the step of the difference."""


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
    if world.advance(STEPS * H) is not Result.SUCCESS:
        raise SimulationError(world.message)
    return world


def _by(world: RecordedWorld, element, of: list[Output]) -> dict[By, float]:
    """What is differentiated by, and the steps of the differences."""
    model, found = world.model, {}
    scale = {**{f"q.{n}": c.scale for n, c in zip(model.layout.names, model.layout.coordinates, strict=True)},
             **{f"v.{n}": c.rate_scale for n, c in zip(model.layout.names, model.layout.coordinates, strict=True)}}  # fmt: skip
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


@pytest.mark.parametrize("example", CASES)
def test_run_of_every_element(example):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        case = example()
        try:
            world = _record(case.system)
        except (ModelError, AssemblyError, SimulationError) as error:
            pytest.skip(f"its example is a place for its kernel, no mechanism that runs: {error}")
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
        size = np.abs(forward).max(axis=0, keepdims=True, initial=1e-6)
        assert np.abs((forward - adjoint) / size).max(initial=0.0) < 1e-10
        for k, x in enumerate(run.by):
            expected = difference(run, x, steps[x])
            allowed = TOLERANCE * (np.abs(expected).max() + 1e-6)
            error = np.abs(forward[:, k] - expected)
            worst = int(np.argmax(error))
            assert error.max() < allowed, (x, of[worst].name, forward[worst, k], expected[worst])

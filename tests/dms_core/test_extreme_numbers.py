"""Extreme numbers in every numeric key of every element: a run, or a sentence that names the element.

Never NaN, never a traceback, never a sentence about rows and columns alone.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from dms_core import DmsError, Model, ModelError, Result, Simulation, SimulationError, SolverOptions, System
from dms_core.model import (
    Constant,
    Input,
    LumpedLoad,
    PathPoint,
    PointMass,
    SpringDamper,
    ThelenCurves,
    ThelenMuscle,
)
from dms_core.model.element import Declaration
from dms_core.validation import LARGEST, SMALLEST, numbers_in
from tests.example_elements import examples

VALUES = (0.0, -1.0, 1e-300, -1e-300, SMALLEST, 1e-12, 1e12, 1e16, -1e16, LARGEST, -LARGEST, 1e300, -1e300)
QUICK = (0.0, -1.0, 1e-300, 1e-12, 1e16, -LARGEST, 1e300)
OPTIONS = SolverOptions(max_steps=400)
T_END = 1e-3


def _replaced(value: Any, keys: list[str], number: float) -> Any:
    """What the declaration is made of, with one number another one."""
    if not keys:
        return number
    key, rest = keys[0], keys[1:]
    if isinstance(value, BaseModel):
        data = {name: getattr(value, name) for name in type(value).model_fields}
        return {**data, key: _replaced(data[key], rest, number)}
    return tuple(_replaced(x, rest, number) if k == int(key) else x for k, x in enumerate(value))


def _cases(everything: bool) -> Iterator[Any]:
    """One number of each key; with `everything`, each component of a vector is one, too."""
    for kind, functions in sorted(examples().items()):
        example = functions[0]()
        given = dict(numbers_in(example.element))
        # Numbers that default to None are left out by the walk.
        optional = {
            name: None
            for name, field in type(example.element).model_fields.items()
            if getattr(example.element, name) is None and "float" in str(field.annotation)
        }
        keys = [*given, *optional]
        for key in keys if everything else [k for k in keys if not any(p.isdigit() and p != "0" for p in k.split("."))]:
            yield pytest.param(example.system, example.element, key, id=f"{kind}-{key}")


def _with(system: System, element: Declaration) -> System:
    """The system with one declaration replaced by its name."""
    lists = {}
    for section in ("bodies", "constraints", "forces", "sensors", "inputs"):
        items = [e for e in getattr(system, section) if e.kind != "euler_norm"]
        lists[section] = [element if e.name == element.name else e for e in items]
    return System(system.name, **lists)


def _names(system: System, element: Declaration, value: float, sentence: str) -> bool:
    """True if the sentence names the element or, where its number is of ordinary size, any that got into trouble."""
    ordinary = value in (0.0, -1.0)
    return any(f"'{e.name}" in sentence for e in (system.everything() if ordinary else [element]))


QUICKLY = list(_cases(everything=False))[::4]
"""Every fourth case; the slow test has them all."""


@pytest.mark.parametrize(("system", "element", "key"), QUICKLY)
def test_extreme_number(system, element, key):
    _check(system, element, key, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize(("system", "element", "key"), list(_cases(everything=True)))
def test_extreme_number_in_every_component(system, element, key):
    _check(system, element, key, VALUES)


def _check(system: System, element: Declaration, key: str, values: tuple[float, ...]) -> None:
    """Each value in that key of the element."""
    problems = []
    for value in values:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                changed = type(element)(**_replaced(element, key.split("."), value))
                simulation = Simulation(Model(_with(system, changed)), OPTIONS)
                simulation.advance(T_END)
                run = simulation.trajectory()
        except DmsError as error:
            if not _names(system, element, value, str(error)):
                problems.append(f"{value}: {error}")
            continue
        except Exception as error:
            problems.append(f"{value}: {type(error).__name__} {error}")
            continue
        if not run.success and not _names(system, element, value, run.message):
            problems.append(f"{value}: {run.message}")
        for name, x in run.sensors().items():
            if not np.isfinite(x).all():
                problems.append(f"{value}: sensor {name} is {x[~np.isfinite(x)][0]} though {run.result.name}")
        if not all(np.isfinite(x).all() for x in (run.q, run.v, run.lam, run.mu)):
            problems.append(f"{value}: not finite, {run.message}")
    assert not problems, "\n".join(problems)


def test_the_number_is_named_with_what_is_allowed():
    with pytest.raises(ModelError, match=r"point_mass 'ball': mass = 1e\+300: Expected 0 or a number of a size"):
        PointMass(name="ball", mass=1e300)
    with pytest.raises(ModelError, match=r"input 'u': signal.value = 1e\+300: Expected"):
        Input(name="u", signal=Constant(value=1e300))


def test_equations_that_overflow_name_the_element_and_its_numbers():
    curves = ThelenCurves(passive_shape=1e4)
    path = PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(point=(0.3, 0.0, 0.0))
    muscle = ThelenMuscle(
        name="biceps", path=path, excitation="u", max_isometric_force=600.0, optimal_fibre_length=0.1,
        tendon_slack_length=0.19, curves=curves, start_fibre_length=0.11,
    )  # fmt: skip
    with pytest.raises(ModelError, match=r"thelen_muscle 'biceps': its equations are not finite at the .*= 10000"):
        Model(System(forces=[muscle], inputs=[Input(name="u")]))


def test_an_input_out_of_range_is_named_by_the_run_that_fails():
    push = LumpedLoad(name="push", body="ball", force=(1.0, 0.0, 0.0), input="factor")
    spring = SpringDamper(name="spring", body_j="ball", stiffness=1.0, free_length=1.0)
    ball = PointMass(name="ball", mass=1.0, position=(1.0, 0.0, 0.0))
    simulation = Simulation(System(bodies=[ball], forces=[push, spring], inputs=[Input(name="factor")]))
    simulation.set_input("factor", 1e300)
    assert simulation.advance(1.0) is not Result.SUCCESS
    with contextlib.suppress(SimulationError):
        assert "'factor' = 1e+300" in simulation.trajectory().message
        return
    with pytest.raises(SimulationError, match=r"'factor' = 1e\+300"):
        simulation.trajectory()

"""Derivatives by declared numbers: against residuals and sensors of two other models at the same operating point."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.assembly.derivatives.blocks import OperatingPoint
from dms_core.assembly.model import Model
from dms_core.errors import InputError, ModelError
from dms_core.model import JointMoment, MuscleSensor, System
from dms_core.simulation.dynamics import World
from tests.dms_core.assembly.specimen import BODIES, CONSTRAINTS, FORCES, INPUTS, random_point, specimen

SENSORS = (
    JointMoment(name="moment", joint="elbow", elements=("biceps", "spring", "gravity"), bodies=("lower", "plate")),
    MuscleSensor(name="muscle", muscle="biceps", components=("tendon_force",)),
)


@pytest.fixture(scope="module")
def model() -> Model:
    return specimen(*SENSORS)


def _point(model: Model) -> OperatingPoint:
    x = random_point(model, 0)
    mu = np.random.default_rng(0).uniform(-1.0, 1.0, model.n_phi)
    return OperatingPoint(x.q, x.v, x.v, x.a, x.lam, mu, World(model).operating_point().u)


def _values(changed, like: Model, at: OperatingPoint) -> tuple[np.ndarray, ...]:
    """r1 to r4 and y of the specimen with one declaration replaced, at a given point."""
    lists = [[changed if x.name == changed.name else x for x in items] for items in (BODIES, CONSTRAINTS, FORCES)]
    bodies, constraints, forces = lists
    system = System("specimen", bodies=bodies, constraints=constraints, forces=forces, sensors=SENSORS, inputs=INPUTS)
    world = World(Model(system, like=like))
    b = world.blocks(at)
    return b.r1, b.r2, b.r3, b.r4, world.sensor_blocks(at).y


def _with(**changes):
    """A declaration with some fields replaced."""
    return lambda element, x: element.model_copy(update={k: f(x) for k, f in changes.items()})


INERTIA = (0.02, 0.03, 0.025)
CASES = [
    ("lower", "mass", 1.5, _with(mass=lambda x: x), False),
    ("upper", "inertia.3", 0.002, _with(inertia=lambda x: (*INERTIA, x, -0.003, 0.004)), False),
    ("lower", "centre_of_mass.1", -0.18, _with(centre_of_mass=lambda x: (0.01, x, 0.0)), True),
    ("lag", "gain", 2.0, _with(gain=lambda x: x), False),
    ("filter", "frequency", 7.0, _with(frequency=lambda x: x), False),
    ("spring", "stiffness", 90.0, _with(stiffness=lambda x: x), True),
    ("biceps", "max_isometric_force", 600.0, _with(max_isometric_force=lambda x: x), True),
]
"""Element, number, its value, how to declare another one, and whether a force or a constraint has to be differenced."""


@pytest.mark.parametrize(("name", "number", "value", "change", "differenced"), CASES, ids=[c[0] + c[1] for c in CASES])
def test_differences_of_two_models(model, name, number, value, change, differenced):
    at, element = _point(model), model.system.element(name)
    found = World(model).parameter_blocks(name, number, at)
    h = 1e-5 * abs(value)
    ends = [_values(change(element, value + x), model, at) for x in (h, -h)]
    assert bool(found.differenced) == differenced
    some = False
    for what, high, low in zip(("r1", "r2", "r3", "r4", "y"), *ends, strict=True):
        numeric, own = (high - low) / (2.0 * h), getattr(found, what)
        # Differences with another step: 1e-10 times a third derivative, which is 1e4 at the tendon; rounding 1e-11.
        size = np.abs(numeric).max() + 1e-3 * np.abs(high).max() / abs(value)
        np.testing.assert_allclose(own, numeric, atol=1e-6 * size + 1e-12, err_msg=what)
        some = some or bool(np.any(own))
    assert some, "nothing depends on the number: the test would pass with zeros"


def _specimen_with(*changed) -> System:
    """The specimen without sensors, with some forces replaced."""
    replaced = {x.name: x for x in changed}
    forces = [replaced.get(x.name, x) for x in FORCES]
    return System("specimen", bodies=BODIES, constraints=CONSTRAINTS, forces=forces, inputs=INPUTS)


def test_numbers_that_were_written_in_place_count_with_their_declaration(model):
    own = Model(_specimen_with(), like=model)
    pennate = own.system.element("biceps").model_copy(update={"pennation_angle": 0.3, "max_isometric_force": 900.0})
    other = Model(_specimen_with(pennate), like=model)
    at = _point(own)
    right = World(other).parameter_blocks("biceps", "pennation_angle", at)
    for array, written in zip(own.numbers, other.numbers, strict=True):
        array[:] = written
    world = World(own)
    with pytest.raises(InputError, match="'pennation_angle' moves numbers of 'biceps' that were written in place"):
        world.parameter_blocks("biceps", "pennation_angle", at)
    found = world.parameter_blocks("biceps", "pennation_angle", at, other.system)
    np.testing.assert_array_equal(found.r2, right.r2)
    assert np.any(found.r2)
    # What does not touch the written numbers needs no declaration.
    assert np.any(world.parameter_blocks("filter", "damping", at).r2)


def test_a_declaration_of_other_elements_is_refused(model):
    other = System("shorter", bodies=BODIES, constraints=CONSTRAINTS, inputs=INPUTS)
    with pytest.raises(InputError, match="system = 'shorter' has other elements or joins than the model of 'specimen'"):
        World(model).parameter_blocks("lower", "mass", system=other)


@pytest.mark.parametrize(
    ("name", "number", "message"),
    [
        ("lower", "weight", "rigid_body 'lower': 'weight' does not exist. Declared: .*mass"),
        ("lower", "inertia.9", r"'inertia.9': expected a place from 0 to 5, got '9'"),
        ("lower", "mass.0", r"'mass.0': nothing can follow 1.5"),
        ("lower", "inertia", r"expected 'inertia' to be a number with a derivative, got \(0.02"),
        ("lower", "name", r"expected 'name' to be a number with a derivative, got 'lower'"),
    ],
)
def test_what_is_no_number_is_refused(model, name, number, message):
    with pytest.raises(InputError, match=message):
        World(model).parameter_blocks(name, number)


def test_an_unknown_element_is_refused(model):
    with pytest.raises(ModelError, match="'lowerr' does not exist"):
        World(model).parameter_blocks("lowerr", "mass")

"""The map of one step against differences of that step, closed forms and the exponential of the linearised system."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scipy.linalg as la

from dms_core import Model, SolverOptions, World
from dms_core.analyses.linearise import linearise
from dms_core.errors import InputError
from dms_core.sensitivity.tangents.step_map import StepMap, StepMatrices
from dms_core.simulation.methods.sdirk2 import GAMMA
from tests.dms_core.analyses.mechanisms import double_pendulum, spring_mass_chain
from tests.dms_core.sensitivity.systems import SYSTEMS, driven_crank

SHIFT = {"flexible": 1e-3}
"""Of each state over its size, 1e-5 where nothing is said: truncation of the difference is 1e-20 of the fifth
derivative. The bar is so stiff along its axis that rounding counts, and nearly linear."""
TOLERANCE = 1e-7
"""Of the largest number of a column: the differences are good to about 1e-9, stiff fibres take the rest."""
ROUNDING = 1e-13
"""Of numbers of size 1, to be divided by the shift: 1e-16, multiplied by the gains of a controller and by 1/h."""


@cache
def model(name: str) -> Model:
    return SYSTEMS[name]()


def _world(name: str, method: str) -> World:
    """On its way, beyond the start of the method."""
    world = World(model(name), SolverOptions(rtol=1e-9, method=method))
    world.advance(0.05)
    return world


def _stepped(name: str, method: str, h: float) -> tuple[StepMap, StepMatrices, World]:
    """The third of three steps of a map, and the world as it was before it."""
    steps = StepMap(_world(name, method))
    steps.step(0.8 * h)
    steps.step(h)
    before = steps.world.snapshot()
    return steps, steps.step(h), _restored(name, method, before)


def _restored(name: str, method: str, snapshot) -> World:
    world = World(model(name), SolverOptions(rtol=1e-9, method=method))
    world.restore(snapshot)
    return world


def _end(steps: StepMap, world: World, h: float, change) -> np.ndarray:
    """x behind a step from a state that `change` has moved."""
    before = world.snapshot()
    change(world.state)
    other = StepMap(world)
    # A map that knows no step before begins with SDIRK2.
    other.lifted = steps.lifted
    other.step(h)
    at = steps.chart.values
    x = np.concatenate([world.state.q[at.chosen], world.state.v[at.chosen], world.state.q[at.first]])
    world.restore(before)
    return x


def _difference(steps: StepMap, world: World, h: float, change, size: float) -> np.ndarray:
    """Of the fourth order, from four steps."""
    far, high, low, near = (_end(steps, world, h, lambda s, d=d: change(s, d * size)) for d in (2.0, 1.0, -1.0, -2.0))
    return (8.0 * (high - low) - (far - near)) / (12.0 * size)


def _assert_column(found: np.ndarray, expected: np.ndarray, what: str, sizes: np.ndarray, shift: float) -> None:
    error, allowed = np.abs(found - expected) / sizes, TOLERANCE * (np.abs(expected) / sizes).max() + ROUNDING / shift
    assert error.max() < allowed, (what, error.max(), allowed, found, expected)


@pytest.mark.parametrize("method", ["sdirk2", "bdf2"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_map_equals_differences_of_the_step(name, method):
    h = 2e-3
    steps, found, world = _stepped(name, method, h)
    n_x = len(found.states)
    scale = np.concatenate([[c.scale for c in world.model.layout.coordinates]])
    rate = np.concatenate([[c.rate_scale for c in world.model.layout.coordinates]])
    at, columns = steps.chart.values, steps.lifted
    sizes = np.concatenate([scale[at.chosen], rate[at.chosen], scale[at.first]])
    for k in range(n_x):
        dq, dv = columns[0][k], columns[1][k]

        def change(s, d, dq=dq, dv=dv):
            s.q[:] += d * dq
            s.v[:] += d * dv

        by = SHIFT.get(name, 1e-5) * sizes[k]
        expected = _difference(steps, world, h, change, by)
        _assert_column(found.A[:, k], expected, found.states[k], sizes, by)
    for k, name_of in enumerate(found.inputs):
        row = world.state.signals.ptr[k]
        if world.state.signals.ptr[k + 1] - row > 1 or name_of in world.model.layout.driven:
            continue

        def shift(s, d, row=row):
            s.signals.c[row, 0] += d

        expected = _difference(steps, world, h, shift, 1e-4)
        _assert_column(found.B[:, k], expected, name_of, sizes, 1e-4)


@pytest.mark.parametrize("name", SYSTEMS)
def test_lifted_states_lie_in_the_tangent_space(name):
    steps, found, world = _stepped(name, "sdirk2", 2e-3)
    dq, dv = steps.lifted
    _, _, G, W = world.model.constraint_jacobian(world.state.q, world.state.v, world.time)
    at, n_z = steps.chart.values, len(steps.chart.values.chosen)
    assert np.abs(G @ dq.T).max(initial=0.0) < 1e-12 * max(1.0, np.abs(G).max(initial=0.0))
    assert np.abs(G @ dv.T + W @ dq.T).max(initial=0.0) < 1e-12 * max(1.0, np.abs(W).max(initial=0.0))
    x = np.concatenate([dq[:, at.chosen], dv[:, at.chosen], dq[:, at.first]], axis=1)
    np.testing.assert_allclose(x, np.eye(len(found.states)), atol=1e-12)
    assert found.states[:n_z] == tuple(f"q.{world.model.layout.names[k]}" for k in at.chosen)


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_end_of_a_step_lies_in_the_tangent_space(name):
    """So that closing the constraints, which a step ends with, changes no tangent."""
    steps, _, _ = _stepped(name, "sdirk2", 2e-3)
    world, c = steps.world, steps.columns.values
    _, _, G, W = world.model.constraint_jacobian(world.state.q, world.state.v, world.time)
    size = np.abs(G).max(initial=1.0) * np.abs(c.dq).max(initial=1.0)
    assert np.abs(G @ c.dq.T).max(initial=0.0) < 1e-10 * size
    size = np.abs(G).max(initial=1.0) * np.abs(c.dv).max(initial=1.0)
    assert np.abs(G @ c.dv.T + W @ c.dq.T).max(initial=0.0) < 1e-8 * size


def _oscillator(mass: float, stiffness: float, damping: float) -> tuple[Model, np.ndarray]:
    """One mass between two springs, and its matrix of (x, v)."""
    model = Model(spring_mass_chain(1, mass, stiffness, damping))
    return model, np.array([[0.0, 1.0], [-2.0 * stiffness / mass, -2.0 * damping / mass]])


@pytest.mark.parametrize("h", [1e-3, 1e-2, 5e-2])
def test_sdirk2_has_its_stability_function(h):
    """R(z) = (1 + (1 - 2 gamma) z) / (1 - gamma z)^2 (Hairer and Wanner 1996, IV.6), with A h for z."""
    model, A = _oscillator(2.0, 300.0, 1.5)
    found = StepMap(World(model, SolverOptions(method="sdirk2"))).step(h).A
    one = np.eye(2)
    left = np.linalg.inv(one - GAMMA * h * A)
    expected = left @ left @ (one + (1.0 - 2.0 * GAMMA) * h * A)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.7])
def test_bdf2_has_its_recurrence(ratio):
    """(c0 - A) y = -b1 y_n - b2 y_(n-1), with the coefficients of bdf2.py; the first step is one of SDIRK2."""
    model, A = _oscillator(2.0, 300.0, 1.5)
    steps = StepMap(World(model, SolverOptions(method="bdf2")))
    h = 4e-3
    steps.step(h / ratio)
    found = steps.step(h)
    left = np.linalg.inv((1.0 + 2.0 * ratio) / (1.0 + ratio) / h * np.eye(2) - A)
    np.testing.assert_allclose(found.A, left * (1.0 + ratio) / h, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.A_before, -left * ratio**2 / (1.0 + ratio) / h, rtol=1e-12, atol=1e-12)


def test_map_tends_to_the_exponential_of_the_linearised_system():
    """About a rest, where the matrix stays: halving h divides the error of a step of order 2 by 8."""
    model = Model(double_pendulum(1.0))
    errors = []
    for h in (8e-3, 4e-3, 2e-3):
        world = World(model, SolverOptions(method="sdirk2", rtol=1e-9))
        world.settle()
        linear = linearise(model, world.operating_point())
        found = StepMap(world).step(h)
        assert found.states == linear.states
        errors.append(np.abs(found.A - la.expm(linear.A * h)).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((rates > 2.9) & (rates < 3.1)), errors


@pytest.mark.parametrize("column", ["B", "B_rate", "B_acceleration"])
def test_a_driven_crank_follows_its_input(column):
    """A mechanism without freedoms has no states; what its input moves is in all coordinates."""
    world = World(driven_crank(), SolverOptions(method="sdirk2"))
    steps = StepMap(world)
    found = steps.step(1e-3)
    assert found.A.shape == (0, 0) and getattr(found, column).shape == (0, 1)
    k = ("B", "B_rate", "B_acceleration").index(column)
    phi_q = world.model.constraint_jacobian(world.state.q, world.state.v)[2]
    row = next(c.row for c in world.model.layout.constraints if c.element.name == "motor")
    rates = np.abs(phi_q @ steps.columns.values.dq[k])
    expected = np.zeros(len(rates))
    expected[row] = 1.0 if k == 0 else 0.0
    np.testing.assert_allclose(rates, expected, atol=1e-9)


def test_what_cannot_be_mapped_is_refused():
    model = Model(double_pendulum(1.0))
    with pytest.raises(InputError, match="Expected a world that runs 'sdirk2' or 'bdf2'.*got 'radau5'"):
        StepMap(World(model, SolverOptions(method="radau5")))
    with pytest.raises(InputError, match=r"Expected a positive step \[s\], got -1"):
        StepMap(World(model)).step(-1.0)


def test_a_map_without_a_past_begins_with_one_step():
    """A world of BDF2 on its way, of whose step before the map knows nothing."""
    steps = StepMap(_world("pendulum", "bdf2"))
    first, second = steps.step(1e-3), steps.step(1e-3)
    assert not first.A_before.any() and second.A_before.any()
    # On a slow motion one step of 1 ms changes little: the identity, which BDF2 makes of 4/3 and -1/3.
    for found in (first.A, second.A + second.A_before):
        np.testing.assert_allclose(found, np.eye(len(first.states)), atol=0.05)

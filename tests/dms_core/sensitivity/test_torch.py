"""Runs behind torch: backward against differences of forward."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core import SolverOptions
from dms_core.errors import InputError, ModelError
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.torch_functions import ControlPeriod, Schedule
from tests.dms_core.sensitivity.systems import pendulum

torch = pytest.importorskip("torch")

FIXED = SolverOptions(rtol=1e-10, method="sdirk2", fixed_step=1e-3)
"""Steps that do not follow what is moved, solved to rounding: differences of whole runs then converge."""


def test_gradient_of_a_schedule_is_that_of_differences():
    run = Schedule(pendulum(), ["moment", "size"], [0.02, 0.04, 0.06], ["bend.angle", "bend.acceleration"], FIXED)
    values = torch.tensor([[0.3, 1.0], [-0.5, 2.0], [0.8, 0.5]], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(run, (values,), eps=1e-4, atol=1e-7, rtol=1e-6)


def test_gradient_of_a_period_is_that_of_differences():
    """By inputs; and by the state along a motion that the constraints allow."""
    model = pendulum()
    period = ControlPeriod(model, ["moment"], 0.02, FIXED)
    value = torch.tensor([0.3], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda u: period(period.start(), u), (value,), eps=1e-4, atol=1e-7, rtol=1e-6)
    state = period.start().requires_grad_(True)
    weights = torch.linspace(-1.0, 1.0, len(state), dtype=torch.float64)
    (weights * period(state, value.detach())).sum().backward()
    G = model.constraint_jacobian(model.start.q)[2]
    allowed = np.linalg.svd(G)[2][np.linalg.matrix_rank(G) :]
    for dv in allowed[-2:]:
        move, eps = torch.as_tensor(np.concatenate([0.0 * dv, dv])), 1e-4
        high, low = ((weights * period(state.detach() + s * eps * move, value.detach())).sum() for s in (1.0, -1.0))
        np.testing.assert_allclose(float(state.grad @ move), float(high - low) / (2.0 * eps), rtol=1e-5, atol=1e-8)


def test_periods_are_chained():
    """Two periods in a row have the gradient of the schedule."""
    model = pendulum()
    period = ControlPeriod(model, ["moment"], 0.02, FIXED)
    values = torch.tensor([[0.3], [-0.4]], dtype=torch.float64, requires_grad=True)
    state = period.start()
    for row in values:
        state = period(state, row)
    k = model.layout.index["lower.x"]
    state[k].backward()
    other = values.detach().clone().requires_grad_(True)
    Schedule(model, ["moment"], [0.02, 0.04], ["q.lower.x"], FIXED)(other)[-1, 0].backward()
    np.testing.assert_allclose(values.grad.numpy(), other.grad.numpy(), rtol=1e-6)


NUMBERS = [Number("lower", "mass"), Number("push", "force.1")]


def test_gradients_by_declared_numbers_are_those_of_differences():
    """Of a schedule and of a period, beside those by inputs; the start of a run stays what it is."""
    model = pendulum()
    values = torch.tensor([[0.3], [-0.5]], dtype=torch.float64, requires_grad=True)
    run = Schedule(model, ["moment"], [0.02, 0.04], ["bend.angle", "bend.acceleration"], FIXED, NUMBERS)
    numbers = torch.tensor([1.7, 2.2], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(run, (values, numbers), eps=1e-4, atol=1e-7, rtol=1e-6)
    period = ControlPeriod(model, ["moment"], 0.02, FIXED, NUMBERS)
    start = period.start()
    assert torch.autograd.gradcheck(
        lambda u, p: period(start, u, p), (values[0].detach().requires_grad_(True), numbers),
        eps=1e-4, atol=1e-7, rtol=1e-6,
    )  # fmt: skip


def test_numbers_that_are_not_given_are_those_declared():
    model, values = pendulum(), torch.tensor([[0.3], [-0.5]])
    of = (["moment"], [0.02, 0.04], ["bend.angle"], FIXED)
    run = Schedule(model, *of, NUMBERS)
    np.testing.assert_array_equal(run(values), Schedule(model, *of)(values))
    assert not torch.equal(run(values, torch.tensor([1.7, 2.2])), run(values))


def test_gradient_has_the_type_of_what_it_is_taken_by():
    values = torch.tensor([[0.3], [-0.5]], requires_grad=True)
    Schedule(pendulum(), ["moment"], [0.02, 0.04], ["bend.angle"])(values).sum().backward()
    assert values.grad.dtype == torch.float32


def test_numbers_that_place_joints_are_refused():
    with pytest.raises(InputError, match=r"'elbow.point_i.0' places a joint"):
        Schedule(pendulum(), ["moment"], [0.1], ["bend.angle"], numbers=[Number("elbow", "point_i.0")])
    run = Schedule(pendulum(), ["moment"], [0.1], ["bend.angle"], numbers=NUMBERS)
    with pytest.raises(InputError, match=r"Expected 2 finite numbers \(lower.mass, push.force.1\)"):
        run(torch.zeros((1, 1)), torch.tensor([torch.nan, 1.0]))


def test_wrong_shapes_and_names_are_refused():
    model = pendulum()
    with pytest.raises(InputError, match=r"values: expected a tensor of shape \(1, 1\), got \(2,\)"):
        Schedule(model, ["moment"], [0.1], ["bend.angle"])(torch.zeros(2, dtype=torch.float64))
    with pytest.raises(InputError, match="Expected rising positive ends"):
        Schedule(model, ["moment"], [0.1, 0.1], ["bend.angle"])
    with pytest.raises(ModelError, match="momentum"):
        ControlPeriod(model, ["momentum"], 0.1)

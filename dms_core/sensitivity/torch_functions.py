"""Runs as functions that torch differentiates: one control period of a model, and a whole schedule of inputs.

torch is imported where a function is called. Numbers are doubles on the CPU; second derivatives are not given.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from dms_core.assembly.model import Model
from dms_core.errors import InputError, SimulationError
from dms_core.results import Result
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import Output, Sensitivity, Shift
from dms_core.simulation.options import SolverOptions


def _advance(world: RecordedWorld, inputs: Sequence[str], values: np.ndarray, end: float) -> None:
    """Hold the inputs until `end`.

    Raises:
        SimulationError: the run stops early.
    """
    for name, value in zip(inputs, values, strict=True):
        world.set_input(name, float(value))
    if world.advance(end) is not Result.SUCCESS:
        raise SimulationError(world.message)


def _array(tensor: Any, what: str, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of a tensor of that shape."""
    x = tensor.detach().cpu().double().numpy()
    if x.shape != shape:
        raise InputError(f"{what}: expected a tensor of shape {shape}, got {x.shape}.")
    return x


@cache
def _functions() -> tuple[Any, Any]:
    """The two subclasses of torch.autograd.Function, made when torch is first needed."""
    import torch

    class Period(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, state: Any, values: Any, of: Any) -> Any:
            model, n, k = of.model, of.model.n_q, len(of.inputs)
            x = _array(state, "state", (2 * n,))
            world = RecordedWorld(model, of.options)
            world.state.q[:], world.state.v[:] = x[:n], x[n:]
            _advance(world, of.inputs, _array(values, "values", (k,)), of.period)
            ctx.world, ctx.of = world, of
            return torch.as_tensor(np.concatenate([world.state.q, world.state.v]))

        @staticmethod
        def backward(ctx: Any, slope: Any) -> Any:
            of, n = ctx.of, ctx.of.model.n_q
            second = of.model.second_order
            names = [f"{x}.{name}" for x in "qv" for name in of.model.layout.names]
            run = Sensitivity(ctx.world, [Output(name) for name in names], [Shift(name) for name in of.inputs])
            # Rates of first-order states are no states.
            w = slope.double().numpy() * np.concatenate([np.ones(n), second])
            by_values = run.adjoint(weights=w[None])[0]
            assert run.by_start is not None
            by_state = np.concatenate([run.by_start[0][0], run.by_start[1][0] * second])
            return torch.as_tensor(by_state), torch.as_tensor(by_values), None

    class Schedule(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, values: Any, of: Any) -> Any:
            world = RecordedWorld(of.model, of.options)
            rows = _array(values, "values", (len(of.times), len(of.inputs)))
            for row, end in zip(rows, of.times, strict=True):
                _advance(world, of.inputs, row, end)
            outputs = [Output(name, t) for t in of.times for name in of.outputs]
            begins = [0.0, *of.times[:-1]]
            by = [Shift(name, a, b) for a, b in zip(begins, of.times, strict=True) for name in of.inputs]
            ctx.run, ctx.shape = Sensitivity(world, outputs, by), rows.shape
            found = ctx.run.value().reshape(len(of.times), len(of.outputs))
            return torch.as_tensor(found)

        @staticmethod
        def backward(ctx: Any, slope: Any) -> Any:
            by = ctx.run.adjoint(weights=slope.double().numpy().reshape(1, -1))
            return torch.as_tensor(by.reshape(ctx.shape)), None

    return Period, Schedule


class ControlPeriod:
    """One control period as a function of a state (q, v), shape (2 n_q,), and of inputs that are held over it.

    It gives the state at the end. The derivative by the state counts along motions that the constraints allow; inputs
    that are declared as functions of time begin at 0 in every period.

    Args:
        model: a compiled model.
        inputs: names of the inputs that are given.
        period: length [s].
        options: solver options.

    Example:
        >>> period = ControlPeriod(model, ["moment"], 0.02)
        >>> state = period(state, policy(state))
    """

    def __init__(
        self, model: Model, inputs: Sequence[str], period: float, options: SolverOptions | None = None
    ) -> None:
        self.model, self.inputs, self.period = model, tuple(inputs), float(period)
        self.options = options or SolverOptions(method="sdirk2")
        for name in self.inputs:
            model.input_index(name)

    def start(self) -> Any:
        """The assembled start, a tensor."""
        import torch

        return torch.as_tensor(np.concatenate([self.model.start.q, self.model.start.v]))

    def __call__(self, state: Any, values: Any) -> Any:
        """The state behind a period; values have the shape (n_inputs,)."""
        return _functions()[0].apply(state, values, self)


class Schedule:
    """A whole run as a function of the values of inputs, each held over one of its intervals.

    It gives sensors or states at the ends of all intervals, shape (n_times, n_outputs).

    Args:
        model: a compiled model.
        inputs: names of the inputs that are given.
        times: ends of the intervals [s], rising.
        outputs: sensors or states, named as in `Output`.
        options: solver options.

    Example:
        >>> run = Schedule(model, ["moment"], [0.1, 0.2, 0.3], ["swing.angle"])
        >>> loss = ((run(values) - target) ** 2).sum()
        >>> loss.backward()
    """

    def __init__(
        self, model: Model, inputs: Sequence[str], times: Sequence[float], outputs: Sequence[str],
        options: SolverOptions | None = None,
    ) -> None:  # fmt: skip
        self.model, self.inputs, self.outputs = model, tuple(inputs), tuple(outputs)
        self.times = tuple(float(t) for t in times)
        self.options = options or SolverOptions(method="sdirk2")
        if not self.times or self.times[0] <= 0.0 or np.any(np.diff(self.times) <= 0.0):
            raise InputError(f"times: Expected rising positive ends of intervals [s], got {self.times}.")
        for name in self.inputs:
            model.input_index(name)

    def __call__(self, values: Any) -> Any:
        """The outputs; values have the shape (n_times, n_inputs)."""
        return _functions()[1].apply(values, self)

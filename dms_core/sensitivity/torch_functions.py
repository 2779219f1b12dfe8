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
from dms_core.sensitivity.moved import MovedNumbers
from dms_core.sensitivity.nodes import Number
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


def _tensors(arrays: Sequence[np.ndarray], types: Sequence[Any]) -> list[Any]:
    """Arrays as tensors of the types of what they are derivatives by."""
    import torch

    return [torch.as_tensor(x).to(kind) for x, kind in zip(arrays, types, strict=True)]


@cache
def _functions() -> tuple[Any, Any]:
    """The two subclasses of torch.autograd.Function, made when torch is first needed."""
    import torch

    class Period(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, state: Any, values: Any, numbers: Any, of: Any) -> Any:
            n, k = of.model.n_q, len(of.inputs)
            x = _array(state, "state", (2 * n,))
            world = RecordedWorld(of.moved.at(_array(numbers, "numbers", of.moved.declared.shape)), of.options)
            world.state.q[:], world.state.v[:] = x[:n], x[n:]
            _advance(world, of.inputs, _array(values, "values", (k,)), of.period)
            ctx.world, ctx.of, ctx.types = world, of, [y.dtype for y in (state, values, numbers)]
            return torch.as_tensor(np.concatenate([world.state.q, world.state.v]))

        @staticmethod
        def backward(ctx: Any, slope: Any) -> Any:
            of, n = ctx.of, ctx.of.model.n_q
            second = of.model.second_order
            names = [f"{x}.{name}" for x in "qv" for name in of.model.layout.names]
            by = [*(Shift(name) for name in of.inputs), *of.moved.numbers]
            run = Sensitivity(ctx.world, [Output(name) for name in names], by)
            # Rates of first-order states are no states.
            w = slope.double().numpy() * np.concatenate([np.ones(n), second])
            by_values, by_numbers = np.split(run.adjoint(weights=w[None])[0], [len(of.inputs)])
            assert run.by_start is not None
            by_state = np.concatenate([run.by_start[0][0], run.by_start[1][0] * second])
            return *_tensors((by_state, by_values, by_numbers), ctx.types), None

    class Schedule(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, values: Any, numbers: Any, of: Any) -> Any:
            world = RecordedWorld(of.moved.at(_array(numbers, "numbers", of.moved.declared.shape)), of.options)
            world.state.q[:], world.state.v[:] = of.model.start.q, of.model.start.v
            rows = _array(values, "values", (len(of.times), len(of.inputs)))
            for row, end in zip(rows, of.times, strict=True):
                _advance(world, of.inputs, row, end)
            outputs = [Output(name, t) for t in of.times for name in of.outputs]
            begins = [0.0, *of.times[:-1]]
            by = [Shift(name, a, b) for a, b in zip(begins, of.times, strict=True) for name in of.inputs]
            ctx.run, ctx.shape = Sensitivity(world, outputs, [*by, *of.moved.numbers]), rows.shape
            ctx.types = values.dtype, numbers.dtype
            found = ctx.run.value().reshape(len(of.times), len(of.outputs))
            return torch.as_tensor(found)

        @staticmethod
        def backward(ctx: Any, slope: Any) -> Any:
            found = ctx.run.adjoint(weights=slope.double().numpy().reshape(1, -1))[0]
            by_values, by_numbers = np.split(found, [ctx.shape[0] * ctx.shape[1]])
            return *_tensors((by_values.reshape(ctx.shape), by_numbers), ctx.types), None

    return Period, Schedule


class ControlPeriod:
    """One control period as a function of a state (q, v), of inputs that are held over it, and of declared numbers.

    It gives the state at the end. The derivative by the state counts along motions that the constraints allow; inputs
    that are declared as functions of time begin at 0 in every period.

    Args:
        model: a compiled model.
        inputs: names of the inputs that are given.
        period: length [s].
        options: solver options.
        numbers: declared numbers that are given too; none that places a joint.

    Example:
        >>> period = ControlPeriod(model, ["moment"], 0.02)
        >>> state = period(state, policy(state))
    """

    def __init__(
        self, model: Model, inputs: Sequence[str], period: float, options: SolverOptions | None = None,
        numbers: Sequence[Number] = (),
    ) -> None:  # fmt: skip
        self.model, self.inputs, self.period = model, tuple(inputs), float(period)
        self.moved = MovedNumbers(model, numbers)
        self.options = options or SolverOptions(method="sdirk2")
        for name in self.inputs:
            model.input_index(name)

    def start(self) -> Any:
        """The assembled start, a tensor."""
        import torch

        return torch.as_tensor(np.concatenate([self.model.start.q, self.model.start.v]))

    def __call__(self, state: Any, values: Any, numbers: Any = None) -> Any:
        """The state behind a period.

        Args:
            state: shape (2 n_q,).
            values: of the inputs, shape (n_inputs,).
            numbers: values of the declared numbers, shape (n_p,); None: as declared.
        """
        return _functions()[0].apply(state, values, _declared(self) if numbers is None else numbers, self)


class Schedule:
    """A whole run as a function of the values of inputs, each held over one of its intervals, and of declared numbers.

    It gives sensors or states at the ends of all intervals, shape (n_times, n_outputs). The run begins at the start of
    the model as it is declared, whatever the numbers are.

    Args:
        model: a compiled model.
        inputs: names of the inputs that are given.
        times: ends of the intervals [s], rising.
        outputs: sensors or states, named as in `Output`.
        options: solver options.
        numbers: declared numbers that are given too; none that places a joint.

    Example:
        >>> run = Schedule(model, ["moment"], [0.1, 0.2, 0.3], ["swing.angle"])
        >>> loss = ((run(values) - target) ** 2).sum()
        >>> loss.backward()
    """

    def __init__(
        self, model: Model, inputs: Sequence[str], times: Sequence[float], outputs: Sequence[str],
        options: SolverOptions | None = None, numbers: Sequence[Number] = (),
    ) -> None:  # fmt: skip
        self.model, self.inputs, self.outputs = model, tuple(inputs), tuple(outputs)
        self.moved = MovedNumbers(model, numbers)
        self.times = tuple(float(t) for t in times)
        self.options = options or SolverOptions(method="sdirk2")
        if not self.times or self.times[0] <= 0.0 or np.any(np.diff(self.times) <= 0.0):
            raise InputError(f"times: Expected rising positive ends of intervals [s], got {self.times}.")
        for name in self.inputs:
            model.input_index(name)

    def __call__(self, values: Any, numbers: Any = None) -> Any:
        """The outputs.

        Args:
            values: of the inputs, shape (n_times, n_inputs).
            numbers: values of the declared numbers, shape (n_p,); None: as declared.
        """
        return _functions()[1].apply(values, _declared(self) if numbers is None else numbers, self)


def _declared(of: ControlPeriod | Schedule) -> Any:
    """The declared values of the numbers, a tensor."""
    import torch

    return torch.as_tensor(of.moved.declared.copy())

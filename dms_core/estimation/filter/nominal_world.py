"""The world that a filter predicts with: the model's own equations, put to any state, advanced in equal steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import declared_number, numbers_with
from dms_core.assembly.model import Model
from dms_core.errors import InputError, SimulationError, choices
from dms_core.model.signals import Constant
from dms_core.results import Result
from dms_core.simulation.dynamics import World
from dms_core.simulation.options import SolverOptions
from dms_core.simulation.state import CLOCK, Options, rewind

FINER = 6
"""Times that the steps of a period are halved before it is given up."""


class NominalWorld(World):
    """A world by SDIRK2, a method without a past, so that any state can follow a correction.

    Args:
        model: a compiled model; numbers that are estimated are written into it.
    """

    def __init__(self, model: Model) -> None:
        super().__init__(model, SolverOptions(method="sdirk2", rtol=1e-6, fixed_step=1.0))
        self._declared = tuple(x.copy() for x in model.numbers[:3])
        self._written: dict[tuple[str, str], float] = {}

    @property
    def numbers(self) -> Options:
        """Options of the solver, for compiled code."""
        return self._numbers

    def put(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        """Go to a state on the constraints, shape (n_q,) each, at a time [s]."""
        rewind(self.packed.table, q, v, 0.0)
        self.state.clock[CLOCK.t] = t
        self.result = Result.SUCCESS

    def put_inputs(self, values: Mapping[int, float]) -> None:
        """Hold inputs, by their places."""
        for k, value in values.items():
            self._hold(k, float(value))

    def put_numbers(self, values: Mapping[tuple[str, str], float]) -> None:
        """Write declared numbers, by element and path."""
        if values == self._written:
            return
        found = numbers_with(self.model.layout, values) if values else self._declared
        for into, numbers in zip(self.model.numbers[:3], found, strict=True):
            into[:] = numbers
        self._written = dict(values)

    @property
    def declared_numbers(self) -> tuple[np.ndarray, ...]:
        """Numbers of dynamics, constraints and sensors as they were when the world was made."""
        return self._declared

    def forget_numbers(self) -> None:
        """Others may have written numbers: those of the next `put_numbers` are written in any case."""
        self._written = {("", ""): np.nan}

    def go(self, t: float, steps: int) -> int:
        """Advance to t [s] in equal steps, in more of them where Newton's method needs it; gives their number.

        Raises:
            SimulationError: the equations cannot be solved on the way; says where and why.
        """
        begin, whole = self.mark(), t - self.time
        for finer in range(FINER):
            self._numbers = self._numbers._replace(fixed_step=whole / (steps << finer))
            if self._solve(t, None) is Result.SUCCESS:
                return steps << finer
            why = self.message
            self.rewind(begin)
        raise SimulationError(why)

    def settled(self) -> None:
        """Rates and multipliers that belong to the present state.

        Raises:
            SimulationError: there are none.
        """
        if self.settle() is not Result.SUCCESS:
            raise SimulationError(self.message)


def held_input(model: Model, name: str, what: str) -> int:
    """Place of an input that may be held at other values than the declared one.

    Args:
        model: a compiled model.
        name: of the input.
        what: who asks, for the message.

    Raises:
        InputError: there is no such input, it is driven or a course in time, or a constraint reads it.
    """
    layout = model.layout
    if name not in layout.input_index:
        raise InputError(f"{what}: '{name}' is no input of the model. There are: {choices(layout.input_index)}.")
    k = layout.input_index[name]
    if name in layout.driven or not isinstance(model.system.inputs[k].signal, Constant):
        raise InputError(
            f"{what}: input '{name}' is driven by an element or declared as a course in time; expected a "
            "constant input."
        )
    for call in layout.constraints:
        if k in call.iu:
            raise InputError(
                f"{what}: input '{name}' moves {call.element.kind} '{call.element.name}'; expected an input of forces, "
                "since a constraint that jumps has no finite force."
            )
    return k


def declared_constant(model: Model, name: str) -> tuple[str, str]:
    """Element and path of a declared number '<element>.<key>'.

    Raises:
        InputError: there is none.
    """
    element, dot, path = name.partition(".")
    if not dot:
        raise InputError(f"constants: Expected '<element>.<key>', for example 'load.mass', got '{name}'.")
    declared_number(model.system, element, path)
    return element, path

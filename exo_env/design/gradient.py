"""An objective of one wearer's run and its gradient by the numbers of a design, without a second run.

A number x of a design moves several declared numbers p of the system, and may move independent states z of its start:

    dJ/dx = sum_p dJ/dp dp/dx + sum_z dJ/dz dz/dx

dJ/dp and dJ/dz come by adjoints of the recorded run (dms_core.sensitivity), all from one way back. dp/dx and dz/dx are
differences of declarations and of their assembled starts, of the second order and one-sided at a bound; nothing is
simulated for them. Where p depends on x affinely, as an attachment point does, they are exact up to rounding; the
gains, which go with 1 / lever, are so to 1e-8, and so is an assembled start.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from dms_core import Model, SolverOptions
from dms_core.errors import SimulationError
from dms_core.model.system import System
from dms_core.results import Result
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import Sensitivity, Start
from dms_core.validation import numbers_in
from exo_env.design.objectives import Objective
from exo_env.design.space import DesignSpace
from exo_env.design.wearer import Wearer, exercise_times, tracking_error
from exo_env.ecosystem.sensors import tension_sensor

INTERVAL = 0.05
"""Longest time between the samples of a run that an objective sees [s]; a movement of two seconds has its peak for
longer."""
STEP = 1e-4
"""Step of these differences, as a part of the width of the bounds: of attachment points, micrometres."""


class Slopes(NamedTuple):
    """What the numbers of a design move."""

    numbers: tuple[Number, ...]
    """Declared numbers that any of them moves and that the equations read."""
    by_design: np.ndarray
    """dp/dx, shape (declared numbers, n)."""
    start: np.ndarray
    """dq/dx, then dv/dx of the assembled start, shape (2 n_q, n)."""


def declared_numbers(system: System) -> dict[Number, float]:
    """Every number of a system's bodies, joints, forces and sensors."""
    elements = (*system.bodies, *system.constraints, *system.forces, *system.sensors)
    return {Number(x.name, path): value for x in elements for path, value in numbers_in(x)}


def slopes(wearer: Wearer, space: DesignSpace, x: np.ndarray, model: Model) -> Slopes:
    """What the numbers of a design move in the wearer's system.

    Args:
        wearer: who wears the device.
        space: the numbers that are designed.
        x: their values, shape (n,).
        model: the wearer's, of these values.
    """
    moved: dict[Number, np.ndarray] = {}
    start = np.zeros((2 * model.n_q, len(x)))
    for k in range(len(x)):
        nearby = [(weight, _moved(wearer, space, x, k, step, model)) for step, weight in _stencil(space, x, k)]
        start[:, k] = sum(weight * np.concatenate([m.start.q, m.start.v]) for weight, m in nearby)
        declared = [(weight, declared_numbers(m.system)) for weight, m in nearby]
        for number in declared[0][1]:
            values = [numbers[number] for _, numbers in declared]
            if any(value != values[0] for value in values):
                slope = sum(weight * value for (weight, _), value in zip(declared, values, strict=True))
                moved.setdefault(number, np.zeros(len(x)))[k] = slope
    read = [number for number in sorted(moved) if _is_read(model, number)]
    return Slopes(tuple(read), np.array([moved[p] for p in read]).reshape(len(read), len(x)), start)


def _stencil(space: DesignSpace, x: np.ndarray, k: int) -> list[tuple[float, float]]:
    """Steps from number k of a design and their weights in a difference of the second order that keeps the bounds."""
    h = STEP * (space.high[k] - space.low[k])
    if space.low[k] <= x[k] - h and x[k] + h <= space.high[k]:
        return [(h, 0.5 / h), (-h, -0.5 / h)]
    inwards = h if x[k] - h < space.low[k] else -h
    return [(0.0, -1.5 / inwards), (inwards, 2.0 / inwards), (2.0 * inwards, -0.5 / inwards)]


def _moved(wearer: Wearer, space: DesignSpace, x: np.ndarray, k: int, step: float, model: Model) -> Model:
    """The wearer's model where number k of a design is moved."""
    if step == 0.0:
        return model
    there = x.copy()
    there[k] += step
    return wearer.model(space.design(there))


def _is_read(model: Model, number: Number) -> bool:
    """Whether the equations read a number; of those of a start, such as poses, they do not."""
    direction = model.parameter_derivatives.direction(*number)
    return any(part.any() for part in (direction.dynamics, direction.constraints, direction.sensors))


class Trial:
    """One wearer's run in one design.

    Args:
        wearer: who wears the device.
        space: the numbers that are designed.
        x: their values, shape (n,).
        options: of the solver.

    Raises:
        InputError: there can be no such device.
        SimulationError: the run did not reach its end; names the wearer.
    """

    def __init__(self, wearer: Wearer, space: DesignSpace, x: np.ndarray, options: SolverOptions) -> None:
        self.wearer, self.space, self.x = wearer, space, x
        self.ropes = tuple(space.today.device.ropes)
        self.model = wearer.model(space.design(x))
        self.times = exercise_times(wearer.exercise, INTERVAL)
        self.record = RecordedWorld(self.model, options)
        readings = []
        for t in self.times:
            if self.record.advance(t) is not Result.SUCCESS:
                raise SimulationError(f"{wearer.name}: {self.record.message}")
            readings.append(self.record.read().copy())
        names = [name for name, _ in self.model.layout.outputs]
        y = dict(zip(names, np.array(readings).T, strict=True))
        self.off = tracking_error(wearer.exercise, self.times, y["elbow_angle.angle"])
        """Tracking error [deg]."""
        self.tension = max(float(y[tension_sensor(rope)].max()) for rope in self.ropes)
        """Largest of any rope [N]."""

    def value(self, objective: Objective) -> float:
        """J of the run."""
        outputs = objective.outputs(self.ropes, self.times)
        return objective.of(self.ropes, Sensitivity(self.record, outputs, []).value())[0]

    @cached_property
    def _slopes(self) -> Slopes:
        return slopes(self.wearer, self.space, self.x, self.model)

    def gradient(self, objective: Objective) -> tuple[float, np.ndarray]:
        """J of the run, and its gradient by the numbers of the design, shape (n,)."""
        s = self._slopes
        outputs, n_p = objective.outputs(self.ropes, self.times), len(s.numbers)
        states = Sensitivity(self.record, [], []).states
        run = Sensitivity(self.record, outputs, [*s.numbers, *(Start(name) for name in states)])
        value, by_readings = objective.of(self.ropes, run.value())
        by = run.adjoint(weights=by_readings[None])[0]
        return value, by[:n_p] @ s.by_design + by[n_p:] @ s.start[[self._row(name) for name in states]]

    def _row(self, state: str) -> int:
        """Row of a state, 'q.NAME' or 'v.NAME', in (q, v)."""
        return self.model.layout.index[state[2:]] + (self.model.n_q if state[0] == "v" else 0)

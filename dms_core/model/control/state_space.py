"""Linear block between sensors and inputs: a transfer function, an observer, a controller of any order.

    xdot = A x + B z,    y = C x + D z

z are sensor components, then inputs u(t); y drives inputs. Readings and outputs are rates of own coordinates, as in
sensor_pid.py.
"""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.model.element import Coordinate, Force, Pattern, Placement

Matrix = tuple[tuple[float, ...], ...]


@compiled
def state_space(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: numbers of states, sensors, inputs and outputs; par: [A | B], then [C | D], row by row.

    Local coordinates are the states, the readings of the sensors, and the outputs.
    """
    n, sensors, wide = ip[0], ip[1], ip[0] + ip[1] + ip[2]
    for i in range(n + ip[3]):
        row, at = _row(ip, i), i * wide
        total = v[row]
        for j in range(n):
            total -= par[at + j] * q[j]
        for j in range(n, n + sensors):
            total -= par[at + j] * v[j]
        for j in range(ip[2]):
            total -= par[at + n + sensors + j] * u[j, 0]
        r[row] = total
        if level > 0:
            for j in range(n):
                Jq[row, j] = -par[at + j]
            for j in range(n, n + sensors):
                Jv[row, j] = -par[at + j]
            Jv[row, row] = 1.0


@compiled
def _row(ip, i):
    """Row of equation i: the readings' rows, between those of states and outputs, are other calls'."""
    return i if i < ip[0] else i + ip[1]


@compiled
def state_space_by_input(ip, par, q, v, a, u, Ju):
    """The rows by the inputs."""
    wide = ip[0] + ip[1] + ip[2]
    for i in range(ip[0] + ip[3]):
        for j in range(ip[2]):
            Ju[_row(ip, i), j, 0] = -par[i * wide + ip[0] + ip[1] + j]


class StateSpace(Force):
    """Linear block xdot = A x + B z, y = C x + D z, from sensor components and inputs z to driven inputs y.

    It owns the coordinates 'x1', 'x2', ..., and 'reading1', ... and 'output1', ..., whose rates are readings and y.
    """

    kind: ClassVar[str] = "state_space"
    kernel: ClassVar = state_space
    input_kernel: ClassVar = state_space_by_input
    sensors: tuple[str, ...] = Field(default=(), description="sensor components, as 'elbow.angle': first part of z")
    inputs: tuple[str, ...] = Field(default=(), description="names of inputs: second part of z")
    outputs: tuple[str, ...] = Field(default=(), description="y: names of the driven inputs; none has a signal")
    A: Matrix = Field(default=(), description="shape (n, n), by rows; empty without states [1/s]")
    B: Matrix = Field(default=(), description="shape (n, sensors and inputs)")
    C: Matrix = Field(default=(), description="shape (outputs, n)")
    D: Matrix = Field(default=(), description="shape (outputs, sensors and inputs); default: 0")
    start: tuple[float, ...] = Field(default=(), description="x at the start; default: 0")
    nominal: float = Field(default=1.0, gt=0.0, description="size of states, readings and outputs, for tolerances")

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        n, m, k = len(self.A), len(self.sensors) + len(self.inputs), len(self.outputs)
        if n + k == 0:
            raise ValueError("neither states nor outputs: Expected rows of A, or outputs with D")
        for key, rows, columns in (("A", n, n), ("B", n, m), ("C", k, n), ("D", k, m)):
            given: Matrix = getattr(self, key)
            # What has nothing in it may be left out, and so may D.
            if given == () and (key == "D" or rows == 0 or columns == 0):
                continue
            if len(given) != rows or any(len(row) != columns for row in given):
                lengths = ", ".join(str(len(row)) for row in given)
                raise ValueError(
                    f"{key}: Expected {rows} rows of {columns} numbers, for {n} states, {m} sensors and inputs, and "
                    f"{k} outputs; got {len(given)} rows of {lengths or 0}"
                )
        if self.start and len(self.start) != n:
            raise ValueError(f"start: Expected {n} numbers, one for each state, got {len(self.start)}")
        for what in ("sensors", "inputs", "outputs"):
            names = getattr(self, what)
            if twice := [name for name in names if names.count(name) > 1]:
                raise ValueError(f"{what}: '{twice[0]}' is named twice; Expected each once")
        return self

    def coordinates(self) -> tuple[Coordinate, ...]:
        """States, a reading for each sensor, and outputs."""
        starts = dict(enumerate(self.start))
        named = [(f"x{k + 1}", starts.get(k, 0.0)) for k in range(len(self.A))]
        named += [(f"reading{k + 1}", 0.0) for k in range(len(self.sensors))]
        named += [(f"output{k + 1}", 0.0) for k in range(len(self.outputs))]
        size = self.nominal
        return tuple(Coordinate(name, x, scale=size, rate_scale=size, differential_rate=False) for name, x in named)

    def input_names(self) -> tuple[str, ...]:
        """The inputs among the signals."""
        return self.inputs

    def driven_inputs(self) -> tuple[tuple[str, str], ...]:
        """The outputs."""
        return tuple((name, f"output{k + 1}") for k, name in enumerate(self.outputs))

    def placements(self, system) -> tuple[Placement, ...]:
        """A call for each reading, then the block's own rows."""
        readings = [
            Placement(coordinates=(f"{self.name}.reading{k + 1}",), reads=sensor)
            for k, sensor in enumerate(self.sensors)
        ]
        return (*readings, self.place(system))

    def place(self, system) -> Placement:
        """The own coordinates."""
        own = tuple(f"{self.name}.{c.name}" for c in self.coordinates())
        n, s, i, k = len(self.A), len(self.sensors), len(self.inputs), len(self.outputs)
        upper = np.hstack([np.reshape(self.A, (n, n)), np.reshape(self.B, (n, s + i))])
        passed = np.reshape(self.D, (k, s + i)) if self.D else np.zeros((k, s + i))
        lower = np.hstack([np.reshape(self.C, (k, n)), passed])
        table = np.vstack([upper, lower])
        rows = [*range(n), *range(n + s, n + s + k)]
        by_q, by_v, none = (np.zeros((len(own), len(own)), bool) for _ in range(3))
        by_q[rows, :n] = table[:, :n] != 0.0
        by_v[rows, n : n + s] = table[:, n : n + s] != 0.0
        by_v[rows, rows] = True
        return Placement(
            coordinates=own,
            inputs=self.inputs,
            integers=(n, s, i, k),
            numbers=tuple(float(x) for x in table.ravel()),
            pattern=Pattern(by_q, by_v, none),
        )

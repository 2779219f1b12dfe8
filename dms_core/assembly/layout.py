"""From names to numbers: which coordinate, row and input has which index (paper eq. 1 to 4).

The vector q is followed by the ground's seven constant coordinates (0, 0, 0, 1, 0, 0, 0), so that an element on the
ground reads and writes like any other; what it writes to the ground's rows falls into slots nobody reads.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dms_core.assembly.pattern.connections import connected, driven_inputs
from dms_core.errors import ModelError, choices
from dms_core.model.element import GROUND, Constraint, Coordinate, DynamicElement, Placement, Sensor
from dms_core.model.system import System

GROUND_COORDINATES = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Call:
    """One kernel call: the element, its placement, and the global indices of its local data."""

    element: DynamicElement | Constraint | Sensor
    placement: Placement
    iq: np.ndarray
    """Global coordinate of each local one, shape (n,); n_q + k for the ground's k-th constant."""
    iu: np.ndarray
    """Global input of each local one."""
    row: int = 0
    """First constraint row (constraints), first component of y (sensors)."""
    rows: int = 0
    """Number of constraint rows or of sensor components."""
    sensor: Sensor | None = None
    """Dynamic calls only: the sensor whose kernel this call is for, see connections.py."""

    @property
    def law(self) -> tuple[str, ...]:
        """What is evaluated, and of what, by names: those of classes, without the module, which may move."""
        classes = [f"{x.kind} {type(x).__qualname__}" for x in (self.element, self.sensor) if x is not None]
        return (*classes, self.placement.constraint, *self.placement.sources)


class Layout:
    """Indices of everything a system declares.

    Args:
        system: the declarations.

    Raises:
        ModelError: an element names a body, coordinate or input that does not exist.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.coordinates: list[Coordinate] = []
        self.names: list[str] = []
        self.offset: dict[str, int] = {}
        for element in (*system.bodies, *system.forces):
            self.offset[element.name] = len(self.names)
            for c in element.coordinates():
                self.coordinates.append(c)
                self.names.append(f"{element.name}.{c.name}")
        self.n_q = len(self.names)
        if self.n_q == 0:
            raise ModelError(f"system '{system.name}' has no coordinates: declare at least one body or equation.")
        self.index = {name: k for k, name in enumerate(self.names)}
        self.input_index = {u.name: k for k, u in enumerate(system.inputs)}
        self.driven = driven_inputs(system, self.index)
        """Coordinate whose rate is the input, for each input that an element drives."""
        self.dynamics = [self._call(e, p) for e in (*system.bodies, *system.forces) for p in _placed(e, system)]
        self.constraints: list[Call] = []
        self.row_names: list[str] = []
        for constraint in system.constraints:
            rows = constraint.rows()
            self.constraints.append(
                self._call(constraint, _placed(constraint, system)[0], len(self.row_names), len(rows))
            )
            self.row_names += [f"{constraint.name}.{row}" for row in rows]
        self.n_phi = len(self.row_names)
        self.sensors: list[Call] = []
        self.outputs: list[tuple[str, str]] = []
        for sensor in system.sensors:
            parts = sensor.outputs()
            self.sensors.append(self._call(sensor, _placed(sensor, system)[0], len(self.outputs), len(parts)))
            self.outputs += [(f"{sensor.name}.{part}" if part else sensor.name, unit) for part, unit in parts]

    @cached_property
    def digest(self) -> str:
        """Equal where `same_structure` holds, in this process or another."""
        calls = [*self.dynamics, *self.constraints, *self.sensors]
        parts = [(c.law, c.iq.tolist(), c.iu.tolist(), list(c.placement.integers)) for c in calls]
        counts = [len(x) for x in (self.dynamics, self.constraints, self.sensors)]
        everything = (self.names, self.row_names, self.outputs, sorted(self.input_index.items()), counts, parts)
        return hashlib.sha256(repr(everything).encode()).hexdigest()

    @cached_property
    def of_bodies(self) -> int:
        """Number of the coordinates of bodies, which come first."""
        return sum(len(body.coordinates()) for body in self.system.bodies)

    def body_indices(self, name: str) -> np.ndarray:
        """Global indices of a body's seven local coordinates."""
        ground = self.n_q + np.arange(7)
        if name == GROUND:
            return ground
        if self.system.body(name).rigid:  # type: ignore[union-attr]
            return self.offset[name] + np.arange(7)
        return np.concatenate([self.offset[name] + np.arange(3), ground[3:]])

    def _call(self, element, placement: Placement, row: int = 0, rows: int = 0) -> Call:
        who = f"{element.kind} '{element.name}'"
        twice = {b for b in placement.bodies if placement.bodies.count(b) > 1}
        if twice and not isinstance(element, Sensor):
            raise ModelError(f"{who}: Expected two different bodies, got '{twice.pop()}' twice.", element.name)
        placement, sensor = self._connected(element, placement, who)
        iq = [self.body_indices(b) for b in placement.bodies]
        iq.append(np.array([self._index(element, "coordinate", c, self.index) for c in placement.coordinates], int))
        iu = np.array([self._index(element, "input", u, self.input_index) for u in placement.inputs], int)
        return Call(element, placement, np.concatenate(iq).astype(np.int32), iu.astype(np.int32), row, rows, sensor)

    def _connected(self, element, placement: Placement, who: str) -> tuple[Placement, Sensor | None]:
        """The placement as it is where signals of the system are read."""
        try:
            return connected(self.system, element, placement, self.driven)
        except ModelError as error:
            raise ModelError(str(error) if who in str(error) else f"{who}: {error}", element.name) from None

    @staticmethod
    def _index(element, what: str, name: str, table: dict[str, int]) -> int:
        if name not in table:
            who = f"{element.kind} '{element.name}'"
            raise ModelError(f"{who}: {what} '{name}' does not exist. Declared: {choices(table)}.", element.name)
        return table[name]

    def unread_inputs(self) -> list[str]:
        """Names of the inputs that no element reads."""
        read = {k for call in (*self.dynamics, *self.constraints, *self.sensors) for k in call.iu}
        return [name for name, k in self.input_index.items() if k not in read]

    def put_driven(self, u: np.ndarray, v: np.ndarray) -> None:
        """Values of driven inputs into u, shape (..., n_u), from rates v of the coordinates, shape (..., n_q)."""
        for name, coordinate in self.driven.items():
            u[..., self.input_index[name]] = v[..., self.index[coordinate]]

    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Declared q and v with the ground behind them, each of shape (n_q + 7,)."""
        q = np.concatenate([[c.start for c in self.coordinates], GROUND_COORDINATES])
        v = np.concatenate([[c.rate for c in self.coordinates], np.zeros(7)])
        return q, v


def _placed(element: DynamicElement | Constraint | Sensor, system: System) -> tuple[Placement, ...]:
    """Placements of an element; a name in it that does not exist is an error that names the element, too."""
    try:
        return element.placements(system) if isinstance(element, DynamicElement) else (element.place(system),)
    except ModelError as error:
        who = f"{element.kind} '{element.name}'"
        raise ModelError(str(error) if who in str(error) else f"{who}: {error}", element.name) from None


def same_structure(one: Layout, other: Layout) -> bool:
    """True if two layouts differ in numbers only: same names, same calls with the same indices and integers."""
    if one.names != other.names or one.row_names != other.row_names or one.outputs != other.outputs:
        return False
    pairs = [(one.dynamics, other.dynamics), (one.constraints, other.constraints), (one.sensors, other.sensors)]
    return one.input_index == other.input_index and all(
        len(a) == len(b) and all(_same_call(x, y) for x, y in zip(a, b, strict=True)) for a, b in pairs
    )


def _same_call(one: Call, other: Call) -> bool:
    """True if two calls differ in their numbers at most."""
    return (
        type(one.element) is type(other.element)
        and one.law == other.law
        and np.array_equal(one.iq, other.iq)
        and np.array_equal(one.iu, other.iu)
        and tuple(one.placement.integers) == tuple(other.placement.integers)
    )

"""Tables of the sensors that outputs of a run read, and no others, for the compiled code of readings.py."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dms_core.assembly.derivatives.parameter_derivatives import Direction
from dms_core.assembly.model import Model
from dms_core.assembly.readings.sensing import Composition, Partials, Sensing, new_sensing
from dms_core.assembly.tables import Calls, Work, flat
from dms_core.compiled.arena import Packed, fields
from dms_core.sensitivity.tangents.tables import Adjoints, new_adjoints


class Reading(NamedTuple):
    """Sensors with a declared number moved to both sides."""

    high: Sensing
    low: Sensing


class Readings(NamedTuple):
    """Some sensors of a model, and storage for their derivatives; k counts the components that are asked for."""

    sensing: Sensing
    partials: Partials
    """Of all components of these sensors."""
    asked: np.ndarray
    """Places of those that are asked for, (k,)."""
    psi_2: np.ndarray
    """Adjoints of r2, shape (k, n_q + 7)."""
    psi_3: np.ndarray
    """Adjoints of phi_a, shape (k, n_phi)."""
    moved: np.ndarray
    """Addresses of packed `Reading`s, (n_p,)."""
    y: np.ndarray
    """Values at the state that was read last, (k,)."""
    found: Adjoints
    """Derivatives there."""


READING, READINGS = fields(Reading), fields(Readings)


def _parts(x: np.ndarray, ptr: np.ndarray, which: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Those slices of a flat array, flat again, and where each begins."""
    return flat([x[ptr[e] : ptr[e + 1]] for e in which], x.dtype)


def _some_calls(calls: Calls, which: Sequence[int]) -> Calls:
    """Those calls alone, their rows behind each other."""
    found = {}
    for name in ("iq", "iu", "ip", "par", "solved"):
        found[name], found[f"{name}_ptr"] = _parts(getattr(calls, name), getattr(calls, f"{name}_ptr"), which)
    row = np.concatenate([[0], np.cumsum([calls.row[e + 1] - calls.row[e] for e in which])]).astype(np.int64)
    return Calls(kernel=calls.kernel[which], row=row, moving=np.arange(len(which)), **found)


def calls_of(model: Model, rows: Sequence[int]) -> list[int]:
    """Sensors that have any of these components."""
    ends = model.sensing.values.sensors.values.row[1:]
    return sorted({int(np.searchsorted(ends, row, side="right")) for row in rows})


def reads_welds(model: Model, which: Sequence[int]) -> bool:
    """Whether any of these sensors reads a multiplier between welded bodies, which no step solves for."""
    constraints, composed = model.sensing.values.constraints.values, model.sensing.values.composed.values
    read = {row for e in composed.constraint[list(which)] if e >= 0
            for row in range(constraints.row[e], constraints.row[e + 1])}  # fmt: skip
    return bool(read & set(model.welds.rows))


class SomeReadings:
    """Packed Readings of some sensors of a world.

    Args:
        model: a compiled model.
        rows: components that are asked for, rising.
        work: work arrays of the world's state.
        directions: declared numbers.

    Attributes:
        found: derivatives of these components at the state that was read last.
        moved: the sensors with each declared number moved to both sides, packed `Reading`s.
    """

    def __init__(self, model: Model, rows: Sequence[int], work: Work, directions: Sequence[Direction]) -> None:
        whole: Sensing = model.sensing.values
        calls, own, packed, which = whole.sensors.values, whole.composed.values, Packed(work), calls_of(model, rows)
        every = np.concatenate([np.zeros(0, np.int64), *(np.arange(calls.row[e], calls.row[e + 1]) for e in which)])
        composed = Packed(Composition(
            own.kind[which], own.constraint[which], *_parts(own.source, own.source_ptr, which)
        ))  # fmt: skip

        def sensing(sign: float, direction: Direction | None) -> Sensing:
            def moved(table: Calls, change: np.ndarray) -> Calls:
                return table._replace(par=table.par + sign * change)

            d, c, sensors = whole.dynamics, whole.constraints, calls
            if direction is not None:
                d, c = Packed(moved(d.values, direction.dynamics)), Packed(moved(c.values, direction.constraints))
                sensors = moved(calls, direction.sensors)
            return new_sensing(d, c, Packed(_some_calls(sensors, which)), composed, packed).values

        self.moved = [Packed(Reading(sensing(1.0, x), sensing(-1.0, x))) for x in directions]
        n, m, k = model.n_q + 7, model.n_phi, len(rows)
        self.found: Adjoints = new_adjoints(model, k, len(directions)).values
        partials = Partials(*(np.zeros((len(every), size)) for size in (n, n, n, m, len(model.layout.input_index))))
        self.packed = Packed(Readings(
            sensing(0.0, None), partials, np.searchsorted(every, rows).astype(np.int64), np.zeros((k, n)),
            np.zeros((k, m)), np.array([x.table.ctypes.data for x in self.moved], np.int64), np.zeros(k), self.found,
        ))  # fmt: skip

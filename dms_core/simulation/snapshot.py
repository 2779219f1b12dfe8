"""A world as a value: everything that its future depends on, to be put back later, here or in another process.

That is the present state (q, v, qdot, vdot, lam, mu), the past of the method, clock and counts, the event that it
stands on, the inputs as they were set, the factorised matrices that are still in use, and the order of elimination,
which may have been chosen anew. The model is not part of it: a snapshot names its model by the structure and by all
numbers of it, and goes into no other. Inputs that are functions of time, and kernels, are told apart by their names
only.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np

from dms_core.assembly.model import Model
from dms_core.assembly.pattern.sparsity import NewtonPattern, RatePattern
from dms_core.assembly.tables import Signals, Tables
from dms_core.compiled.arena import Packed
from dms_core.errors import InputError
from dms_core.linear.lu import LuTables
from dms_core.model.signals import Function
from dms_core.results import Result
from dms_core.simulation.events import Crossing
from dms_core.simulation.methods.radau_state import NOT_USED
from dms_core.simulation.options import SolverOptions
from dms_core.simulation.state import CLOCK, State, with_storage

GLOBAL_WORK = ("q", "v", "a", "lam", "mu", "u", "y", "r2", "gmu", "phi", "phi_v", "phi_a")
"""Fields of Work that outlive a kernel call; the others are local arrays, written before they are read."""


class Ending(NamedTuple):
    """How the last call of `advance` ended, beside its result."""

    crossing: Crossing | None = None
    """The event, where it was one; the next call knows by it that the world stands on that value."""
    crossed_at: float = -math.inf
    """When that was [s]."""
    why: str = ""
    """Of a failure, in sentences."""


NO_EVENT = Ending()


class Orders(NamedTuple):
    """What of a world's tables was chosen at some state: rows that are solved for, scatter, orders."""

    active: np.ndarray
    newton: NewtonPattern
    newton_lu: LuTables
    rates: RatePattern
    rate_lu: LuTables
    redundant: int
    c0_ordered: np.ndarray


@dataclass(frozen=True)
class Snapshot:
    """An immutable copy of a world; it can be compared, pickled and restored any number of times."""

    system: str
    """Name of the system."""
    time: float
    """Time reached [s]."""
    options: SolverOptions
    result: Result
    structure: str = field(repr=False)
    """Digest of elements, joints and inputs."""
    numbers: str = field(repr=False)
    """Digest of all numbers of the model."""
    arrays: tuple[bytes, ...] = field(repr=False)
    """The arrays of `held_arrays`, in their order."""
    orders: Orders = field(repr=False, compare=False)
    ending: Ending = NO_EVENT


def held_arrays(state: State) -> Iterator[np.ndarray]:
    """Every array of a world that its future may depend on."""
    return (array for _, array in _held_parts(state))


def _held_parts(state: State) -> Iterator[tuple[str, np.ndarray]]:
    """Name and array of each part of `held_arrays`."""
    yield from ((f"w.{name}", getattr(state.w, name)) for name in GLOBAL_WORK)
    yield from (("signals.t", state.signals.t), ("signals.c", state.signals.c))
    yield "counts", state.counts
    # Whole numbers elsewhere are addresses of machine code, which belong to a process.
    for name, x in state._asdict().items():
        if isinstance(x, np.ndarray) and x.dtype == np.float64:
            yield name, x
    if state.radau is not NOT_USED:
        yield from ((f"radau.{name}", x) for name, x in state.radau.values._asdict().items())


def _digest(*parts: Any) -> str:
    digest = hashlib.sha256()
    for part in parts:
        data = np.ascontiguousarray(part).tobytes() if isinstance(part, np.ndarray) else str(part).encode()
        digest.update(len(data).to_bytes(8, "little") + data)
    return digest.hexdigest()


def _structure(model: Model, signals: Signals) -> str:
    """Digest of the layout and of the form of the inputs; functions of time are known by their names only."""
    functions = [
        getattr(i.signal.function, "__qualname__", "") for i in model.system.inputs if isinstance(i.signal, Function)
    ]
    return _digest(model.layout.digest, signals.kind, signals.ptr, signals.jumps, functions)


def take(
    model: Model, tables: Tables, state: State, options: SolverOptions, result: Result, ending: Ending
) -> Snapshot:
    """The world as it is now."""
    orders = Orders(*(getattr(tables, name) for name in Orders._fields))
    return Snapshot(
        model.system.name, float(state.clock[CLOCK.t]), options, result, _structure(model, state.signals),
        _digest(*model.numbers), tuple(x.tobytes() for x in held_arrays(state)), orders, ending,
    )  # fmt: skip


def check(snapshot: Snapshot, model: Model, signals: Signals, options: SolverOptions) -> None:
    """Refuse what another model or other options have made.

    Raises:
        InputError: says which of them differs.
    """
    own, what = model.system.name, f"The snapshot of system '{snapshot.system}' at t = {snapshot.time:.6g} s"
    if snapshot.structure != _structure(model, signals):
        raise InputError(
            f"{what} cannot be restored in a world of system '{own}': elements, joints, sensors or the form of inputs "
            "differ. Expected a world of the same model."
        )
    if snapshot.numbers != _digest(*model.numbers):
        raise InputError(
            f"{what} cannot be restored in a world of system '{own}' whose numbers (masses, lengths, gains) differ. "
            "Expected a world of the same model."
        )
    for one in fields(options):
        there, here = getattr(snapshot.options, one.name), getattr(options, one.name)
        if there != here:
            raise InputError(f"{what} was taken with {one.name} = {there!r}; this world has {one.name} = {here!r}.")
    if not isinstance(snapshot.orders, Orders):
        raise InputError(f"{what} is damaged: expected orders of elimination, got {type(snapshot.orders).__name__}.")


def tables_with(orders: Orders, present: Packed, model: Model) -> Packed:
    """Tables of the model with these orders: the present ones, or the model's own, where these have them."""
    for tables in (present, model.tables):
        if tables.values.newton_lu is orders.newton_lu and tables.values.rate_lu is orders.rate_lu:
            return tables
    return Packed(model.tables.values._replace(**orders._asdict()))


def put_back(snapshot: Snapshot, tables: Packed, old_tables: Packed, world: Packed) -> Packed:
    """The packed world with the snapshot's values; arrays stay where they are unless the orders differ.

    Raises:
        InputError: the snapshot is damaged; names the part. Nothing was written then.
    """
    world = _fitted(world, tables, old_tables)
    _check_sizes(snapshot, list(_held_parts(world.values)))
    return _written(world, snapshot.arrays)


class Mark(NamedTuple):
    """A place in time that the same world can be put back to: a Snapshot without what tells it from other worlds."""

    time: float
    result: Result
    tables: Packed
    arrays: tuple[bytes, ...]
    ending: Ending
    rows: int
    """Pieces of the record until then."""


def mark(tables: Packed, state: State, result: Result, ending: Ending) -> Mark:
    """The world as it is now, without a record."""
    return Mark(float(state.clock[CLOCK.t]), result, tables, tuple(x.tobytes() for x in held_arrays(state)), ending, 0)


def go_back(past: Mark, tables: Packed, world: Packed) -> Packed:
    """The packed world, solved with `tables` now, with the values of a mark."""
    return _written(_fitted(world, past.tables, tables), past.arrays)


def _fitted(world: Packed, tables: Packed, old_tables: Packed) -> Packed:
    """The packed world with storage for these tables."""
    return world if tables is old_tables else with_storage(tables.values, world.values)


def _written(world: Packed, arrays: tuple[bytes, ...]) -> Packed:
    """The world, whose arrays get these bytes."""
    for array, data in zip(held_arrays(world.values), arrays, strict=True):
        array[...] = np.frombuffer(data, array.dtype).reshape(array.shape)
    return world


def _check_sizes(snapshot: Snapshot, parts: list[tuple[str, np.ndarray]]) -> None:
    """Refuse a snapshot that lacks a part, or whose parts are of other sizes than the world's."""
    what = f"The snapshot of system '{snapshot.system}' at t = {snapshot.time:.6g} s is damaged"
    if len(snapshot.arrays) != len(parts):
        raise InputError(f"{what}: expected {len(parts)} arrays, got {len(snapshot.arrays)}.")
    for (name, array), data in zip(parts, snapshot.arrays, strict=True):
        if len(data) != array.nbytes:
            raise InputError(f"{what}: expected {array.nbytes} bytes of '{name}', got {len(data)}.")

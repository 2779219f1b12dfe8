"""Derivatives of residual and sensors by a declared number: a mass, an attachment point, a gain.

A declared number p moves numbers `par` of several kernels: a mass that of its body and of its weight, a centre of mass
the arms of all joints of that body. dpar/dp is the central difference of two declared systems at p - h and p + h, with

    h = STEP |p|, or STEP where p = 0          STEP = 6e-6 (input_derivatives.py)

What an element's `parameter_kernel` gives is then exact but for dpar/dp; kernels without one, all constraints and all
sensors are differenced over the same two sets of numbers.

Where the numbers of a model were written in place (`Model.numbers`), its own declaration is that of other numbers, and
dpar/dp, which may depend on them, cannot be had from it: the system that declares the written numbers must be handed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel

from dms_core.assembly.derivatives.blocks import Derivatives, OperatingPoint
from dms_core.assembly.derivatives.input_derivatives import STEP
from dms_core.assembly.layout import Layout, same_structure
from dms_core.assembly.local import clear, gather, views
from dms_core.assembly.readings.sensing import Sensing, evaluate_sensors, new_sensing
from dms_core.assembly.residual import evaluate_residual
from dms_core.assembly.tables import Calls, flat
from dms_core.compiled.arena import Packed, matrix
from dms_core.compiled.calls import call_entry
from dms_core.compiled.entries import SLOPES, Slopes, derivative_addresses
from dms_core.compiled.jit import compiled
from dms_core.errors import InputError, choices
from dms_core.model.element import PARAMETER_DERIVATIVE
from dms_core.model.system import System

AGREEMENT = 1e-6
"""Relative difference up to which written numbers are those of a declaration: an environment's agree to 1e-9, and the
error of a derivative is of the size of the difference."""


class ParameterBlocks(NamedTuple):
    """Derivatives of residual and sensors by one declared number p, at fixed q, qdot, v, vdot, lam, mu and u."""

    r1: np.ndarray
    """-(phi_q^T mu) by p, shape (n_q,)."""
    r2: np.ndarray
    r3: np.ndarray
    """phi by p, shape (n_phi,)."""
    r4: np.ndarray
    y: np.ndarray
    """Sensors by p, shape (n_y,); by differences."""
    step: float
    """h of the differences, in the unit of p."""
    differenced: tuple[str, ...]
    """Elements and constraints whose kernels were differenced; the others that p moves gave an analytic derivative."""


class Direction(NamedTuple):
    """Half the difference of all numbers between p + h and p - h."""

    step: float
    dynamics: np.ndarray
    constraints: np.ndarray
    sensors: np.ndarray


@compiled
def dynamic_by_parameter(calls, kernel, e, w, slopes):
    """Jp of dynamic call e at the state in w, into the packed Slopes; `kernel` is the address of its entry."""
    Jp = matrix(slopes, SLOPES.Jp)
    gather(views(calls, w), e, True)
    clear(Jp, Jp.shape[0], Jp.shape[1])
    call_entry(kernel, calls, e, slopes, 1)


def _number(who: str, value: Any, keys: list[str]) -> float:
    """The declared number at the end of these keys."""
    for k, key in enumerate(keys):
        at = f"{who}: '{'.'.join(keys[: k + 1])}'"
        if isinstance(value, BaseModel):
            if key not in type(value).model_fields:
                raise InputError(f"{at} does not exist. Declared: {choices(type(value).model_fields)}.")
            value = getattr(value, key)
        elif isinstance(value, tuple):
            if not key.isdigit() or int(key) >= len(value):
                raise InputError(f"{at}: expected a place from 0 to {len(value) - 1}, got '{key}'.")
            value = value[int(key)]
        else:
            raise InputError(f"{at}: nothing can follow {value!r}.")
    if not isinstance(value, float):
        raise InputError(f"{who}: expected '{'.'.join(keys)}' to be a number with a derivative, got {value!r}.")
    return value


def _moved(value: Any, keys: list[str], change: float) -> Any:
    """The same declaration with the number at the end of the keys moved; nothing is validated again."""
    if not keys:
        return value + change
    key, rest = keys[0], keys[1:]
    if isinstance(value, BaseModel):
        return value.model_copy(update={key: _moved(getattr(value, key), rest, change)})
    return tuple(_moved(x, rest, change) if k == int(key) else x for k, x in enumerate(value))


def _system_with(system: System, element: Any) -> System:
    """The same system with one declaration replaced."""
    if element.name in system.composed:
        raise InputError(f"'{element.name}' is a part of '{system.composed[element.name]}'; name a number of that.")
    sections = ("compositions", "bodies", "constraints", "forces", "sensors", "inputs")
    replaced = {name: [element if x.name == element.name else x for x in system.own(name)] for name in sections}
    return System(system.name, **replaced)  # type: ignore[arg-type]


class ParameterDerivatives:
    """Derivatives of one model by declared numbers; what a number moves is found once.

    Args:
        layout: indices of the system's elements.
        sensing: a packed Sensing of that layout; numbers written into its tables later are read.
        derivatives: those of the same `sensing`, which put an operating point into its work arrays.
    """

    def __init__(self, layout: Layout, sensing: Packed, derivatives: Derivatives) -> None:
        self._layout = layout
        self._sensing: Sensing = sensing.values
        self._derivatives = derivatives
        calls = layout.dynamics
        self._kernels = derivative_addresses(calls, "parameter_kernel", PARAMETER_DERIVATIVE)
        work = self._sensing.work.values
        most = max(len(c.placement.numbers) for c in calls)
        slopes = Slopes(work.q_l, work.v_l, work.a_l, work.u_l, np.zeros((1, 3)), np.zeros((len(work.q_l), most)))
        self._slopes = Packed(slopes)
        self._directions: dict[tuple[str, str], Direction] = {}

    def _direction(self, name: str, path: str, declared: Layout) -> Direction:
        """What the number moves in a declared layout.

        Raises:
            InputError: there is no such number, or moving it changes more than numbers.
        """
        own = declared is self._layout
        if own and (name, path) in self._directions:
            return self._directions[name, path]
        system, keys = declared.system, path.split(".")
        element = system.element(name)
        p = _number(f"{element.kind} '{name}'", element, keys)
        h = STEP * (abs(p) or 1.0)
        low, high = (Layout(_system_with(system, _moved(element, keys, x))) for x in (-h, h))
        if not (same_structure(low, declared) and same_structure(high, declared)):
            raise InputError(f"{element.kind} '{name}': '{path}' = {p} cannot be moved alone: the structure changes.")
        halves = [
            0.5 * (_numbers(a) - _numbers(b))
            for a, b in zip(
                (high.dynamics, high.constraints, high.sensors), (low.dynamics, low.constraints, low.sensors),
                strict=True,
            )
        ]  # fmt: skip
        direction = Direction(h, *halves)
        if own:
            self._directions[name, path] = direction
        return direction

    def _declared(self, system: System | None) -> Layout:
        """Layout of a handed system, or the model's own.

        Raises:
            InputError: the system has other elements, or joins them otherwise.
        """
        if system is None or system is self._layout.system:
            return self._layout
        declared = Layout(system)
        if not same_structure(declared, self._layout):
            raise InputError(
                f"system = '{system.name}' has other elements or joins than the model of '{self._layout.system.name}'; "
                "expected a system that differs from the model's in numbers only."
            )
        return declared

    def _check_written(self, who: str, direction: Direction, declared: Layout) -> None:
        """Refuse to move numbers of a kernel that are not those of the declaration.

        Raises:
            InputError: names the element whose numbers differ, and says what to hand.
        """
        sensing = self._sensing
        for calls, table, moved in (
            (declared.dynamics, sensing.dynamics.values, direction.dynamics),
            (declared.constraints, sensing.constraints.values, direction.constraints),
            (declared.sensors, sensing.sensors.values, direction.sensors),
        ):
            for e, call in enumerate(calls):
                part = slice(table.par_ptr[e], table.par_ptr[e + 1])
                if not moved[part].any():
                    continue
                here, there = table.par[part], np.asarray(call.placement.numbers, float)
                size = AGREEMENT * (np.abs(there) + AGREEMENT * np.abs(there).max())
                if (wrong := np.flatnonzero(~(np.abs(here - there) <= size))).size:
                    k = int(wrong[0])
                    raise InputError(
                        f"{who} moves numbers of '{call.element.name}' that were written in place: the model holds "
                        f"{here[k]:.6g} where the declaration gives {there[k]:.6g}. Hand the system that declares the "
                        "present numbers: parameter_blocks(..., system=...)."
                    )

    def direction(self, name: str, path: str, system: System | None = None) -> Direction:
        """What the number `path` of element `name` moves; `system` declares the present numbers.

        Raises:
            InputError: as in `of`.
        """
        declared = self._declared(system)
        direction = self._direction(name, path, declared)
        self._check_written(f"{declared.system.element(name).kind} '{name}': '{path}'", direction, declared)
        return direction

    def of(self, name: str, path: str, point: OperatingPoint, system: System | None = None) -> ParameterBlocks:
        """Derivatives by the number `path` of element `name` at the point; `system` declares the present numbers.

        Raises:
            InputError: there is no such number, or the present numbers are not those of the system (default: that of
                the model).
        """
        sensing, n = self._sensing, self._layout.n_q
        direction = self.direction(name, path, system)
        w = self._derivatives.put(point)
        dynamics, ptr = sensing.dynamics.values, sensing.dynamics.values.par_ptr
        analytic, rest = np.zeros(n + 7), direction.dynamics.copy()
        for e in np.flatnonzero(self._kernels):
            part = slice(ptr[e], ptr[e + 1])
            if direction.dynamics[part].any():
                analytic += self._analytic(int(e), direction.dynamics[part] / direction.step)
                rest[part] = 0.0
        ends = []
        for sign in (1.0, -1.0):
            d = Packed(_with(dynamics, sign * rest))
            c = Packed(_with(sensing.constraints.values, sign * direction.constraints))
            s = Packed(_with(sensing.sensors.values, sign * direction.sensors))
            evaluate_residual(d.table, c.table, sensing.work.table)
            rows = (-w.gmu[:n], w.r2[:n].copy(), w.phi.copy(), w.phi_v.copy())
            d = Packed(_with(dynamics, sign * direction.dynamics))
            evaluate_sensors(new_sensing(d, c, s, sensing.composed, sensing.work).table)
            ends.append((*rows, w.y.copy()))
        r1, r2, r3, r4, y = (0.5 * (high - low) / direction.step for high, low in zip(*ends, strict=True))
        return ParameterBlocks(
            r1, r2 + analytic[:n], r3, r4, y, direction.step, self._differenced(rest, direction.constraints)
        )

    def _analytic(self, e: int, slope: np.ndarray) -> np.ndarray:
        """Jp dpar/dp of dynamic call e in the rows of r2, shape (n_q + 7,)."""
        call, sensing = self._layout.dynamics[e], self._sensing
        dynamic_by_parameter(sensing.dynamics.table, self._kernels[e], e, sensing.work.table, self._slopes.table)
        rows = np.zeros(self._layout.n_q + 7)
        np.add.at(rows, call.iq, self._slopes.values.Jp[: len(call.iq), : len(slope)] @ slope)
        return rows

    def _differenced(self, dynamics: np.ndarray, constraints: np.ndarray) -> tuple[str, ...]:
        """Names of elements and constraints any of whose numbers are moved."""
        layout, sensing, names = self._layout, self._sensing, []
        for calls, table, moved in (
            (layout.dynamics, sensing.dynamics.values, dynamics),
            (layout.constraints, sensing.constraints.values, constraints),
        ):
            ptr = table.par_ptr
            names += [c.element.name for e, c in enumerate(calls) if moved[ptr[e] : ptr[e + 1]].any()]
        return tuple(dict.fromkeys(names))


def _numbers(calls: list) -> np.ndarray:
    """Numbers of all calls, flat."""
    return flat([c.placement.numbers for c in calls], np.float64)[0]


def _with(calls: Calls, change: np.ndarray) -> Calls:
    """The same calls with other numbers."""
    return calls._replace(par=calls.par + change)


def declared_number(system: System, name: str, path: str) -> float:
    """The number that a declaration holds at a path of keys and places, such as 'mass' or 'inertia.2'.

    Raises:
        InputError: there is none; names what is there.
    """
    element = system.element(name)
    return _number(f"{element.kind} '{name}'", element, path.split("."))


def system_with(system: System, values: Mapping[tuple[str, str], float]) -> System:
    """The system with other values of declared numbers.

    Args:
        system: the declared system.
        values: by name of the element and path of the number.

    Raises:
        InputError: there is no such number.
    """
    for (name, path), value in values.items():
        change = value - declared_number(system, name, path)
        system = _system_with(system, _moved(system.element(name), path.split("."), change))
    return system


def numbers_with(layout: Layout, values: Mapping[tuple[str, str], float]) -> tuple[np.ndarray, ...]:
    """Numbers of dynamics, constraints and sensors, with other values of declared numbers.

    They are what may be written into `Model.numbers` of the layout's model.

    Args:
        layout: of the declared system.
        values: by name of the element and path of the number.

    Raises:
        InputError: there is no such number, or with that value elements are joined otherwise.
    """
    there = Layout(system_with(layout.system, values))
    if not same_structure(there, layout):
        raise InputError(f"{choices(f'{n}.{p}' for n, p in values)} cannot be moved alone: the structure changes.")
    return tuple(_numbers(calls) for calls in (there.dynamics, there.constraints, there.sensors))

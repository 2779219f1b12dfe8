"""Signals within a system: sensors that elements read, and inputs that elements drive.

An element may read a sensor component (`Placement.reads`): that kernel call is the row

    v - y(q, v, vdot, u) = 0

of an own coordinate, whose rate is then the reading; the sensor's kernel writes y and its derivatives. An element may
drive inputs (`DynamicElement.driven_inputs`): whoever reads such an input gets the rate of a coordinate in its place,
and the derivative by it from its own `input_kernel`. Both are decided here, once, by longer tables:

    integers of a call that reads driven inputs:  the kernel's own, then (local input, local coordinate) for each, then
                                                  how many
    integers of a call that reads a sensor:       the sensor's own, then the component, the sensor's components, the
                                                  place of the own coordinate, then as above

What neither reads a sensor nor a driven input is left as it is, and runs the same code as ever.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dms_core.errors import ModelError, choices
from dms_core.model.control.reading import sensor_of
from dms_core.model.element import Constraint, DynamicElement, Pattern, Placement, Sensor
from dms_core.model.signals import Constant


def driven_inputs(system, coordinates: dict[str, int]) -> dict[str, str]:
    """Full name of the coordinate whose rate is the input, by the input's name.

    Raises:
        ModelError: an input or coordinate does not exist, or an input has two writers.
    """
    declared = {u.name: u for u in system.inputs}
    found: dict[str, str] = {}
    writers: dict[str, str] = {}
    for element in (*system.bodies, *system.forces):
        who = f"{element.kind} '{element.name}'"
        for name, coordinate in element.driven_inputs():
            if name not in declared:
                raise ModelError(f"{who}: input '{name}' does not exist. Declared: {choices(declared)}.", element.name)
            if name in found:
                raise ModelError(
                    f"{who}: input '{name}' is driven by {writers[name]} already. Expected one writer for each input; "
                    "add a second input and load, or sum the two in a state_space.",
                    element.name,
                )
            if declared[name].signal != Constant():
                raise ModelError(
                    f"{who}: input '{name}' has a course in time of its own ({declared[name].signal.kind}). Expected "
                    "an input without a signal, as an element drives it.",
                    element.name,
                )
            found[name] = f"{element.name}.{coordinate}"
            writers[name] = who
    return found


def connected(system, element: Any, placement: Placement, driven: dict[str, str]) -> tuple[Placement, Sensor | None]:
    """The placement with the tables above, and the sensor whose kernel it is then for.

    Raises:
        ModelError: a sensor component does not exist or cannot be read, or an element cannot read a driven input.
    """
    if isinstance(element, DynamicElement) and placement.reads:
        return _reading(system, placement, driven)
    wires = [(k, driven[name]) for k, name in enumerate(placement.inputs) if name in driven]
    if not wires:
        return placement, None
    _check_reader(element, placement.inputs[wires[0][0]], driven)
    n = placement.size
    wired = _with_wires(placement, wires, n)
    if isinstance(element, Sensor) or placement.pattern is None:
        return wired, None
    by_q, by_v, by_a = (np.pad(np.asarray(x), (0, len(wires))) for x in placement.pattern)
    by_v[:n, n:] = True
    return replace(wired, pattern=Pattern(by_q, by_v, by_a)), None


def _check_reader(element: Any, name: str, driven: dict[str, str]) -> None:
    """Refuse elements that need more of an input than its value."""
    who = f"{element.kind} '{element.name}': input '{name}' is driven by '{driven[name].rpartition('.')[0]}'"
    if isinstance(element, Constraint):
        raise ModelError(
            f"{who}. Expected an input with a course in time, as a constraint needs its rates; let a force or a motor "
            "move what it drives.",
            element.name,
        )
    if isinstance(element, DynamicElement) and element.reads_input_rates:
        raise ModelError(
            f"{who}, whose rate is not known. Expected an input with a course in time; a sensor_pid needs no rate.",
            element.name,
        )


def _with_wires(placement: Placement, wires: list[tuple[int, str]], first: int) -> Placement:
    """The placement with the coordinates that drive its inputs behind local coordinate `first`."""
    pairs = [x for j, (k, _) in enumerate(wires) for x in (k, first + j)]
    return replace(
        placement,
        coordinates=(*placement.coordinates, *(name for _, name in wires)),
        integers=(*placement.integers, *pairs, len(wires)),
        wired=True,
    )


def _reading(system, placement: Placement, driven: dict[str, str]) -> tuple[Placement, Sensor]:
    """The call of a sensor's kernel for the row of the placement's one coordinate."""
    sensor, component = sensor_of(system, placement.reads)
    base = sensor.place(system)
    wires = [(k, driven[name]) for k, name in enumerate(base.inputs) if name in driven]
    n = base.size
    own = n + len(wires)
    integers = (*base.integers, component, len(sensor.outputs()), own)
    call = _with_wires(replace(base, integers=integers, pattern=None), wires, n)
    row, last = np.zeros((own + 1, own + 1), bool), np.zeros((own + 1, own + 1), bool)
    row[own, :n] = True
    last[own] = True
    coordinates = (*call.coordinates, *placement.coordinates)
    return replace(call, coordinates=coordinates, reads=placement.reads, pattern=Pattern(row, last, row)), sensor

"""Elements that an analysis without rates of element states cannot have: those that drive inputs, and those that read.

Readings of sensors and driven inputs are rates of own coordinates (dms_core.assembly.pattern.connections). At rest all
rates are 0, and in a kinematic simulation those of all element states are: each reading, and each input that such an
element drives, would count as 0, whatever it is.
"""

from __future__ import annotations

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model.element import Declaration


def check_reads_nothing(model: Model) -> None:
    """Refuse a model in which an element reads a sensor, whose reading is not 0 at rest.

    Raises:
        ModelError: names the element and the sensor component.
    """
    for call in model.layout.dynamics:
        if call.sensor is not None:
            raise ModelError(
                f"{_who(call.element)} reads '{call.placement.reads}' by the rate of a state, and at rest all "
                "rates are 0. Expected a model in which no element reads a sensor: leave it out and give the inputs "
                "that it drives a signal, let a run in time come to rest, or linearise about the start.",
                call.element.name,
            )


def check_drives_nothing(model: Model, why: str) -> None:
    """Refuse a model in which an element drives an input by a state of its own; the rate of a body is known.

    Args:
        model: a compiled model.
        why: such a rate is not known, as a clause.

    Raises:
        ModelError: names the element and the input.
    """
    for element in model.system.forces:
        for name, _ in element.driven_inputs():
            raise ModelError(
                f"{_who(element)} drives input '{name}' by the rate of a state, and {why}. Expected inputs with a "
                f"course in time: leave the element out and give '{name}' a signal, or run the model in time.",
                element.name,
            )


def _who(element: Declaration) -> str:
    """Kind and name."""
    return f"{element.kind} '{element.name}'"

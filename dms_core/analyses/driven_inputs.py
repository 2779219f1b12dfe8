"""Elements that a kinematic simulation cannot have: those that drive inputs by states of their own.

Driven inputs are rates of own coordinates (dms_core.assembly.pattern.connections). In a driven motion the states of
elements do not follow from positions, and stay at their start: each input that such an element drives would count as 0,
whatever it is. At rest they are solved for (rest_equations.py).
"""

from __future__ import annotations

from dms_core.assembly.model import Model
from dms_core.errors import ModelError


def check_drives_nothing(model: Model) -> None:
    """Refuse a model in which an element drives an input by a state of its own; the rate of a body is known.

    Args:
        model: a compiled model.

    Raises:
        ModelError: names the element and the input.
    """
    for element in model.system.forces:
        for name, _ in element.driven_inputs():
            raise ModelError(
                f"{element.kind} '{element.name}' drives input '{name}' by the rate of a state, and states of elements "
                "do not follow from positions. Expected inputs with a course in time: leave the element out and give "
                f"'{name}' a signal, or run the model in time.",
                element.name,
            )

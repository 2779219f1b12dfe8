"""States of elements in a driven motion, which do not follow from positions, but for turn counters.

A turn counter counts the angle theta of its joint since the declared start: x = theta + 2 pi n, the n nearest to where
x was predicted, xdot = theta_q v. Other states stay at their start. Inputs that elements drive are rates of own
coordinates (dms_core.assembly.pattern.connections): they would count as 0, whatever they are, and are refused. At rest
they are solved for (rest_equations.py).
"""

from __future__ import annotations

import numpy as np

from dms_core.assembly.layout import GROUND_COORDINATES
from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model.constraints.joints.axis_joint import AxisJoint
from dms_core.model.forces.joint.turn_counter import CountsTurns, whole_turns
from dms_core.model.geometry.angle import angle_rate, joint_angle, start_frame

Triple = tuple[float, float, float]


class TurnCounts:
    """The turn counters of a model, those that springs and couplings bring among them.

    Args:
        model: a compiled model.
    """

    def __init__(self, model: Model) -> None:
        self._counters: list[tuple[int, np.ndarray, tuple[Triple, Triple, Triple]]] = []
        for call in model.layout.dynamics:
            if isinstance(call.element, CountsTurns):
                frame = start_frame(model.system, model.system.element(call.element.joint, AxisJoint))
                f, g, h = (tuple(map(float, frame[k : k + 3])) for k in (0, 3, 6))
                self._counters.append((int(call.iq[14]), call.iq[:14], (f, g, h)))  # type: ignore[arg-type]

    def put_angles(self, q: np.ndarray) -> None:
        """Counted angles of the bodies' poses in q, in place, with the turns nearest to what stands there."""
        whole = np.concatenate([q, GROUND_COORDINATES])
        for k, bodies, frame in self._counters:
            angle = joint_angle(0, 7, *frame, whole[bodies])
            q[k] = angle + whole_turns(q[k], angle)

    def put_rates(self, q: np.ndarray, v: np.ndarray) -> None:
        """Rates of the counted angles from those of the bodies in v, in place."""
        whole, moving = np.concatenate([q, GROUND_COORDINATES]), np.concatenate([v, np.zeros(7)])
        for k, bodies, frame in self._counters:
            v[k] = angle_rate(0, 7, *frame, whole[bodies], moving[bodies])


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

"""What can be measured of a muscle (paper sect. 2.4, 3.4): its lengths, forces and activation (EMG).

Muscle and tendon together have length l(q) and rate l_q v, the fibre has its own. The tendon force is what the muscle
pulls with; active force F0 a fl fv and passive force F0 fp act along the fibre.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field, field_validator

from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor
from dms_core.model.geometry.path import (
    add_path_gradient,
    add_path_rate_gradient,
    behind_path,
    path_length,
    path_rate,
)
from dms_core.model.muscles.fibre import held_fibre_state, pennation_cosine, tendon_state
from dms_core.model.muscles.muscle import PATH_INTEGERS, PATH_NUMBERS, ThelenMuscle, muscle_activation

UNITS = {
    "length": "m",
    "rate": "m/s",
    "fibre_length": "m",
    "fibre_velocity": "m/s",
    "activation": "-",
    "pennation": "rad",
    "tendon_force": "N",
    "active_force": "N",
    "passive_force": "N",
}
LENGTH, RATE, _, FIBRE_VELOCITY, ACTIVATION, PENNATION, TENDON_FORCE, ACTIVE_FORCE, PASSIVE_FORCE = range(9)
"""Codes of the components, in the order of UNITS; none of the others is left for the length of the fibre."""

Component = Literal[
    "length",
    "rate",
    "fibre_length",
    "fibre_velocity",
    "activation",
    "pennation",
    "tendon_force",
    "active_force",
    "passive_force",
]


@compiled
def muscle_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Tables of the muscle; behind the integers the number of components and the code of each."""
    codes, _ = behind_path(ip, PATH_INTEGERS, PATH_NUMBERS)
    for k in range(ip[codes]):
        code = ip[codes + 1 + k]
        if code == LENGTH or code == RATE or code == TENDON_FORCE:
            _path_component(k, code, ip, par, q, v, level, y, Yq, Yv)
        elif code == ACTIVATION or code == ACTIVE_FORCE:
            _active_component(k, code, ip, par, q, v, u, level, y, Yq, Yv, Yu)
        else:
            _fibre_component(k, code, ip, par, q, v, level, y, Yq, Yv)


@compiled
def _path_component(k, code, ip, par, q, v, level, y, Yq, Yv):
    """Length, rate and tendon force: they move with the bodies."""
    if code == RATE:
        y[k] = path_rate(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v)
        if level > 0:
            add_path_rate_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v, 1.0, Yq[k])
            add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, Yv[k])
        return
    length = path_length(ip, PATH_INTEGERS, par, PATH_NUMBERS, q)
    y[k], by_length = length, 1.0
    if code == TENDON_FORCE:
        y[k], by_length, by_fibre = tendon_state(par, length, q[ip[1]])
        if level > 0:
            Yq[k, ip[1]] = by_fibre
    if level > 0:
        add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, by_length, Yq[k])


@compiled
def _active_component(k, code, ip, par, q, v, u, level, y, Yq, Yv, Yu):
    """Activation and active force: they move with the activation, which is a coordinate or the input."""
    m = ip[1]
    act, by_input = muscle_activation(ip, q, u)
    y[k], by_a = act, 1.0
    if code == ACTIVE_FORCE:
        y[k], _, by_l, by_v, by_a, _ = held_fibre_state(par, q[m], v[m], act)
        if level > 0:
            Yq[k, m] = by_l
            Yv[k, m] = by_v
    if level > 0:
        if ip[0] > 0:
            Yq[k, m + 1] = by_a
        else:
            Yu[k, 0] = by_a * by_input


@compiled
def _fibre_component(k, code, ip, par, q, v, level, y, Yq, Yv):
    """Fibre length and velocity, pennation, passive force: functions of the fibre alone."""
    m = ip[1]
    if code == FIBRE_VELOCITY:
        y[k] = v[m]
        if level > 0:
            Yv[k, m] = 1.0
        return
    y[k], slope = q[m], 1.0
    if code == PASSIVE_FORCE:
        _, y[k], _, _, _, slope = held_fibre_state(par, q[m], v[m], 0.0)
    elif code == PENNATION:
        c, c_l = pennation_cosine(par, q[m])
        s = math.sqrt(1.0 - c * c)
        y[k], slope = math.acos(c), (-c_l / s if s > 0.0 else 0.0)
    if level > 0:
        Yq[k, m] = slope


class MuscleSensor(Sensor):
    """Measures the chosen quantities of one muscle."""

    kind: ClassVar[str] = "muscle_sensor"
    kernel: ClassVar = muscle_sensor
    muscle: str = Field(description="name of the muscle")
    components: tuple[Component, ...] = Field(
        default=("fibre_length", "fibre_velocity", "activation", "tendon_force"),
        min_length=1,
        description="what is measured, in this order [m, m/s, -, rad, N]",
    )

    @field_validator("components")
    @classmethod
    def _once(cls, value):
        if len(set(value)) != len(value):
            raise ValueError("a component is named twice; name each once")
        return value

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """The chosen components; a single one carries the sensor's own name."""
        return tuple((c if len(self.components) > 1 else "", UNITS[c]) for c in self.components)

    def place(self, system) -> Placement:
        """The muscle's own placement."""
        placed = system.element(self.muscle, ThelenMuscle).place(system)
        return Placement(
            bodies=placed.bodies,
            coordinates=placed.coordinates,
            inputs=placed.inputs,
            integers=(*placed.integers, len(self.components), *(list(UNITS).index(c) for c in self.components)),
            numbers=placed.numbers,
        )

"""Length, rate and tension of a rope or of any path (paper sect. 2.4, 3.3).

    length l(q) [m],   rate l_q v [m/s],   tension tau [N]

The tension of a rope of fixed length is its multiplier lam: negative where a real rope would be slack.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.constraints.couplings.drum_rope import DrumRope
from dms_core.model.constraints.rope_length import RopeLength
from dms_core.model.element import Declaration, Placement, Sensor
from dms_core.model.geometry.path import (
    PathPoint,
    add_path_gradient,
    add_path_rate_gradient,
    behind_path,
    path_length,
    path_rate,
    path_table,
)
from dms_core.model.ropes.elastic_rope import STRETCH, ElasticRope, elastic_tension
from dms_core.model.ropes.rope_force import (
    CONSTANT,
    COORDINATE,
    INPUT,
    PATH_INTEGERS,
    PATH_NUMBERS,
    RopeForce,
    rope_tension,
)

MULTIPLIER = 3
"""Source of the tension besides those of rope_force."""
UNITS = {"length": "m", "rate": "m/s", "tension": "N"}
LENGTH, RATE = 0, 1


@compiled
def rope_sensor(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Tables of rope_force; behind the integers the number of components and the code of each."""
    codes, _ = behind_path(ip, PATH_INTEGERS, PATH_NUMBERS)
    for k in range(ip[codes]):
        if ip[codes + 1 + k] == LENGTH:
            y[k] = path_length(ip, PATH_INTEGERS, par, PATH_NUMBERS, q)
            if level > 0:
                add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, Yq[k])
        elif ip[codes + 1 + k] == RATE:
            y[k] = path_rate(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v)
            if level > 0:
                add_path_rate_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v, 1.0, Yq[k])
                add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, Yv[k])
        else:
            if ip[0] == STRETCH:
                _elastic_tension(k, ip, par, q, v, level, y, Yq, Yv)
            else:
                _tension(k, ip, par, q, lam, u, level, y, Yq, Yl, Yu)


@compiled
def _elastic_tension(k, ip, par, q, v, level, y, Yq, Yv):
    """Component k is the tension of a rope that stretches."""
    y[k], by_length, by_rate = elastic_tension(ip, par, q, v)
    if level > 0:
        add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, by_length, Yq[k])
        add_path_rate_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, v, by_rate, Yq[k])
        add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, by_rate, Yv[k])


@compiled
def _tension(k, ip, par, q, lam, u, level, y, Yq, Yl, Yu):
    """Component k is the tension."""
    y[k] = lam[0] if ip[0] == MULTIPLIER else rope_tension(ip, par, q, u)
    if level > 0:
        if ip[0] == MULTIPLIER:
            Yl[k, 0] = 1.0
        elif ip[0] == COORDINATE:
            Yq[k, ip[1]] = 1.0
        elif ip[0] == INPUT and u[0, 0] > 0.0:
            Yu[k, 0] = 1.0


class RopeSensor(Sensor):
    """Measures the rope of that name, or a path of its own (which has no tension)."""

    kind: ClassVar[str] = "rope_sensor"
    kernel: ClassVar = rope_sensor
    rope: str | None = Field(default=None, description="name of a rope_force, elastic_rope, rope_length or drum_rope")
    path: tuple[PathPoint, ...] | None = Field(default=None, min_length=2, description="points, instead of a rope")
    components: tuple[Literal["length", "rate", "tension"], ...] = Field(
        default=("length", "rate"), min_length=1, description="what is measured, in this order [m, m/s, N]"
    )

    @field_validator("components")
    @classmethod
    def _once(cls, value):
        if len(set(value)) != len(value):
            raise ValueError("a component is named twice; name each once")
        return value

    @model_validator(mode="after")
    def _one_object(self):
        if (self.rope is None) == (self.path is None):
            raise ValueError("give either a rope or a path")
        if self.path is not None and "tension" in self.components:
            raise ValueError("a path has no tension; name a rope, or leave 'tension' out of the components")
        return self

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """The chosen components; a single one carries the sensor's own name."""
        return tuple((c if len(self.components) > 1 else "", UNITS[c]) for c in self.components)

    def place(self, system) -> Placement:
        """The path's bodies, and whatever the tension comes from."""
        codes = (len(self.components), *(list(UNITS).index(c) for c in self.components))
        rope = None if self.rope is None else system.element(self.rope, Declaration)
        if isinstance(rope, RopeForce | ElasticRope):
            placed = rope.place(system)
            return replace(placed, integers=(*placed.integers, *codes), pattern=None)
        if rope is not None and not isinstance(rope, RopeLength | DrumRope):
            raise ModelError(
                f"rope_sensor '{self.name}': '{self.rope}' is a {rope.kind}. Expected a rope_force, elastic_rope, "
                "rope_length or drum_rope."
            )
        table = path_table(system, rope.path if rope is not None else self.path or ())
        return Placement(
            bodies=table.bodies,
            integers=(CONSTANT if rope is None else MULTIPLIER, table.size, *table.integers, *codes),
            numbers=(0.0, *table.numbers),
            constraint="" if rope is None else rope.name,
        )

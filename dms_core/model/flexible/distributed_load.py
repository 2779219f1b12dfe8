"""Load spread over a beam or a line on a rigid body, as the point forces that do the same work (sect. 3.1, f_ext).

Along a beam element with ends i and j, whose x axes point along it, positions are the cubic through both sections

    r(s) = H1 r_i + H2 A_i e_1 + H3 r_j + H4 A_j e_1

so that a load q per length, from q_i to q_j, does the work of point forces on the sections i and j,

    L (q_i - q_j) / 20  and  L (3 q_i + 2 q_j) / 10   at 0 and at (L/6, 0, 0) of i,   likewise at 0 and at -L/6 of j

whose moments are those of a clamped beam, q L^2 / 12 for a uniform load: with them deflections at nodes are exact as
far as the beam's are. On a rigid line from a to b, q_a to q_b, the same work is that of L q_a / 2 at (2 a + b) / 3 and
of L q_b / 2 at (a + 2 b) / 3. A load that follows turns with the section that it is put on. A modal body takes it on
frame and modes, as its mass, length or volume is spread over them (modal/load_distribution.py).
"""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.element import Force, Pattern, Placement, Vector
from dms_core.model.flexible.beams.beam import Beam
from dms_core.model.flexible.modal.modal_body import ModalBody
from dms_core.model.forces.lumped_load import LOAD, lumped_load, lumped_load_by_input
from dms_core.model.forces.mass_moment import add_following, add_moment_load, moment_pattern
from dms_core.model.geometry.rotations import columns, rotated, scale, vec
from dms_core.model.places import numbers_at

ORIGIN = (0.0, 0.0, 0.0)


class SpreadNumbers(NamedTuple):
    """Places of the kernel's numbers on a modal body; those of a point force are LoadNumbers."""

    amount: int = 0
    """Of mass, length or volume."""
    load: int = 1
    """Per amount."""
    moment: int = 4
    """c_0 or s, then the columns of P."""


SPREAD = SpreadNumbers()


@compiled
def distributed_load(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip: load in body axes, load scaled by the input, number of modes (-1: a point force)."""
    if ip[2] < 0:
        lumped_load(ip, par, q, v, a, u, level, r, Jq, Jv, Ja)
        return
    factor = u[0, 0] if ip[1] == 1 else 1.0
    own = scale(factor, vec(par, SPREAD.load))
    g = rotated(q, 0, own) if ip[0] == 1 else own
    for i in range(3):
        r[i] -= par[SPREAD.amount] * g[i]
    add_moment_load(par, SPREAD.moment, ip[2], g, q, level, r, Jq)
    if level > 0 and ip[0] == 1:
        turning = columns(q, 0, own)
        for i in range(3):
            for k in range(4):
                Jq[i, 3 + k] -= par[SPREAD.amount] * turning[k][i]
        add_following(par, SPREAD.moment, ip[2], own, q, Jq)


@compiled(makes_arrays=True)
def distributed_load_by_input(ip, par, q, v, a, u, Ju):
    """The rows by the factor: those of the factor 1."""
    if ip[2] < 0:
        lumped_load_by_input(ip, par, q, v, a, u, Ju)
        return
    one, rows, unused = np.ones((1, 3)), np.zeros(7 + ip[2]), np.zeros((1, 1))
    distributed_load(ip, par, q, v, a, one, 0, rows, unused, unused, unused)
    for i in range(7 + ip[2]):
        Ju[i, 0, 0] = rows[i]


class DistributedLoad(Force):
    """Load per length, volume or mass, fixed in direction or following the body, constant or multiplied by an input.

    It lies on all of a beam, on the mass of a modal body or on what its `distributions` give, or on the line from
    `start` to `end` of a rigid body, where its resultant acts. Weight by `per_mass` replaces that of a `gravity` for
    this body; do not declare both.
    """

    kind: ClassVar[str] = "distributed_load"
    kernel: ClassVar = distributed_load
    input_kernel: ClassVar = distributed_load_by_input
    body: str = Field(description="beam, modal body, or rigid body")
    per_length: Vector | None = Field(default=None, description="load per length [N/m]")
    per_volume: Vector | None = Field(default=None, description="load per volume, of a beam or modal body [N/m^3]")
    per_mass: Vector | None = Field(default=None, description="load per mass, such as gravity [N/kg]")
    end_factor: float = Field(
        default=1.0, description="intensity at the far end over that at the first; it varies linearly between [-]"
    )
    start: Vector | None = Field(default=None, description="first end of the line on a rigid body, in its frame [m]")
    end: Vector | None = Field(default=None, description="far end of the line on a rigid body, in its frame [m]")
    axes: Literal["ground", "body"] = Field(
        default="ground", description="axes of the load: fixed, or turning with the body"
    )
    input: str | None = Field(default=None, description="input that multiplies it [-]; default: constant load")

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        given = [n for n in ("per_length", "per_volume", "per_mass") if getattr(self, n) is not None]
        if len(given) != 1:
            raise ValueError(
                f"Expected one of per_length, per_volume and per_mass, got {' and '.join(given) or 'none of them'}"
            )
        return self

    def input_names(self) -> tuple[str, ...]:
        """The factor, where there is one."""
        return () if self.input is None else (self.input,)

    def placements(self, system) -> tuple[Placement, ...]:
        """One call for each point force, one for a modal body."""
        found = system.element(self.body)
        if isinstance(found, ModalBody):
            return (self._on_modal_body(found),)
        if isinstance(found, Beam):
            points = self._on_beam(found)
        elif isinstance(found, RigidBody):
            points = self._on_rigid_body(found)
        else:
            raise ModelError(
                f"distributed_load '{self.name}': Expected a beam, a modal body or a rigid body, got the {found.kind} "
                f"'{self.body}'."
            )
        return tuple(
            self._placement(body, system.arm(body, point), force) for body, point, force in points if np.any(force)
        )

    def _on_beam(self, beam: Beam) -> list[tuple[str, tuple, np.ndarray]]:
        """(node, point, force) of all elements."""
        if self.start is not None or self.end is not None:
            raise ModelError(
                f"distributed_load '{self.name}': start and end are for a line on a rigid body; the load lies on all "
                f"of the beam '{self.body}'."
            )
        section = beam.section
        factors = {"per_length": 1.0, "per_volume": section.area, "per_mass": section.mass_per_length}
        load = next(f * np.array(getattr(self, n)) for n, f in factors.items() if getattr(self, n) is not None)
        L, points = beam.element_length, []
        intensity = 1.0 + (self.end_factor - 1.0) * np.arange(beam.elements + 1) / beam.elements
        for k in range(beam.elements):
            i, j = intensity[k] * load, intensity[k + 1] * load
            for node, near, far, arm in ((k, i, j, L / 6.0), (k + 1, j, i, -L / 6.0)):
                points.append((beam.node(node), ORIGIN, L * (near - far) / 20.0))
                points.append((beam.node(node), (arm, 0.0, 0.0), L * (3.0 * near + 2.0 * far) / 10.0))
        return points

    def _on_rigid_body(self, body: RigidBody) -> list[tuple[str, tuple, np.ndarray]]:
        """(body, point, force) of the resultant."""
        who = f"distributed_load '{self.name}'"
        if self.per_mass is not None and self.start is None and self.end is None and self.end_factor == 1.0:
            return [(body.name, body.centre_of_mass, body.mass * np.array(self.per_mass))]
        if self.per_length is None or self.start is None or self.end is None:
            raise ModelError(
                f"{who}: Expected per_length with start and end, or per_mass without them and without end_factor, for "
                f"the rigid body '{self.body}'."
            )
        a, b = np.array(self.start), np.array(self.end)
        length, load = float(np.linalg.norm(b - a)), np.array(self.per_length)
        if length == 0.0:
            raise ModelError(f"{who}: start and end are the same point {self.start}.")
        near, far = tuple((2.0 * a + b) / 3.0), tuple((a + 2.0 * b) / 3.0)
        return [(body.name, near, 0.5 * length * load), (body.name, far, 0.5 * length * self.end_factor * load)]

    def _on_modal_body(self, body: ModalBody) -> Placement:
        """The load on frame and modes."""
        who = f"distributed_load '{self.name}'"
        if self.start is not None or self.end is not None or self.end_factor != 1.0:
            raise ModelError(
                f"{who}: Expected no start, end and end_factor for the modal body '{self.body}': where the load lies, "
                "and how its intensity varies, is in the loads that its distributions come from."
            )
        data, load = body.data, next(x for x in (self.per_mass, self.per_length, self.per_volume) if x is not None)
        amount, moment, translation = data.mass, data.mass_moment, data.translation
        if self.per_mass is None:
            measure = "length" if self.per_length is not None else "volume"
            found = {one.measure: one for one in body.distributions}
            if measure not in found:
                raise ModelError(
                    f"{who}: Expected per_mass, or a modal body with a distribution of its {measure}, got "
                    f"'{self.body}' with {', '.join(found) or 'none'}: the invariants of its modes hold its mass, not "
                    f"where its nodes are. Give loads={{'{measure}': ...}} to ModalBody.of."
                )
            amount, moment, translation = found[measure].total, found[measure].moment, found[measure].translation
        by_q = moment_pattern(data.size)
        by_q[:3, 3:7] = self.axes == "body"
        none = np.zeros_like(by_q)
        return Placement(
            bodies=(body.frame,), coordinates=body.modes, inputs=self.input_names(),
            integers=(int(self.axes == "body"), int(self.input is not None), data.size),
            numbers=numbers_at(
                SPREAD, amount=amount, load=load, moment=[moment, *translation]
            ),
            pattern=Pattern(by_q, none, none),
        )  # fmt: skip

    def _placement(self, body: str, arm: np.ndarray, force: np.ndarray) -> Placement:
        """One point force."""
        jq, none = np.zeros((7, 7), bool), np.zeros((7, 7), bool)
        jq[3:, 3:] = True
        jq[:3, 3:] = self.axes == "body"
        return Placement(
            bodies=(body,),
            inputs=self.input_names(),
            integers=(int(self.axes == "body"), int(self.input is not None), -1),
            numbers=numbers_at(LOAD, point=arm, force=force, moment=ORIGIN),
            pattern=Pattern(jq, none, none),
        )

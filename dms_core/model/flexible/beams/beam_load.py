"""Loads of a beam's section, half-way along one element: what strain gauges would tell."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

import dms_core.model.flexible.beams.strains as strain
from dms_core.compiled.jit import compiled
from dms_core.model.element import Placement, Sensor
from dms_core.model.flexible.beams.beam_element import (
    BEAM,
    STILL3,
    BeamElement,
    beam_forces,
    elastic,
    near_sign,
    relative_rate,
    second_stretch,
    second_turn,
    sections,
    stretch_direction,
    turn_direction,
)
from dms_core.model.geometry.quaternions import conjugate, product
from dms_core.model.geometry.rotations import vec


@compiled
def _put(Y, first, column, factor, x):
    """Three rows of one column."""
    for k in range(3):
        Y[first + k, column] += factor * x[k]


@compiled
def _force_derivatives(par, q, v, Yq, Yv):
    """Rows of the three forces."""
    sign, tau, stiffness = near_sign(q), par[BEAM.damping_time], vec(par, BEAM.stretching)
    d, m, p, s = sections(q, sign)
    dv, mv, pv, sv = sections(v, sign)
    g = strain.stretch(m, d)
    for n in range(7):
        x, y, near, far = stretch_direction(n, sign)
        by_x = strain.stretch_rate(m, d, g, x, y)
        by_q = elastic(stiffness, by_x, STILL3, tau, second_stretch(m, d, g, mv, dv, x, y))
        by_v = elastic(stiffness, STILL3, STILL3, tau, by_x)
        for column, factor in ((n, near), (7 + n, far)):
            _put(Yq, 0, column, factor, by_q)
            _put(Yv, 0, column, factor, by_v)


@compiled
def _moment_derivatives(par, q, v, Yq, Yv):
    """Rows of the three moments."""
    sign, tau, stiffness = near_sign(q), par[BEAM.damping_time], vec(par, BEAM.turning)
    d, m, p, s = sections(q, sign)
    dv, mv, pv, sv = sections(v, sign)
    c = product(conjugate(p), s)
    factors, c_rate = strain.turn_factors(c), relative_rate(p, s, pv, sv)
    for n in range(8):
        x, y, column, factor = turn_direction(n, sign)
        by_x = strain.turn_rate(c, factors, relative_rate(p, s, x, y))
        by_q = elastic(stiffness, by_x, STILL3, tau, second_turn(p, s, c, factors, pv, sv, c_rate, x, y))
        _put(Yq, 3, column, factor, by_q)
        _put(Yv, 3, column, factor, elastic(stiffness, STILL3, STILL3, tau, by_x))


@compiled
def beam_load(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu):
    """Numbers are those of the beam element."""
    N, M = beam_forces(par, q, v)
    for k in range(3):
        y[k], y[3 + k] = N[k], M[k]
    if level > 0:
        _force_derivatives(par, q, v, Yq, Yv)
        _moment_derivatives(par, q, v, Yq, Yv)


class BeamLoad(Sensor):
    """Normal force, shear forces, torque and bending moments half-way along a beam element, in its axes there.

    They act on the part of the beam towards the element's first node; a normal force above 0 is a pull.
    """

    kind: ClassVar[str] = "beam_load"
    kernel: ClassVar = beam_load
    element: str = Field(description="beam element, such as 'boom.element0'")

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Forces [N] and moments [N m]."""
        forces, moments = ("N", "Qy", "Qz"), ("Mx", "My", "Mz")
        return (*((name, "N") for name in forces), *((name, "N m") for name in moments))

    def place(self, system) -> Placement:
        """Bodies and numbers of the element."""
        own = system.element(self.element, BeamElement).place(system)
        return Placement(bodies=own.bodies, numbers=own.numbers)

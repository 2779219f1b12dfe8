"""Where a run fails, what is wrong is named, and what is right is not blamed."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from numba import njit

from dms_core import Result, Simulation, SolverOptions, System
from dms_core.assembly.derivatives.finite import far_numbers
from dms_core.assembly.derivatives.wrong_derivatives import wrong_call
from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import Packed, inner
from dms_core.model import LineGuide, PointMass, Revolute, RigidBody
from dms_core.model.element import Force, Placement
from tests.dms_core.assembly.specimen import specimen


@njit
def _wrong(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    r[0] += 1e6 * (np.cosh(q[0]) * np.sinh(q[0]))
    if level > 0:
        Jq[0, 0] -= 4e8


class _Wrong(Force):
    """A stiff spring whose derivative has the wrong sign."""

    kind: ClassVar[str] = "wrong_spring"
    kernel: ClassVar = _wrong

    def place(self, system):
        return Placement(bodies=("mass",))


def test_a_wrong_derivative_is_named():
    mass = PointMass(name="mass", mass=1.0, position=(1.0, 0.0, 0.0))
    rail = LineGuide(name="rail", body_j="mass", axis_i=(1, 0, 0))
    simulation = Simulation(
        System("wrong", bodies=[mass], constraints=[rail], forces=[_Wrong(name="bad")]), SolverOptions(h_min=1e-5)
    )
    simulation.advance(1.0)
    assert simulation.result in (Result.NEWTON_FAILED, Result.STEP_TOO_SMALL)
    assert "The derivatives of wrong_spring 'bad' contradict its equations" in simulation.message


def test_right_derivatives_are_not_blamed():
    """All elements of the package, at the start and in motion."""
    model = specimen()
    simulation = Simulation(model)
    for t in (0.01, 0.1):
        simulation.advance(t)
        w = model.new_work()
        s = simulation.state
        w.q[: model.n_q], w.v[: model.n_q], w.a[: model.n_q], w.lam[:], w.u[:] = s.q, s.v, s.vd, s.lam, s.w.u
        before = w.q.copy()
        table = model.tables.table
        dynamics, constraints = inner(table, MODEL.dynamics), inner(table, MODEL.constraints)
        assert wrong_call(model.layout, dynamics, constraints, Packed(w)) is None
        np.testing.assert_allclose(w.q, before, atol=1e-15)


def test_rounded_zeros_of_a_vector_are_not_far_numbers():
    def system(z: float) -> System:
        body = RigidBody(name="body", mass=1.0, inertia=(1.0, 1.0, 1.0))
        return System("s", bodies=[body], constraints=[Revolute(name="J", body_j="body", axis_i=(z, 0.0, 1.0))])

    assert far_numbers(system(-4.5e-17)) == ""
    assert "mass = 1e-12" in far_numbers(
        System("s", bodies=[PointMass(name="m", mass=1e-12)], constraints=[], forces=[])
    )


@pytest.mark.parametrize("result", [Result.NEWTON_FAILED, Result.RATES_FAILED, Result.MATRIX_SINGULAR])
def test_no_sentence_blames_what_may_be_right(result):
    assert not {"derivatives", "input", "inertia"} & set(result.value.replace(",", " ").split())

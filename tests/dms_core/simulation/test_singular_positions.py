"""Singular positions are passed on the branch that the velocity points to, or named with their joints."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dms_core import AssemblyError, Model, Result, Simulation, SolverOptions, System
from dms_core.model import Gravity, Revolute, RigidBody
from dms_core.simulation.failure import explain, singular_joints
from tests.dms_core.cases import model

T_END = 3.2
"""The cranks are flat at 0.719 s and three times more by then [s]."""


def _angle(t: float) -> float:
    """Six cranks of 1/3 kg m^2 and five couplers of 1 kg on 1 m are one pendulum: 7 th'' = -8 g cos th."""
    rate = lambda _, y: (y[1], -8.0 * 9.81 / 7.0 * math.cos(y[0]))  # noqa: E731
    return float(solve_ivp(rate, (0.0, t), (0.5 * math.pi, -1.0), rtol=1e-10, atol=1e-10).y[0, -1])


@pytest.mark.parametrize(("method", "rtol"), [("bdf2", 1e-4), ("bdf2", 1e-5), ("bdf2", 1e-7), ("sdirk2", 1e-4)])
def test_flat_four_bars_go_on_as_parallelograms(method, rtol):
    simulation = Simulation(model("parallel_four_bars"), SolverOptions(rtol=rtol, method=method))
    assert simulation.advance(T_END) is Result.SUCCESS, simulation.message
    q = simulation.state.q
    for crank in range(6):
        p = q[7 * crank + 3 : 7 * crank + 7]
        # The error grows as rtol^(2/3), a method of order 2, as if nothing were there: half of this was seen at most.
        limit = 3e-3 * (rtol / 1e-5) ** (2.0 / 3.0)
        assert math.sin(2.0 * math.atan2(p[3], p[0]) - _angle(T_END)) == pytest.approx(0.0, abs=limit)
    assert np.abs(q[7 * 6 + 3 : 7 * 6 + 7] - [1, 0, 0, 0]).max() < 1e-6


def test_where_a_run_ends_in_a_singular_position_its_joints_are_named():
    """A hundred-thousandth of a radian from flat, whatever it was that failed."""
    chain, angle = model("parallel_four_bars"), 1e-5
    simulation = Simulation(chain, SolverOptions())
    q = simulation.state.q
    assert singular_joints(chain, q, 0.0)[0] == []
    c, s = math.cos(angle), math.sin(angle)
    for crank in range(6):
        q[7 * crank : 7 * crank + 3] = [crank + 0.5 * c, 0.5 * s, 0.0]
        q[7 * crank + 3 : 7 * crank + 7] = [math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)]
    for coupler in range(5):
        q[42 + 7 * coupler : 42 + 7 * coupler + 3] = [coupler + c + 0.5, s, 0.0]
    assert np.abs(chain.constraint_jacobian(q)[0]).max() < 1e-12
    result, said = explain(chain, simulation.tables, simulation.packed, Result.NEWTON_FAILED, "")
    assert result is Result.SINGULAR_POSITION
    assert "'B2l'" in said and "0.14 at the start" in said


def _flat(length: float) -> System:
    """A four-bar whose links lie on one line; of equal cranks it is a parallelogram."""
    names, starts, ends = ("in", "coupler", "out"), (0.0, 0.5, 1.0), (0.5, 0.5 + length, 1.5)
    bodies = [
        RigidBody(name=n, mass=1.0, inertia=(0.01, 0.02, 0.02), position=(0.5 * (a + b), 0.0, 0.0))
        for n, a, b in zip(names, starts, ends, strict=True)
    ]
    joints = [
        Revolute(name="A", body_j="in", point_i=(0, 0, 0)),
        Revolute(name="B", body_i="in", body_j="coupler", point_i=(0.25, 0, 0)),
        Revolute(name="C", body_i="coupler", body_j="out", point_i=(0.5 * length, 0, 0)),
        Revolute(name="D", body_j="out", point_i=(1.0, 0, 0)),
    ]
    return System("flat", bodies=bodies, constraints=joints, forces=[Gravity(name="g", acceleration=(0, -9.81, 0))])


def test_a_start_in_a_singular_position_is_named():
    """A parallelogram that starts flat has one freedom more than nearby."""
    with pytest.raises(AssemblyError, match=r"starts in a singular position: there .*'B'.* 1 freedom more") as caught:
        Model(_flat(1.0))
    assert "inertia" not in str(caught.value)

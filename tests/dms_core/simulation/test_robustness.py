"""Where Newton's method and the elimination order are hard pressed: kinks, vanishing entries, all elements at once."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from numba import njit

from dms_core.assembly.model import Model
from dms_core.model import Constant, Function, Input, LineGuide, PathPoint, PointMass, SecondOrder, System, ThelenMuscle
from dms_core.model.element import Force, Placement
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.assembly.specimen import BODIES, CONSTRAINTS, FORCES, INPUTS


def _pulled_mass(activation: float, excitation: float) -> System:
    """5 kg on a vertical rail, held by a muscle that starts in equilibrium: on the kink of zero fibre velocity."""
    return System(
        "muscle and mass",
        bodies=[PointMass(name="mass", mass=5.0, position=(0.0, -0.55, 0.0))],
        constraints=[LineGuide(name="rail", body_j="mass", axis_i=(0, 1, 0))],
        forces=[
            ThelenMuscle(
                name="muscle",
                path=(PathPoint(point=(0, 0, 0)), PathPoint(body="mass", point=(0, 0, 0))),
                excitation="u",
                max_isometric_force=600.0,
                optimal_fibre_length=0.25,
                tendon_slack_length=0.25,
                pennation_angle=0.2,
                start_activation=activation,
            )
        ],
        inputs=[Input(name="u", signal=Constant(value=excitation))],
    )


@pytest.mark.parametrize("h", [1e-3, 1e-4, 5e-5])
@pytest.mark.parametrize(("activation", "excitation"), [(0.3, 0.05), (0.05, 0.6)])
def test_newton_crosses_the_kink_of_the_force_velocity_curve(activation, excitation, h):
    """Its slope doubles where the fibre stops shortening: a matrix of the wrong side never contracts."""
    model = Model(_pulled_mass(activation, excitation))
    run = simulate(model, 0.1, SolverOptions(fixed_step=h)).check()
    exact = simulate(model, 0.1, SolverOptions(rtol=1e-8)).check()
    # Fibre length near 0.3 m; 2e-4 m were seen at 1 ms, where activation rises within five steps.
    fibre = model.layout.index["muscle.fibre_length"]
    assert abs(run.q[-1, fibre] - exact.q[-1, fibre]) < 0.5 * h


@pytest.mark.filterwarnings("ignore:.*read by no element")
@pytest.mark.parametrize(
    "without", [(), ("biceps",), ("drum", "cable"), ("spring",), ("biceps", "drum", "cable", "pid")]
)
def test_elimination_order_lasts(without):
    """Commands that saturate and curves that go slack take entries away; they must be no pivots."""
    forces = [f for f in FORCES if f.name not in without]
    model = Model(System("part", bodies=BODIES, constraints=CONSTRAINTS, forces=forces, inputs=INPUTS))
    run = simulate(model, 1.0).check()
    assert run.stats.largest_phi < 1e-9
    # An exact linear solve shows in few iterations a step; an ill-chosen order gave 6 and more.
    assert run.stats.newton_iterations < 4 * run.stats.steps


def _parabola(t):
    return 3.0 * t * t, 6.0 * t, 6.0


def test_a_function_of_time_is_an_input():
    """x'' = u = 3 t^2: x = t^4 / 4."""
    system = System(
        "pushed",
        forces=[SecondOrder(name="x", input="u")],
        inputs=[Input(name="u", signal=Function(function=_parabola))],
    )
    run = simulate(system, 1.0, SolverOptions(rtol=1e-8)).check()
    np.testing.assert_allclose(run.own_steps().coordinate("x.x"), run.t**4 / 4.0, atol=5e-6)


@njit
def _wall(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    x = q[0] if q[0] > 0.0 else np.nan
    r[0] -= 1e-7 / x**2
    if level > 0:
        Jq[0, 0] += 2e-7 / x**3


class _Wall(Force):
    """Repels the mass from x = 0, behind which it is no number."""

    kind: ClassVar[str] = "wall"
    kernel: ClassVar = _wall

    def place(self, system):
        return Placement(bodies=("mass",))


def test_a_guess_where_a_force_is_no_number_is_a_step_too_long():
    """Thrown at the wall with 1 m/s the mass turns at 0.2 um; not a singular matrix, but shorter steps."""
    mass = PointMass(name="mass", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(-1.0, 0.0, 0.0))
    run = simulate(System("thrown", bodies=[mass], forces=[_Wall(name="wall")]), 2.0, SolverOptions(rtol=1e-4)).check()
    assert run.stats.rejected_newton > 0
    assert run.q[:, 0].min() > 0.0

"""Smoothed positive part, commands and start of a rope actuator."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.control import Pid, RopeActuator
from dms_core.model.control.actuator import positive_part, pulled_tension
from dms_core.model.signals import Input
from dms_core.model.system import System
from tests.dms_core.model.hinged import rows
from tests.example_elements.control import controlled

WIDTH, LIMIT = 3.0, 40.0
# Sums of a few terms of size 100.
ROUNDING = 1e-12


class TestPositivePart:
    """The blend w (s^3 - s^4 / 2)."""

    def test_exact_outside_the_width(self) -> None:
        """Zero below -w/2, x above w/2."""
        assert positive_part(-0.5 * WIDTH, WIDTH) == (0.0, 0.0)
        assert positive_part(-50.0, WIDTH) == (0.0, 0.0)
        assert positive_part(0.5 * WIDTH, WIDTH) == (0.5 * WIDTH, 1.0)
        assert positive_part(50.0, WIDTH) == (50.0, 1.0)

    @pytest.mark.parametrize("x", np.linspace(-2.0, 2.0, 17))
    def test_agonist_less_antagonist_is_the_command(self, x: float) -> None:
        """P(x) - P(-x) = x, inside the width too."""
        assert positive_part(x, WIDTH)[0] - positive_part(-x, WIDTH)[0] == pytest.approx(x, abs=ROUNDING)

    @pytest.mark.parametrize("edge", [-0.5 * WIDTH, 0.5 * WIDTH])
    def test_value_slope_and_curvature_are_continuous_at_the_edges(self, edge: float) -> None:
        """One-sided second differences of a C2 function agree to O(eps), with P''' = 6 / w^2 at the edges."""
        eps = 1e-5
        inner, outer = (
            positive_part(edge - np.sign(edge) * eps, WIDTH),
            positive_part(edge + np.sign(edge) * eps, WIDTH),
        )
        middle = positive_part(edge, WIDTH)
        for value, slope in (inner, outer):
            assert abs(value - middle[0]) <= 1.01 * eps
            # A slope that is C1 with zero curvature at the edge moves by P''' eps^2 / 2.
            assert abs(slope - middle[1]) <= 6.0 / WIDTH**2 * eps**2

    def test_co_contraction_without_command(self) -> None:
        """3 w / 32 at x = 0, as the docstring says."""
        assert positive_part(0.0, WIDTH)[0] == pytest.approx(3.0 * WIDTH / 32.0, abs=ROUNDING)


class TestLimit:
    """P(x) - P(P(x) - limit)."""

    def test_reaches_the_limit_and_stays(self) -> None:
        """Exactly the limit beyond its blend, exactly x below."""
        assert pulled_tension(LIMIT + 0.5 * WIDTH, WIDTH, LIMIT) == pytest.approx((LIMIT, 0.0), abs=ROUNDING)
        assert pulled_tension(1e6, WIDTH, LIMIT)[0] == pytest.approx(LIMIT, abs=1e6 * 2e-16)
        assert pulled_tension(LIMIT - 0.5 * WIDTH, WIDTH, LIMIT)[0] == LIMIT - 0.5 * WIDTH

    def test_never_above_and_never_falling(self) -> None:
        """Monotone between 0 and the limit."""
        tension = [pulled_tension(x, WIDTH, LIMIT)[0] for x in np.linspace(-5.0, 50.0, 1001)]
        assert np.all(np.diff(tension) >= -ROUNDING)
        assert min(tension) >= 0.0
        assert max(tension) <= LIMIT + ROUNDING


def _row(motor: RopeActuator, system: System, q, v, a, u: float) -> float:
    state = [np.array(x, float) for x in (q, v, a)]
    return rows(motor, motor.place(system), *state, np.array([[u, 0.0, 0.0]]))[0]


def test_input_command_is_followed_with_a_lag() -> None:
    """T v + tau = pretension + input; a negative input pulls nothing, a large one the limit."""
    motor = RopeActuator(name="motor", command="pull", time_constant=0.05, pretension=4.0, max_tension=30.0)
    system = System(forces=[motor], inputs=[Input(name="pull")])
    for pull, expected in ((10.0, 14.0), (0.0, 4.0), (-10.0, 4.0), (100.0, 30.0)):
        tension = 6.0
        rate = (expected - tension) / 0.05
        # Terms are of size T v = 24.
        assert _row(motor, system, [tension], [rate], [0.0], pull) == pytest.approx(0.0, abs=ROUNDING)


@pytest.mark.parametrize(("sign", "authority"), [(1, 1.0), (1, 0.5), (-1, 1.0)])
def test_pid_command_is_eq_26(sign: int, authority: float) -> None:
    """The agonist gets authority (ki q_c + kp v_c + kd a_c) where positive, the antagonist its opposite."""
    pid = Pid(name="pid", joint="hinge", reference="psi", kp=40.0, ki=15.0, kd=3.0)
    motor = RopeActuator(name="motor", pid="pid", sign=sign, time_constant=0.05, authority="authority")
    system = controlled(pid, motor)
    command = authority * (15.0 * 0.2 + 40.0 * 0.9 + 3.0 * -2.0)
    expected = max(sign * command, 0.0)
    assert _row(motor, system, [expected, 0.2], [0.0, 0.9], [0.0, -2.0], authority) == pytest.approx(0.0, abs=ROUNDING)
    assert _row(motor, system, [expected + 1.0, 0.2], [0.0, 0.9], [0.0, -2.0], authority) == pytest.approx(1.0)


def test_start_is_the_tension_of_the_command_without_error() -> None:
    """With an input: its value; with a controller: pretension and co-contraction; or what the user says."""
    u = np.array([[10.0, 0.0, 0.0]])
    by_input = {"name": "m", "command": "pull", "time_constant": 0.05, "pretension": 4.0}
    by_pid = {"name": "m", "pid": "pid", "time_constant": 0.05, "pretension": 4.0, "width": 2.0}
    assert RopeActuator(**by_input).start_states(None, np.zeros(1), u) == ((14.0, 0.0),)
    assert RopeActuator(**by_input, max_tension=12.0).start_states(None, np.zeros(1), u) == ((12.0, 0.0),)
    assert RopeActuator(**by_pid).start_states(None, np.zeros(2), u) == ((4.1875, 0.0),)
    assert RopeActuator(**by_pid, start_tension=1.0).start_states(None, np.zeros(2), u) == ((1.0, 0.0),)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "give one of 'command'"),
        ({"command": "pull", "pid": "pid"}, "give one of 'command'"),
        ({"command": "pull", "sign": -1}, "shape a controller's command"),
        ({"pid": "pid", "pretension": 5.0, "max_tension": 5.5}, "must exceed pretension"),
        ({"pid": "pid", "max_tension": 10.0, "start_tension": 500.0}, "start_tension = 500.0 N: Expected at most"),
        ({"pid": "pid", "time_constant": 0.0}, "time_constant = 0.0"),
    ],
)
def test_impossible_declarations_are_refused(fields: dict, message: str) -> None:
    """Each with the reason."""
    with pytest.raises(ModelError, match=message):
        RopeActuator(**{"name": "motor", "time_constant": 0.05, **fields})

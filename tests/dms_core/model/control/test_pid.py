"""The controller's row, its start and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.control import Pid, ReferenceFilter
from dms_core.model.control.pid import FILTER, OWN
from dms_core.model.signals import Input
from dms_core.model.system import System
from tests.dms_core.model.hinged import GROUND_BLOCK, rows, turning

AXIS = (0.3, -0.2, 0.9)
THETA, THETA_RATE = 0.7, -1.3
PSI, PSI_RATE = 0.2, 0.4
SETPOINT, SETPOINT_RATE = -0.35, 0.9
U = np.array([[PSI, PSI_RATE, 0.0]])
# A dozen products of numbers of size 1.
ROUNDING = 1e-14


def _system(pid: Pid) -> System:
    return System(
        bodies=[RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1))],
        constraints=[Revolute(name="hinge", body_j="arm", axis_i=AXIS)],
        forces=[ReferenceFilter(name="filter", input="psi", frequency=5.0), pid],
        inputs=[Input(name="psi")],
    )


def _state(*own: tuple[float, float, float]) -> list[np.ndarray]:
    """Ground, the turning arm, then (q, v, a) of each further coordinate."""
    ground = (GROUND_BLOCK, np.zeros(7), np.zeros(7))
    arm = turning(AXIS, THETA, THETA_RATE, 0.0)
    return [np.concatenate([g, b, [c[k] for c in own]]) for k, (g, b) in enumerate(zip(ground, arm, strict=True))]


def test_row_says_that_the_error_rate_is_psi_rate_minus_theta_rate() -> None:
    """Eq. 23: the row is zero for vdot_c = psidot - thetadot, whatever v_c, and off by what vdot_c is off."""
    pid = Pid(name="pid", joint="hinge", reference="psi", kp=1.0)
    place = pid.place(_system(pid))
    exact = PSI_RATE - THETA_RATE
    for v_c, extra in ((0.0, 0.0), (0.3, 0.0), (0.3, 0.25)):
        r = rows(pid, place, *_state((0.1, v_c, exact + extra)), U)
        assert r[OWN] == pytest.approx(extra, abs=ROUNDING)
        assert np.count_nonzero(np.delete(r, OWN)) == 0


def test_drift_feedback_pulls_the_error_coordinate_to_the_error() -> None:
    """The row grows by drift_gain times (v_c - e) and is unchanged for v_c = e."""
    pid = Pid(name="pid", joint="hinge", reference="psi", kp=1.0, drift_gain=3.0)
    place = pid.place(_system(pid))
    exact, error = PSI_RATE - THETA_RATE, PSI - THETA
    assert rows(pid, place, *_state((0.0, error, exact)), U)[OWN] == pytest.approx(0.0, abs=ROUNDING)
    assert rows(pid, place, *_state((0.0, error + 0.1, exact)), U)[OWN] == pytest.approx(0.3, abs=ROUNDING)


def test_filter_setpoint_adds_to_the_reference() -> None:
    """Value and rate of the filter act like those of psi."""
    pid = Pid(name="pid", joint="hinge", reference="psi", offset="filter.setpoint", kp=1.0, drift_gain=3.0)
    place = pid.place(_system(pid))
    error, error_rate = PSI + SETPOINT - THETA, PSI_RATE + SETPOINT_RATE - THETA_RATE
    state = _state((0.0, error, error_rate), (SETPOINT, SETPOINT_RATE, 0.0))
    assert place.coordinates[FILTER - OWN] == "filter.setpoint"
    assert rows(pid, place, *state, U)[OWN] == pytest.approx(0.0, abs=ROUNDING)


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"reference": "psi"}, PSI - THETA),
        ({"offset": "filter.setpoint"}, SETPOINT - THETA),
        ({"reference": "psi", "offset": "filter.setpoint"}, PSI + SETPOINT - THETA),
    ],
)
def test_starts_with_no_integral_and_the_present_error(fields: dict, error: float) -> None:
    """q_c = 0 and v_c = e(0)."""
    pid = Pid(name="pid", joint="hinge", kp=1.0, **fields)
    q = _state((7.0, 7.0, 7.0), (SETPOINT, 0.0, 0.0))[0][: pid.place(_system(pid)).size]
    ((q_c, v_c),) = pid.start_states(_system(pid), q, U if "reference" in fields else np.zeros((0, 3)))
    assert q_c == 0.0
    assert v_c == pytest.approx(error, abs=ROUNDING)


def test_nothing_to_follow_is_refused() -> None:
    """Neither input nor filter."""
    with pytest.raises(ModelError, match="pid 'lost'.*nothing to follow"):
        Pid(name="lost", joint="hinge", kp=1.0)


def test_filter_behind_the_controller_is_refused() -> None:
    """Its start would come too late, and v_c would be off by the setpoint for ever."""
    pid = Pid(name="pid", joint="hinge", offset="filter.setpoint", kp=1.0)
    system = _system(pid)
    system.forces = system.forces[::-1]
    with pytest.raises(ModelError, match="'filter' is declared behind the controller"):
        pid.place(system)


def test_filter_answers_a_step_without_overshoot() -> None:
    """Critical damping: q = 1 - (1 + w t) exp(-w t) with its two derivatives makes the row zero."""
    w = 5.0
    element = ReferenceFilter(name="filter", input="wish", frequency=w)
    place = element.place(None)
    for t in (0.0, 0.1, 0.7):
        decay = np.exp(-w * t)
        q, v, a = 1.0 - (1.0 + w * t) * decay, w * w * t * decay, w * w * (1.0 - w * t) * decay
        r = rows(element, place, np.array([q]), np.array([v]), np.array([a]), np.array([[1.0, 0.0, 0.0]]))
        # Terms of the row are of size w^2 = 25.
        assert r[0] == pytest.approx(0.0, abs=25 * ROUNDING)


def test_filter_starts_at_rest_at_its_input_or_where_told() -> None:
    """The hook reads the input at the start."""
    u = np.array([[0.4, 9.0, 9.0]])
    assert ReferenceFilter(name="f", input="s", frequency=5.0).start_states(None, np.zeros(1), u) == ((0.4, 0.0),)
    assert ReferenceFilter(name="f", input="s", frequency=5.0, start=0.0).start_states(None, np.zeros(1), u) == (
        (0.0, 0.0),
    )

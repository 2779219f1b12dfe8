"""A pendulum with two ropes under PID control: the DAE against an independent ordinary differential equation.

The reference has one angle, written by hand: J theta'' = -m g l sin(theta) - tau_1 l_1'(theta) - tau_2 l_2'(theta),
with the error measured, e = psi - theta, instead of integrated, and solved by scipy's Radau method.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dms_core.model.bodies.rigid_body import RigidBody
from dms_core.model.constraints.joints.revolute import Revolute
from dms_core.model.control import Pid, ReferenceFilter, RopeActuator
from dms_core.model.element import Force
from dms_core.model.forces.gravity import Gravity
from dms_core.model.geometry.path import PathPoint
from dms_core.model.ropes.rope_force import RopeForce
from dms_core.model.sensors import JointAngle, Tracking
from dms_core.model.signals import Constant, Input, MinimumJerk, Steps
from dms_core.model.system import System
from dms_core.simulation.dynamics import SolverOptions, simulate

MASS, LENGTH, INERTIA, GRAVITY = 1.5, 0.15, 0.02, 9.80665
KP, KI, KD = 300.0, 200.0, 15.0
LAG, PRETENSION, WIDTH = 0.01, 3.0, 4.0
ANCHOR, LEVER = np.array([0.15, 0.1]), np.array([0.03, -0.1])
"""Ends of the agonist, on the ground and on the arm [m]; the antagonist mirrors both."""
TIMES, ANGLES = (0.1, 0.6, 0.9, 1.4), (0.0, 0.8, 0.8, 0.2)
END = 1.8
GRID = np.linspace(0.0, END, 91)


def _rope(name: str, side: float) -> tuple[Force, Force]:
    """An actuator and its rope; side +1 flexes."""
    motor = RopeActuator(
        name=f"{name}_motor", pid="pid", sign=int(side), time_constant=LAG, pretension=PRETENSION, width=WIDTH
    )
    path = (
        PathPoint(point=(side * ANCHOR[0], ANCHOR[1], 0.0)),
        PathPoint(body="arm", point=(side * LEVER[0], LEVER[1], 0.0)),
    )
    return motor, RopeForce(name=f"{name}_rope", path=path, coordinate=f"{name}_motor.tension")


def _system(pid: Pid, *forces: Force, inputs: tuple[Input, ...]) -> System:
    return System(
        bodies=[
            RigidBody(name="arm", mass=MASS, inertia=(INERTIA, INERTIA, INERTIA), centre_of_mass=(0.0, -LENGTH, 0.0))
        ],
        constraints=[Revolute(name="hinge", body_j="arm")],
        forces=[Gravity(name="gravity"), *forces, pid, *_rope("flexor", 1.0), *_rope("extensor", -1.0)],
        sensors=[JointAngle(name="angle", joint="hinge"), Tracking(name="tracking", pid="pid")],
        inputs=inputs,
    )


def _tracking_system(drift_gain: float = 0.0) -> System:
    pid = Pid(name="pid", joint="hinge", reference="psi", kp=KP, ki=KI, kd=KD, drift_gain=drift_gain)
    return _system(pid, inputs=(Input(name="psi", signal=MinimumJerk(times=TIMES, values=ANGLES)),))


def _reference_signal(t: float) -> tuple[float, float]:
    """Minimum-jerk moves between the given points: value [rad] and rate [rad/s]."""
    for t0, t1, x0, x1 in zip(TIMES[:-1], TIMES[1:], ANGLES[:-1], ANGLES[1:], strict=True):
        if t0 <= t < t1:
            s, d, T = (t - t0) / (t1 - t0), x1 - x0, t1 - t0
            return x0 + d * (10 * s**3 - 15 * s**4 + 6 * s**5), d / T * 30 * s**2 * (1 - s) ** 2
    return (ANGLES[0] if t < TIMES[0] else ANGLES[-1]), 0.0


def _positive(x: float) -> float:
    """The smoothed positive part as documented."""
    s = np.clip(x / WIDTH + 0.5, 0.0, 1.0)
    return WIDTH * (s**3 - s**4 / 2) + max(x - WIDTH / 2, 0.0)


def _leverage(theta: float, side: float) -> float:
    """dl/dtheta of a straight rope from anchor A to the point R(theta) b: l l' = (R b - A) . R' b."""
    c, s = np.cos(theta), np.sin(theta)
    mirror = np.array([side, 1.0])
    b, A = mirror * LEVER, mirror * ANCHOR
    point = np.array([c * b[0] - s * b[1], s * b[0] + c * b[1]])
    tangent = np.array([-point[1], point[0]])
    return float((point - A) @ tangent / np.linalg.norm(point - A))


def _slope(t: float, y: np.ndarray, signal=_reference_signal) -> list[float]:
    """Right-hand side for y = (theta, omega, integral of e, tension flexor, tension extensor)."""
    theta, omega, integral, flexor, extensor = y
    psi, psi_rate = signal(t)
    command = KI * integral + KP * (psi - theta) + KD * (psi_rate - omega)
    moment = -MASS * GRAVITY * LENGTH * np.sin(theta)
    moment -= flexor * _leverage(theta, 1.0) + extensor * _leverage(theta, -1.0)
    return [
        omega,
        moment / (INERTIA + MASS * LENGTH**2),
        psi - theta,
        (PRETENSION + _positive(command) - flexor) / LAG,
        (PRETENSION + _positive(-command) - extensor) / LAG,
    ]


def _by_scipy(signal=_reference_signal) -> np.ndarray:
    """The reference on GRID, shape (5, 91)."""
    start = PRETENSION + 3.0 * WIDTH / 32.0
    y0 = [0.0, 0.0, 0.0, start, start]
    # A short largest step, because the reference's third derivative jumps at the ends of its moves.
    solution = solve_ivp(
        lambda t, y: _slope(t, y, signal), (0.0, END), y0, "Radau", GRID, rtol=1e-9, atol=1e-11, max_step=0.01
    )
    assert solution.success
    return solution.y


def test_loop_equals_the_ordinary_differential_equation() -> None:
    """Angle, integral and both tensions, and the error falls with the tolerance."""
    expected = _by_scipy()
    largest = []
    for rtol in (1e-5, 1e-7):
        found = simulate(_tracking_system(), END, SolverOptions(rtol=rtol)).check().at(GRID)
        # A method of order 2 accumulates some hundred local errors of rtol over the run.
        assert found.sensors()["angle.angle"] == pytest.approx(expected[0], abs=100 * rtol)
        assert found.coordinate("pid.error_integral") == pytest.approx(expected[2], abs=100 * rtol)
        for name, tension in (("flexor", expected[3]), ("extensor", expected[4])):
            # Tensions are up to 20 N and follow KP and KD times errors of the angle and its rate.
            assert found.coordinate(f"{name}_motor.tension") == pytest.approx(tension, abs=KP * 100 * rtol)
        largest.append(np.abs(found.sensors()["angle.angle"] - expected[0]).max())
    assert largest[1] < 0.2 * largest[0]


def _drift(drift_gain: float, rtol: float) -> float:
    """Largest |v_c - e| of the run [rad], which has errors of tracking far above it."""
    y = simulate(_tracking_system(drift_gain), END, SolverOptions(rtol=rtol)).check().sensors()
    assert np.abs(y["tracking.error"]).max() > 1e-3
    return float(np.abs(y["tracking.drift"]).max())


def test_drift_of_the_integrated_error_falls_with_the_tolerance() -> None:
    """Without feedback v_c leaves e by the accumulated error of integration, and by nothing else."""
    coarse, fine = _drift(0.0, 1e-5), _drift(0.0, 1e-7)
    # As above: hundred local errors of rtol. Order 2 gives 100^(2/3) = 22 between the two; 10 leaves room.
    assert coarse < 100 * 1e-5
    assert fine < 0.1 * coarse


def test_feedback_holds_the_drift_below_a_microradian() -> None:
    """At default tolerances, the bound that the model promises for its scenarios."""
    assert _drift(1e4, SolverOptions().rtol) < 1e-6


def test_a_jumping_setpoint_passes_the_filter() -> None:
    """A step of the wish, seen through a critically damped filter, against the filter's closed form."""
    w, wish, jump = 25.0, 0.5, 0.2
    setpoint = ReferenceFilter(name="filter", input="wish", frequency=w)
    pid = Pid(name="pid", joint="hinge", offset="filter.setpoint", kp=KP, ki=KI, kd=KD)
    course = Input(name="wish", signal=Steps(times=(0.0, jump), values=(0.0, wish)))
    found = simulate(_system(pid, setpoint, inputs=(course,)), END, SolverOptions(rtol=1e-6)).check().at(GRID)

    def filtered(t: float) -> tuple[float, float]:
        x = w * max(t - jump, 0.0)
        return wish * (1.0 - (1.0 + x) * np.exp(-x)), wish * w * x * np.exp(-x)

    # As above: hundred local errors of rtol.
    assert found.coordinate("filter.setpoint") == pytest.approx([filtered(t)[0] for t in GRID], abs=1e-4)
    assert found.sensors()["angle.angle"] == pytest.approx(_by_scipy(filtered)[0], abs=1e-4)


def test_start_is_the_present_error() -> None:
    """The filter's setpoint, which starts at its input, reaches the controller's start."""
    setpoint = ReferenceFilter(name="filter", input="wish", frequency=25.0)
    pid = Pid(name="pid", joint="hinge", offset="filter.setpoint", kp=KP)
    system = _system(pid, setpoint, inputs=(Input(name="wish", signal=Constant(value=0.3)),))
    trajectory = simulate(system, 0.01).check()
    assert trajectory.at([0.0]).rate("pid.error_integral") == pytest.approx(0.3, abs=1e-14)

"""Rigid bodies: chain of N rods, four-bar linkage, Euler's top, driven joint."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.model import (
    AngleDriver,
    Function,
    Gravity,
    Harmonic,
    Input,
    JointAngle,
    JointReaction,
    Point,
    Revolute,
    RigidBody,
    System,
)
from dms_core.model.geometry.frames import g_matrix, quaternion, rotation_matrix
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.literature.chain import chain, tip

TIPS = {
    1: (-0.999966588072, -0.008174517717),
    2: (-1.662115135816, -1.041466637193),
    4: (-1.001231213963, -3.607961551270),
    8: (5.183553317252, -4.878764572808),
}
"""Right end of the last rod after 1 s [m]: relative coordinates, DOP853 at 1e-12."""


@pytest.mark.parametrize("n", TIPS)
def test_tip_of_the_chain(n):
    """Steps of 1 ms and of half of it, extrapolated: what is left is of order three.

    At a fixed step rtol only says when Newton's method stops; what it leaves must be small beside the method's error.
    """
    model = Model(chain(n))
    one, half = (tip(simulate(model, 1.0, SolverOptions(fixed_step=h, rtol=1e-9)).check().q[-1]) for h in (1e-3, 5e-4))
    wanted = np.array([*TIPS[n], 0.0])
    error = np.abs(one - wanted).max()
    extrapolated = np.abs((4.0 * half - one) / 3.0 - wanted).max()
    # Seen: 5e-6 to 4e-5 m, and 4e-8 to 7e-7 m.
    assert error < 1e-4
    assert extrapolated < 2e-6
    assert extrapolated < 0.1 * error


@pytest.mark.parametrize("n", [2, 8])
def test_tip_of_the_chain_under_error_control(n):
    end = tip(simulate(chain(n), 1.0, SolverOptions(rtol=1e-8)).check().q[-1])
    np.testing.assert_allclose(end, [*TIPS[n], 0.0], atol=2e-6)


CRANK, COUPLER, ROCKER, BASE = 0.1, 0.35, 0.25, 0.3
OMEGA = 3.0


def _coupler_angle(theta: float) -> float:
    """Loop equation crank + coupler = base + rocker, open branch: law of cosines on the diagonal."""
    pin = CRANK * np.array([np.cos(theta), np.sin(theta)])
    diagonal = np.array([BASE, 0.0]) - pin
    d = np.hypot(*diagonal)
    return np.arctan2(diagonal[1], diagonal[0]) + np.arccos((COUPLER**2 + d**2 - ROCKER**2) / (2 * COUPLER * d))


def _rocker_angle(theta: float) -> float:
    phi = _coupler_angle(theta)
    end = CRANK * np.array([np.cos(theta), np.sin(theta)]) + COUPLER * np.array([np.cos(phi), np.sin(phi)])
    return np.arctan2(end[1], end[0] - BASE)


def _link(name: str, length: float, at, angle: float) -> RigidBody:
    return RigidBody(
        name=name,
        mass=2.0 * length,
        inertia=(1e-4, length**3 / 6.0, length**3 / 6.0),
        centre_of_mass=(length / 2, 0.0, 0.0),
        position=(*at, 0.0),
        orientation=tuple(quaternion((0, 0, 1), angle)),
    )


def _steady(t):
    return OMEGA * t, OMEGA, 0.0


def four_bar() -> System:
    """A crank driven at constant speed."""
    phi, psi = _coupler_angle(0.0), _rocker_angle(0.0)
    return System(
        "four-bar",
        bodies=[
            _link("crank", CRANK, (0.0, 0.0), 0.0),
            _link("coupler", COUPLER, (CRANK, 0.0), phi),
            _link("rocker", ROCKER, (BASE, 0.0), psi),
        ],
        constraints=[
            Revolute(name="a", body_j="crank"),
            Revolute(name="b", body_i="crank", body_j="coupler", point_i=(CRANK, 0, 0), point_j=(0, 0, 0)),
            Revolute(name="c", body_i="coupler", body_j="rocker", point_i=(COUPLER, 0, 0), point_j=(ROCKER, 0, 0)),
            Revolute(name="d", body_j="rocker", point_i=(BASE, 0, 0), point_j=(0, 0, 0)),
            AngleDriver(name="motor", joint="a", input="turn"),
        ],
        sensors=[
            Point(name="pin", body="rocker", point=(ROCKER, 0, 0)),
            JointAngle(name="rocker_angle", joint="d"),
            JointReaction(name="drive", constraint="motor", body="crank"),
        ],
        inputs=[Input(name="turn", signal=Function(function=_steady))],
    )


def coupler_end(times: np.ndarray) -> np.ndarray:
    """Where the loop equation has the pin between coupler and rocker [m], shape (k, 2)."""
    theta = OMEGA * times
    phi = np.array([_coupler_angle(x) for x in theta])
    return np.column_stack(
        [CRANK * np.cos(theta) + COUPLER * np.cos(phi), CRANK * np.sin(theta) + COUPLER * np.sin(phi)]
    )


class TestFourBar:
    """A crank driven at constant speed; four hinges in space make three rows redundant."""

    @pytest.fixture(scope="class")
    @classmethod
    def run(cls) -> Trajectory:
        return simulate(four_bar(), 2.0, SolverOptions(rtol=1e-7)).check()

    def test_redundant_rows(self, run):
        assert run.model.degrees_of_freedom == 0
        assert len(run.model.redundant_rows) == 3
        assert all(row.split(".")[1] in ("z", "tilt_f", "tilt_g") for row in run.model.redundant_rows)

    def test_coupler_obeys_the_loop_equation(self, run):
        y = run.sensors()
        found = np.column_stack([y["pin.position.x"], y["pin.position.y"]])
        # The motion is kinematic: every step solves the loop to the constraint tolerance, 1e-10.
        np.testing.assert_allclose(found, coupler_end(run.t), atol=1e-9)

    def test_rocker_rates_and_accelerations(self, run):
        times = np.linspace(0.1, 1.9, 37)
        y, h = run.sensors(times), 1e-4
        angle = np.array([[_rocker_angle(OMEGA * (t + k * h)) for k in (-1, 0, 1)] for t in times])
        # Central differences err by h^2 of a derivative near 20; the dense output by 1e-7 of the rates.
        np.testing.assert_allclose(y["rocker_angle.rate"], (angle[:, 2] - angle[:, 0]) / (2 * h), atol=2e-6)
        second = (angle[:, 2] - 2 * angle[:, 1] + angle[:, 0]) / h**2
        np.testing.assert_allclose(y["rocker_angle.acceleration"], second, atol=2e-2)

    def test_power_of_the_drive_is_the_change_of_kinetic_energy(self, run):
        y = run.sensors()
        energy = np.array([_kinetic(run.model, q, v) for q, v in zip(run.q, run.v, strict=True)])
        work = np.concatenate(
            [[0.0], np.cumsum(np.diff(run.t) * 0.5 * OMEGA * (y["drive.Mz"][1:] + y["drive.Mz"][:-1]))]
        )
        assert np.ptp(energy) > 1e-2
        # Trapezoidal rule over some thousand steps.
        np.testing.assert_allclose(energy - energy[0], work, atol=1e-6)


def _kinetic(model: Model, q: np.ndarray, v: np.ndarray) -> float:
    total = 0.0
    for body in model.system.bodies:
        o = model.layout.offset[body.name]
        omega = 2.0 * g_matrix(q[o + 3 : o + 7]) @ v[o + 3 : o + 7]
        total += 0.5 * body.mass * v[o : o + 3] @ v[o : o + 3] + 0.5 * omega @ body.inertia_matrix() @ omega
    return total


TILTED = quaternion((1.0, 2.0, -0.5), 0.9)
"""Orientation of the free bodies at the start."""


def free_body(inertia, omega) -> System:
    """A body that starts with `omega` [rad/s] in its own axes, at a general orientation."""
    p = TILTED
    body = RigidBody(
        name="top",
        mass=1.3,
        inertia=inertia,
        orientation=tuple(p),
        velocity=(0.1, 0.2, 0.3),
        angular_velocity=tuple(rotation_matrix(p) @ np.array(omega)),
    )
    return System("top", bodies=[body])


TIGHT = SolverOptions(rtol=1e-8)


def _top(inertia, omega) -> Trajectory:
    return simulate(free_body(inertia, omega), 3.0, TIGHT).check()


def _spin(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Angular velocity in body axes [rad/s] and rotation matrices, shapes (n, 3) and (n, 3, 3)."""
    omega = np.array([2.0 * g_matrix(q[3:]) @ v[3:] for q, v in zip(run.q, run.v, strict=True)])
    return omega, np.array([rotation_matrix(q[3:]) for q in run.q])


def test_free_body_keeps_energy_and_angular_momentum():
    """Spinning near its middle axis, so that it tumbles (Dzhanibekov)."""
    J = np.array([0.02, 0.03, 0.045])
    run = _top(tuple(J), (0.05, 6.0, 0.05))
    omega, A = _spin(run)
    assert omega[:, 1].min() < -4.0
    energy = 0.5 * (omega**2 @ J)
    momentum = np.einsum("kij,kj->ki", A, omega * J)
    # Tolerances 1e-8 a step over some 30000 steps, in units of 0.5 J and 0.18 N m s.
    np.testing.assert_allclose(energy, energy[0], rtol=2e-5)
    np.testing.assert_allclose(momentum, momentum[[0]].repeat(len(momentum), 0), atol=1e-5 * np.abs(momentum[0]).max())
    # The centre of mass moves uniformly.
    np.testing.assert_allclose(run.q[:, :3], run.t[:, None] * [0.1, 0.2, 0.3], atol=1e-9)


def test_symmetric_top_precesses_as_in_closed_form():
    """Body axes: omega turns about the axis at (J3 - J1) / J1 omega3. Space: the axis turns about L at |L| / J1."""
    J1, J3, w = 0.02, 0.035, np.array([1.0, 0.0, 4.0])
    run = _top((J1, J1, J3), tuple(w))
    omega, A = _spin(run)
    rate = (J3 - J1) / J1 * w[2]
    wanted = np.column_stack([np.cos(rate * run.t), np.sin(rate * run.t), np.full(len(run.t), w[2])])
    # 3e-5 rad/s were seen: the error in phase of a second-order method over 9 rad.
    np.testing.assert_allclose(omega, wanted, atol=1e-4)
    L = A[0] @ (np.array([J1, J1, J3]) * w)
    turn = [rotation_matrix(quaternion(L, np.linalg.norm(L) / J1 * t)) for t in run.t]
    np.testing.assert_allclose(A[:, :, 2], np.array(turn) @ A[0][:, 2], atol=3e-5)


AMPLITUDE, FREQUENCY, OFFSET = 0.8, 0.9, 0.3


def driven_rod() -> System:
    """It swings as a sine."""
    return System(
        "driven rod",
        bodies=[
            RigidBody(
                name="rod", mass=2.0, inertia=(0.01, 2 / 12, 2 / 12), centre_of_mass=(0.5, 0, 0),
                orientation=tuple(quaternion((0, 0, 1), 0.2)),
            )
        ],
        constraints=[Revolute(name="hinge", body_j="rod"), AngleDriver(name="motor", joint="hinge", input="angle")],
        forces=[Gravity(name="gravity", acceleration=(0.0, -9.81, 0.0))],
        sensors=[JointAngle(name="theta", joint="hinge"), JointReaction(name="drive", constraint="motor", body="rod")],
        inputs=[Input(name="angle", signal=Harmonic(amplitude=AMPLITUDE, frequency=FREQUENCY, offset=OFFSET))],
    )  # fmt: skip


def test_driven_joint_follows_its_input_and_shows_its_moment():
    """M = I thetaddot + m g l cos(theta) for a rod that swings as a sine; angle, rate and acceleration as given."""
    run = simulate(driven_rod(), 2.0, SolverOptions(rtol=1e-7)).check()
    y, x = run.sensors(), 2.0 * np.pi * FREQUENCY * run.t
    rate = 2.0 * np.pi * FREQUENCY
    theta, second = OFFSET + AMPLITUDE * np.sin(x), -AMPLITUDE * rate**2 * np.sin(x)
    np.testing.assert_allclose(y["theta.angle"], theta, atol=1e-9)
    np.testing.assert_allclose(y["theta.rate"], AMPLITUDE * rate * np.cos(x), atol=1e-9)
    # Accelerations are differences of velocities over a step: of order two in steps of 2e-4 s.
    np.testing.assert_allclose(y["theta.acceleration"], second, atol=2e-4)
    np.testing.assert_allclose(y["drive.Mz"], 2.0 / 3.0 * second + 9.81 * np.cos(theta), atol=2e-4)
    # The rod was declared 0.1 rad off the input's start, and assembled onto it.
    assert run.model.start.moved > 0.04

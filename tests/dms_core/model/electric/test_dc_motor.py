"""A direct-current motor against closed forms: spin-up, rest with a load, energy, gear, friction; and a winch."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.linalg import expm

from dms_core.assembly.model import Model
from dms_core.errors import ModelError
from dms_core.model import (
    CoordinateSensor,
    DcMotor,
    Gravity,
    Input,
    JointAngle,
    PathPoint,
    PointMass,
    Revolute,
    RigidBody,
    System,
    Winch,
    WinchSensor,
)
from dms_core.model.signals import Constant
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate

R, L, K, J, B, VOLTS = 1.2, 0.05, 0.08, 2e-3, 4e-4, 12.0
LOAD = 6e-3
"""Inertia of what the joint turns [kg m^2]."""
ARMATURE = {"resistance": R, "inductance": L, "torque_constant": K}


def drive(*, body_j: str = "wheel", forces=(), bodies=(), sensors=(), volts: float = VOLTS, **numbers) -> Model:
    """A wheel on the ground about z with a motor."""
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(LOAD, LOAD, LOAD))
    motor = DcMotor(name="motor", joint="axle", voltage="volts", **{**ARMATURE, **numbers})
    return Model(
        System(
            "drive", bodies=[wheel, *bodies], constraints=[Revolute(name="axle", body_j=body_j)],
            forces=[motor, *forces], inputs=[Input(name="volts", signal=Constant(value=volts))],
            sensors=[
                JointAngle(name="angle", joint="axle"),
                CoordinateSensor(name="current", coordinate="motor.current", unit="A"), *sensors,
            ],
        )
    )  # fmt: skip


def courses(run: Trajectory, t) -> tuple[np.ndarray, np.ndarray]:
    """Current [A] and speed of the joint [rad/s]."""
    y = run.sensors(t)
    return y["current.value"], y["angle.rate"]


@pytest.mark.parametrize("gear", [1.0, 5.0, -3.0])
def test_spin_up_has_both_time_constants(gear):
    """x = (i, w) of the joint is linear: x' = A x + b; its exponential holds both time constants."""
    inertia = LOAD + gear**2 * J
    A = np.array([[-R / L, -gear * K / L], [gear * K / inertia, -(gear**2) * B / inertia]])
    rest = np.linalg.solve(-A, [VOLTS / L, 0.0])
    run = simulate(drive(gear_ratio=gear, rotor_inertia=J, viscous_friction=B), 2.0, SolverOptions(rtol=1e-8)).check()
    t = np.linspace(0.0, 2.0, 41)
    exact = np.array([rest - expm(A * x) @ rest for x in t])
    current, rate = courses(run, t)
    assert np.abs(current - exact[:, 0]).max() < 2e-5 * np.abs(exact[:, 0]).max()
    assert np.abs(rate - exact[:, 1]).max() < 2e-5 * np.abs(exact[:, 1]).max()
    # Textbook: where the electrical time constant is far below the mechanical one they are L / R and J R / k^2.
    slow, fast = np.sort(-1.0 / np.linalg.eigvals(A).real)[::-1]
    if gear == 1.0:
        assert fast == pytest.approx(L / R, rel=0.05) and slow == pytest.approx(inertia * R / (K**2 + R * B), rel=0.05)


def test_electrical_work_is_mechanical_work_heat_and_what_is_stored():
    run = simulate(
        drive(gear_ratio=4.0, rotor_inertia=J, viscous_friction=B, coulomb_friction=0.02, coulomb_speed=2.0),
        1.0, SolverOptions(rtol=1e-8),
    ).check()  # fmt: skip
    t = np.linspace(0.0, 1.0, 4001)
    current, rate = courses(run, t)
    rotor = 4.0 * rate
    electrical = simpson(VOLTS * current, x=t)
    heat = simpson(R * current**2, x=t)
    friction = simpson(rotor * (B * rotor + 0.02 * np.tanh(rotor / 2.0)), x=t)
    stored = 0.5 * L * current[-1] ** 2 + 0.5 * (LOAD + 16.0 * J) * rate[-1] ** 2
    assert heat > 1.0 and friction > 1.0 and stored > 1.0
    assert electrical == pytest.approx(heat + friction + stored, rel=1e-6)


def test_at_rest_friction_and_voltage_balance():
    """R i + k w = u and k i = b w + c, far above the speed at which Coulomb friction is regularised."""
    run = simulate(drive(viscous_friction=B, coulomb_friction=0.05), 25.0, SolverOptions(rtol=1e-6)).check()
    w = (VOLTS - R * 0.05 / K) / (K + R * B / K)
    current, rate = courses(run, run.t[-1:])
    assert rate[0] == pytest.approx(w, rel=1e-5) and current[0] == pytest.approx((B * w + 0.05) / K, rel=1e-4)


def test_a_back_voltage_of_its_own():
    run = simulate(drive(back_voltage=0.16), 25.0, SolverOptions(rtol=1e-6)).check()
    assert courses(run, run.t[-1:])[1][0] == pytest.approx(VOLTS / 0.16, rel=1e-5)


OFF = math.hypot(1.0, 1.96) + 2.0
"""Length of the path at the start [m]."""


def winding(**numbers) -> Model:
    """A motor whose drum lifts 3 kg on an elastic rope over a point above it."""
    law: dict = {"radius": 0.04, "axial_stiffness": 4e4, "damping": 300.0, "wound": 0.0, "winds": 1} | numbers
    path = (
        PathPoint(point=(0.0, 0.04, 0.0)),
        PathPoint(point=(1.0, 2.0, 0.0)),
        PathPoint(body="mass", point=(0, 0, 0)),
    )
    mass = PointMass(name="mass", mass=3.0, position=(1.0, 0.0, 0.0))
    drum = Winch(name="drum", joint="axle", **({"path": path} | law))
    return drive(
        bodies=[mass], forces=[drum, Gravity(name="weight", acceleration=(0.0, -9.81, 0.0))],
        sensors=[WinchSensor(name="rope", winch="drum")], gear_ratio=15.0, rotor_inertia=1e-4, viscous_friction=1e-4,
    )  # fmt: skip


def test_a_winch_lifts_a_mass_at_the_speed_of_the_textbook():
    """k n i = n^2 b w + m g r and R i + k n w = u; the rope comes in at r w whatever it stretches by."""
    n, b, radius, force = 15.0, 1e-4, 0.04, 3.0 * 9.81
    w = (VOLTS - R * force * radius / (K * n)) / (K * n + R * n * b / K)
    run = simulate(winding(), 4.0, SolverOptions(rtol=1e-7)).check()
    t = np.array([3.5, 4.0])
    current, rate = courses(run, t)
    y = run.sensors(t)
    # It turns more than four times: nothing depends on the angle's principal value.
    assert w * 4.0 > 4.0 * 2.0 * math.pi
    assert rate == pytest.approx(w, rel=1e-5)
    assert current == pytest.approx((n * b * w + force * radius / n) / K, rel=1e-5)
    assert run.at(t).rate("mass.y") == pytest.approx(radius * w, rel=1e-4)
    assert y["rope.tension"] == pytest.approx(force, rel=1e-4) and y["rope.winding"] == pytest.approx(
        radius * w, rel=1e-5
    )
    # Free length and strain belong to each other.
    x = run.at(t).coordinate("drum.free_length")
    assert y["rope.length"] == pytest.approx(x * (1.0 + force / 4e4), rel=1e-6)


def test_the_winch_loses_nothing_but_what_damps():
    """Work of the motor = heat + kinetic and potential energy + strain energy off and on the drum."""
    model = winding(damping=0.0, free_length=OFF + 0.1)
    run = simulate(model, 1.5, SolverOptions(rtol=1e-8)).check()
    t = np.linspace(0.0, 1.5, 6001)
    current, rate = courses(run, t)
    y, at = run.sensors(t), run.at(t)
    x, tension = at.coordinate("drum.free_length"), y["rope.tension"]
    assert tension.min() >= 0.0 and np.any(tension == 0.0) and tension.max() > 30.0
    strain = 0.5 * tension**2 / 4e4
    wound = simpson(-strain * at.rate("drum.free_length"), x=t)
    work = simpson(VOLTS * current - R * current**2 - 15.0**2 * 1e-4 * rate**2, x=t) - 0.5 * L * current[-1] ** 2
    kinetic = 0.5 * (LOAD + 15.0**2 * 1e-4) * rate**2 + 1.5 * at.rate("mass.y") ** 2
    energy = kinetic + 3.0 * 9.81 * at.coordinate("mass.y") + strain * x
    assert work == pytest.approx(energy[-1] - energy[0] + wound, rel=2e-5)


def test_a_rope_that_is_all_off_its_drum_is_flagged():
    model = winding(free_length=OFF, wound=0.1, winds=-1)
    flags = simulate(model, 2.0, SolverOptions(rtol=1e-6)).flags
    (flag,) = [f for f in flags if f.element == "drum"]
    assert "all its rope was off the drum, which would wind it backwards" in flag.sentence
    assert flag.worst > OFF + 0.1


@pytest.mark.parametrize(
    ("numbers", "complaint"),
    [
        ({"gear_ratio": 0.0}, r"dc_motor 'motor': .*gear_ratio = 0: Expected a number other than 0"),
        ({"resistance": 0.0}, "resistance = 0.0: Expected a number above 0"),
        ({"inductance": -1.0}, "inductance = -1.0: Expected a number above 0"),
        ({"torque_constant": 0.0}, "torque_constant = 0.0: Expected a number above 0"),
        ({"rotor_inertia": -1.0}, "rotor_inertia = -1.0: Expected a number of at least 0"),
        ({"voltage": "amps"}, "dc_motor 'motor': input 'amps' does not exist. Declared: volts"),
        ({"joint": "hinge"}, "dc_motor 'motor': 'hinge' does not exist. Expected the name of a"),
    ],
)
def test_a_wrong_motor_is_refused(numbers, complaint):
    given = {"joint": "axle", "voltage": "volts", **ARMATURE, **numbers}
    with pytest.raises(ModelError, match=complaint):
        Model(
            System("x", bodies=[RigidBody(name="wheel", mass=1.0, inertia=(1.0, 1.0, 1.0))],
                   constraints=[Revolute(name="axle", body_j="wheel")], inputs=[Input(name="volts")],
                   forces=[DcMotor(name="motor", **given)])
        )  # fmt: skip


@pytest.mark.parametrize(
    ("numbers", "complaint"),
    [
        ({"wound": -0.2}, "winch 'drum': wound = -0.2: Expected a number of at least 0"),
        ({"radius": -0.04}, "radius = -0.04: Expected a number above 0"),
        ({"winds": 0}, "winds = 0: Expected 1 or -1"),
        ({"axial_stiffness": 0.0}, "axial_stiffness = 0.0: Expected a number above 0"),
        ({"path": (PathPoint(body="wheel", point=(0, 0.04, 0)), PathPoint(body="mass", point=(0, 0, 0)))},
         "winch 'drum': path.0 is on the drum 'wheel' itself"),
        ({"path": (PathPoint(point=(0, 0.04, 0)), PathPoint(point=(1, 0, 0)))},
         "winch 'drum': all points of the path are on 'ground'"),
    ],
)  # fmt: skip
def test_a_wrong_winch_is_refused(numbers, complaint):
    with pytest.raises(ModelError, match=complaint):
        winding(**numbers)
